"""Geometry families, beam theory, reduced responses: pressure in; angle, force, volume out."""
