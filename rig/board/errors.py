"""What can go wrong when a bench is opened."""

from __future__ import annotations

from rig.errors import RigError


class BoardError(RigError):
    """The bench cannot be opened as its spec says."""
