"""The pressure transducer against a reference gauge or a dead-weight tester."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.calibrate.curve import Curve, fit_curve
from rig.calibrate.points import Row, above_zero, column, of_kind, table
from rig.spec.calibration import Evidence, Provenance, TransducerCalibration

COLUMNS = ("reference_kpa", "voltage_v")
"""`kind` is zero (vented), up or down."""
MODEL = "pressure = offset + slope v + curvature v^2; kPa, v in volts above the vented reading"


@dataclass(frozen=True)
class TransducerFit:
    """What the points say of a transducer; kPa and V."""

    curve: Curve
    zero_v: float
    """Mean vented reading."""
    zero_kpa: float
    """Standard uncertainty of a zero found earlier, from the vented readings."""

    def calibration(
        self, rows: Sequence[Row], reference_u: float, provenance: Provenance
    ) -> TransducerCalibration:
        """The calibration; `reference_u` is the relative uncertainty of the reference's scale."""
        curve = self.curve
        return TransducerCalibration(
            kind="calibration",
            instrument="transducer",
            gain=curve.slope,  # bare numbers are in kPa and V
            gain_u=float(np.hypot(curve.slope_u / curve.slope, reference_u)),
            offset_voltage=self.zero_v,
            span=curve.span,
            bow=curve.bow,
            linearity_u=curve.bow_u,
            zero_u=self.zero_kpa,
            provenance=provenance,
            evidence=Evidence(
                columns=("down", *COLUMNS),
                rows=table(rows, COLUMNS, ("down",)),
                fits=(
                    curve.linear.record(MODEL.replace(" + curvature v^2", "")),
                    curve.quadratic.record(MODEL),
                ),
                findings={
                    "hysteresis_kpa": curve.hysteresis,
                    "residual_sd_linear_kpa": curve.linear.sd,
                    "residual_sd_quadratic_kpa": curve.quadratic.sd,
                },
            ),
        )


def fit_transducer(rows: Sequence[Row]) -> TransducerFit:
    """Fit points with the columns `COLUMNS`, in the order of time.

    Raises CalibrateError where they do not suffice.
    """
    loaded = of_kind(rows, "up", "down")
    volts, drift = above_zero(of_kind(rows, "zero", "up", "down"), "voltage_v")
    curve = fit_curve(
        volts, column(loaded, "reference_kpa"), [row["kind"] == "down" for row in loaded]
    )
    zero_v = float(column(of_kind(rows, "zero"), "voltage_v").mean())
    return TransducerFit(curve, zero_v, curve.slope * drift)
