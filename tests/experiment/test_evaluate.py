"""From readings to points: means, rejections and combined uncertainty against hand calculation."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest

from rig.experiment.evaluate import CellReading, Visit, angle_point, force_point
from rig.record.documents import AngleReading, PointKey
from rig.spec.calibration import LoadCellCalibration, Provenance

KEY = PointKey(experiment="deformation", repeat=1, direction="up", target_kpa=3.0)
VISIT = Visit(KEY, 0.0, 1.0, 31.0, 32.0, np.array([2.99, 3.01, 3.00]))
PROVENANCE = Provenance(date=date(2026, 1, 1), method="test", instrument="none")
CELL = LoadCellCalibration.model_validate(
    {
        "kind": "calibration",
        "instrument": "load-cell",
        "counts_per_gram": 2000.0,
        "counts_per_gram_u": 0.001,
        "creep_u": "0.02 g",
        "provenance": PROVENANCE,
    }
)


def frame(angle: float | None, u: float = 0.03, reason: str = "") -> AngleReading:
    return AngleReading(
        key=KEY,
        frame=0,
        angle_deg=angle,
        u_deg=u,
        quality=1.0,
        accepted=not reason,
        reason=reason,
    )


def test_an_angle_is_the_mean_of_the_accepted_frames() -> None:
    point = angle_point(VISIT, [frame(30.0), frame(30.2), frame(90.0, reason="blurred")])
    assert point.value == pytest.approx(30.1)
    assert point.readings == 2
    assert point.rejected == ("blurred",)
    assert point.pressure_kpa == pytest.approx(3.0)
    # 0.2 apart: s = 0.1414, s / sqrt(2) = 0.1; with 0.03 from vision
    assert point.value_u == pytest.approx(np.hypot(0.1, 0.03))


def test_a_point_without_a_good_frame_has_no_value() -> None:
    point = angle_point(VISIT, [frame(None, reason="no end cap")])
    assert point.value is None
    assert point.readings == 0


def test_a_force_is_in_grams_with_calibration_in_its_uncertainty() -> None:
    readings = [CellReading(19_999, "ok"), CellReading(20_001, "ok")]
    point = force_point(VISIT, readings, CELL)
    assert point.value == pytest.approx(10.0)
    spread = np.std([19_999, 20_001], ddof=1) / 2000
    expected = np.sqrt(spread**2 / 2 + (0.001 * 10) ** 2 + 0.02**2)
    assert point.value_u == pytest.approx(expected)


def test_bad_words_and_outliers_are_left_out_with_their_reasons() -> None:
    rng = np.random.default_rng(1)
    good = [CellReading(int(c), "ok") for c in rng.normal(20_000, 50, 200)]
    bad = [CellReading(40_001, "ok"), CellReading(3, "desync"), CellReading(9, "saturated")]
    point = force_point(VISIT, good + bad, CELL)
    assert sorted(point.rejected) == ["desync", "outlier", "saturated"]
    assert point.value == pytest.approx(10.0, abs=0.01)
