"""Honest, fast, reproducible characterisation of soft pneumatic actuators."""

__version__ = "0.1.0"
