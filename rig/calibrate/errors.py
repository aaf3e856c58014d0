"""What can go wrong when an instrument is calibrated from readings."""

from __future__ import annotations

from rig.errors import RigError


class CalibrateError(RigError):
    """Readings that no calibration can be made from; says which and why."""
