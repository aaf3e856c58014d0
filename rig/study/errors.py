"""What can go wrong with a study."""

from __future__ import annotations

from rig.errors import RigError


class StudyError(RigError):
    """A design, a response or an analysis that cannot be."""
