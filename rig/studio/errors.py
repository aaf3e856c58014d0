"""What the studio cannot do for whoever asks."""

from __future__ import annotations

from rig.errors import RigError


class StudioError(RigError):
    """The studio was asked for something that it does not do, or not for this session."""


class AccessError(StudioError):
    """The studio would be open to people who were not invited."""

    exit_code = 2
