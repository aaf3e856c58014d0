"""Designed experiments on specs: designs, executors, surfaces, sensitivity, optimisation."""
