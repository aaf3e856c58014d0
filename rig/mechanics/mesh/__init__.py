"""Meshes of the actuator families for the finite-element models."""
