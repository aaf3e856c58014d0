"""Metrics, uncertainty and the comparison of models with experiments."""
