"""Geometry families, beam theory and reduced responses: pressure in, angle, force and volume out."""
