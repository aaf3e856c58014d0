"""Solid models of the actuators: one constructive description, faceted or exact."""
