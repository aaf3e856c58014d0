"""A sensor's curve beside a reference: straight line, bow and hysteresis.

The reference is fitted by a straight line and by a parabola over the reading. Calibrations keep the
chord of the parabola from zero to the highest point, and its bow in the middle (terminal-based
linearity, IEC 61298-2): the zero itself is found anew before each use. The slope of the chord is
that of the derivative in the middle, which a design even about the middle finds independently of
the curvature, so that chord and bow may be taken for uncorrelated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibrate.errors import CalibrateError
from rig.calibrate.least_squares import LinearFit, least_squares

Array = NDArray[np.float64]
LEAST_POINTS = 5


@dataclass(frozen=True)
class Curve:
    """Reference over reading; reading counted from the zero. Units are the caller's."""

    linear: LinearFit
    quadratic: LinearFit
    top_reading: float
    hysteresis: float
    """Mean difference of the reference on the way down from that on the way up, at one reading."""

    @property
    def slope(self) -> float:
        """Of the chord from zero to the highest reading."""
        return self.quadratic["slope"] + self.quadratic["curvature"] * self.top_reading

    @property
    def slope_u(self) -> float:
        """Standard uncertainty of `slope`, without that of the reference's own scale."""
        return self.quadratic.u({"slope": 1.0, "curvature": self.top_reading})

    @property
    def span(self) -> float:
        """Reference at the end of the chord."""
        return self.slope * self.top_reading

    @property
    def bow(self) -> float:
        """What the parabola is above the chord in its middle."""
        return -self.quadratic["curvature"] * self.top_reading**2 / 4

    @property
    def bow_u(self) -> float:
        """Standard uncertainty of the bow; hysteresis counts as a rectangle of its width."""
        fitted = self.quadratic.u({"curvature": self.top_reading**2 / 4})
        return float(np.hypot(fitted, self.hysteresis / np.sqrt(12)))


def different_values(references: Sequence[float]) -> int:
    """How many there are; what differs by rounding is one."""
    return len({round(value, 9) for value in references})


def fit_curve(reading: Array, reference: Array, descending: Sequence[bool]) -> Curve:
    """Fit readings (n,), counted from the zero, against references (n,).

    Raises CalibrateError for fewer than five different references, or readings that do not rise.
    """
    different = different_values(reference.tolist())
    if different < LEAST_POINTS:
        raise CalibrateError(
            f"a curve needs at least {LEAST_POINTS} different references; there are {different}."
        )
    one = np.ones_like(reading)
    linear = least_squares({"offset": one, "slope": reading}, reference)
    quadratic = least_squares({"offset": one, "slope": reading, "curvature": reading**2}, reference)
    curve = Curve(linear, quadratic, float(reading.max()), _hysteresis(linear, descending))
    if not curve.slope > 0:
        raise CalibrateError(
            "the reading falls while the reference rises; check the wiring's polarity."
        )
    return curve


def _hysteresis(linear: LinearFit, descending: Sequence[bool]) -> float:
    """Mean residual down minus mean residual up; zero if only one way was gone."""
    down = np.asarray(descending, dtype=bool)
    if down.all() or not down.any():
        return 0.0
    return float(linear.residuals[down].mean() - linear.residuals[~down].mean())
