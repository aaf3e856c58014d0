"""Protocols that run on any bench: deformation, blocked force, abort and resume."""
