"""Errors of the input decks."""

from __future__ import annotations

from rig.mechanics.errors import MechanicsError


class DeckError(MechanicsError):
    """A model has no counterpart in the other program, or its deck cannot be written."""
