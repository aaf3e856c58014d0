"""Errors of the solid models."""

from __future__ import annotations

from rig.mechanics.errors import MechanicsError


class CadError(MechanicsError):
    """A solid cannot be built or written, or the library that would is missing."""
