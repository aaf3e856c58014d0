"""Validated descriptions of actuators, materials, benches, protocols, calibrations; SI inside."""
