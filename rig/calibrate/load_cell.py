"""The load cell against masses: sensitivity, linearity, return to zero, creep.

A mass m (conventional, as sets of masses state it) presses with m g (1 - air / 8000) (OIML D 28);
forces are given in grams-force, so local gravity enters relative to the standard one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibrate.air import BUOYANCY
from rig.calibrate.curve import Curve, fit_curve
from rig.calibrate.errors import CalibrateError
from rig.calibrate.points import Row, above_zero, column, of_kind, table
from rig.spec.calibration import Evidence, LoadCellCalibration, Provenance
from rig.spec.quantity import STANDARD_GRAVITY

Array = NDArray[np.float64]
COLUMNS = ("mass_g", "counts", "time_s")
"""`kind` is zero (nothing on it), up, down, or creep (time since the mass was placed)."""
LEAST_CREEP = 10
"""Readings under a resting load, below which nothing is said of creep."""
MODEL = "force = offset + slope n + curvature n^2; grams-force, n in counts above zero"


def grams_force(mass_g: Array, gravity: float = STANDARD_GRAVITY) -> Array:
    """Force in grams-force of conventional masses in air, at a local `gravity` in m/s2."""
    return mass_g * (1 - BUOYANCY) * gravity / STANDARD_GRAVITY


@dataclass(frozen=True)
class Creep:
    """How much a reading changes while a load rests; shares of the load."""

    share: float
    """Positive if the reading grows."""
    share_u: float
    """Standard uncertainty: scatter of the readings, and drift of the zero meanwhile."""


@dataclass(frozen=True)
class LoadCellFit:
    """What the points say of a load cell; grams-force and counts."""

    curve: Curve
    zero_g: float
    """Standard uncertainty of a tare made earlier, from the returns to zero."""
    creep: Creep | None

    @property
    def creep_u(self) -> float:
        """What creep may add to a reading that is not corrected for it, relative to the load.

        It is somewhere between nothing and the whole: a rectangle, whose root mean square about
        zero is share / sqrt(3).
        """
        if self.creep is None:
            return 0.0
        return float(np.hypot(self.creep.share / np.sqrt(3), self.creep.share_u))

    def calibration(
        self, rows: Sequence[Row], reference_u: float, provenance: Provenance
    ) -> LoadCellCalibration:
        """The calibration; `reference_u` is the relative uncertainty of the masses."""
        curve = self.curve
        findings = {
            "hysteresis_g": curve.hysteresis,
            "residual_sd_linear_g": curve.linear.sd,
            "residual_sd_quadratic_g": curve.quadratic.sd,
        }
        if self.creep is not None:
            findings |= {"creep_share": self.creep.share, "creep_share_u": self.creep.share_u}
        return LoadCellCalibration(
            kind="calibration",
            instrument="load-cell",
            counts_per_gram=1 / curve.slope,
            counts_per_gram_u=float(np.hypot(curve.slope_u / curve.slope, reference_u)),
            span=curve.span,  # bare numbers are in grams
            bow=curve.bow,
            linearity_u=curve.bow_u,
            creep_u=self.creep_u,
            zero_u=self.zero_g,
            provenance=provenance,
            evidence=Evidence(
                columns=("down", "creep", *COLUMNS),
                rows=table(rows, COLUMNS, ("down", "creep")),
                fits=(
                    curve.linear.record(MODEL.replace(" + curvature n^2", "")),
                    curve.quadratic.record(MODEL),
                ),
                findings=findings,
            ),
        )


def fit_load_cell(rows: Sequence[Row], gravity: float = STANDARD_GRAVITY) -> LoadCellFit:
    """Fit points with the columns `COLUMNS`, in the order of time.

    Creep stays unknown with fewer than `LEAST_CREEP` readings of it. Raises CalibrateError where
    the others do not suffice.
    """
    steady = of_kind(rows, "zero", "up", "down")
    loaded = of_kind(steady, "up", "down")
    counts, drift = above_zero(steady, "counts")
    curve = fit_curve(
        counts,
        grams_force(column(loaded, "mass_g"), gravity),
        [row["kind"] == "down" for row in loaded],
    )
    crept = of_kind(rows, "creep")
    creep = None
    if len(crept) >= LEAST_CREEP:
        zero = column(of_kind(rows, "zero"), "counts")[-1]
        creep = fit_creep(column(crept, "time_s"), column(crept, "counts") - zero, drift)
    return LoadCellFit(curve, curve.slope * drift, creep)


def fit_creep(time_s: Array, counts: Array, drift: float = 0.0) -> Creep:
    """Creep from readings (n,) above zero at times (n,) since the load came on.

    It is the mean of the last third less the first.

    `drift` is the standard uncertainty in counts of a zero found earlier. Raises CalibrateError
    for fewer than `LEAST_CREEP` readings.
    """
    if time_s.size < LEAST_CREEP:
        raise CalibrateError(
            f"creep needs at least {LEAST_CREEP} readings; there are {time_s.size}."
        )
    late = counts[time_s > time_s.max() * 2 / 3]
    first = float(counts[np.argmin(time_s)])
    scatter = float(late.std(ddof=1)) * np.sqrt(1 + 1 / late.size)
    change = float(late.mean()) - first
    return Creep(change / first, float(np.hypot(scatter, drift)) / abs(first))
