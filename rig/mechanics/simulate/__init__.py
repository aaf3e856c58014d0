"""Actuators as finite element models: one module a geometry family, results in field terms."""
