"""Whether a measured sweep can be true: the transducer kept its zero, the actuator follows.

No board can see these from its pressure alone: a reading that drifts looks like a leak, a kinked
tube like a stiff actuator, a reversed load cell like nothing at all.
"""

from __future__ import annotations

import math

from rig.experiment.errors import ExperimentError
from rig.record.documents import PointDocument

ZERO_FACTOR = 2.0
"""The vented reading may be off by this many times the tolerance of settling."""
RESPONSE_SHARE = 0.5
"""Within this share of the sweep's pressures the value must have moved."""
COVERAGE = 3.0
"""It has moved when it did by so many standard uncertainties."""
WHERE_TO_LOOK = {
    "deg": "Look for a blocked or kinked tube, and whether the camera shows this actuator. The "
    "actuator may still hold pressure",
    "mm": "Look for a blocked or kinked tube, and whether the camera shows this actuator's "
    "markers. The actuator may still hold pressure",
    "g": "Look for a blocked or kinked tube, whether the tip touches the load cell, and whether "
    "counts_per_gram has the right sign. The actuator may still hold pressure",
}


def require_zero(vented_kpa: float, tolerance_kpa: float) -> None:
    """Raise ExperimentError if the vented bench does not read zero."""
    limit_kpa = ZERO_FACTOR * tolerance_kpa
    if abs(vented_kpa) > limit_kpa:
        raise ExperimentError(
            f"the vented bench reads {vented_kpa:.3f} kPa, expected 0 within {limit_kpa:g} kPa: "
            "the transducer has moved since it was zeroed, and the points of this sweep are "
            "wrong by up to that. Let it warm up, check its supply, and take a new run."
        )


class ResponseCheck:
    """Follows one sweep over `range_kpa`: as the pressure rises, the value must."""

    def __init__(self, range_kpa: float) -> None:
        self._enough_kpa = RESPONSE_SHARE * range_kpa
        self._from: PointDocument | None = None

    def add(self, point: PointDocument) -> None:
        """Take the next point; raises ExperimentError if the actuator does not follow."""
        if point.value is None:
            return
        start = self._from
        if start is None or start.value is None:
            self._from = point
            return
        step_kpa = point.key.target_kpa - start.key.target_kpa
        if abs(step_kpa) < self._enough_kpa - 1e-9:
            return
        moved = (point.value - start.value) * (1 if step_kpa > 0 else -1)
        threshold = COVERAGE * math.hypot(point.value_u, start.value_u)
        if moved < threshold:
            raise ExperimentError(
                f"from {start.key.target_kpa:g} to {point.key.target_kpa:g} kPa the value went "
                f"from {start.value:.3f} to {point.value:.3f} {point.unit}; expected it to rise "
                f"and fall with the pressure, by {threshold:.3f} {point.unit} at least. "
                f"{WHERE_TO_LOOK[point.unit]}; the last points of this run are not to be trusted."
            )
        self._from = point
