"""What can go wrong with a recorded run."""

from __future__ import annotations

from rig.errors import RigError


class RecordError(RigError):
    """A run that cannot be written, read or resumed; says where and what to do."""
