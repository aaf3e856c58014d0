"""Bending angle from images of the side view, with uncertainty; untrusted frames are rejected."""
