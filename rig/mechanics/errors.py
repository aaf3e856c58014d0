"""Errors of the mechanical models."""

from __future__ import annotations

from rig.errors import RigError


class MechanicsError(RigError):
    """A model cannot answer what it was asked: out of range, unknown model, not enough data."""
