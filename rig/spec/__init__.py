"""Validated descriptions of actuators, materials, benches, protocols and calibrations; SI inside."""
