"""What can go wrong when a run is reported."""

from __future__ import annotations

from rig.errors import RigError


class ReportError(RigError):
    """A run of which no report can be written; says why and what to do."""
