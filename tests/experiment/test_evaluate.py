"""From readings to points: means, rejections and combined uncertainty against hand calculation."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest

from rig.experiment.evaluate import (
    TARE_WORDS,
    CellReading,
    Visit,
    budget_lines,
    deformation_point,
    force_point,
)
from rig.record.documents import DeformationReading, PointKey
from rig.spec.calibration import (
    LoadCellCalibration,
    Provenance,
    TransducerCalibration,
)
from rig.spec.workspace import library_root
from rig.validate.uncertainty import Component

KEY = PointKey(experiment="deformation", repeat=1, direction="up", target_kpa=3.0)
PROVENANCE = Provenance(date=date(2026, 1, 1), method="test", instrument="none")
TRANSDUCER = TransducerCalibration.model_validate(
    {
        "kind": "calibration",
        "instrument": "transducer",
        "gain": "10 kPa/V",
        "gain_u": 0.001,
        "offset_voltage": "0.5 V",
        "span": "12 kPa",
        "bow": "0.04 kPa",
        "linearity_u": "0.01 kPa",
        "zero_u": "0.005 kPa",
        "provenance": PROVENANCE,
    }
)
VISIT = Visit(KEY, 0.0, 1.0, 31.0, 32.0, np.array([2.99, 3.01, 3.00]), TRANSDUCER)
CELL = LoadCellCalibration.model_validate(
    {
        "kind": "calibration",
        "instrument": "load-cell",
        "counts_per_gram": 2000.0,
        "counts_per_gram_u": 0.001,
        "span": "40 g",
        "bow": "-0.2 g",
        "linearity_u": "0.03 g",
        "creep_u": 0.0005,
        "zero_u": "0.02 g",
        "provenance": PROVENANCE,
    }
)


def frame(angle: float | None, u: float = 0.03, reason: str = "") -> DeformationReading:
    return DeformationReading(
        key=KEY,
        frame=0,
        value=angle,
        unit="deg",
        u=u,
        parts=budget_lines([Component("edges", u, unit="deg")]) if angle is not None else (),
        quality=1.0,
        accepted=not reason,
        reason=reason,
    )


def test_an_angle_is_the_mean_of_the_accepted_frames() -> None:
    frames = [frame(30.0), frame(30.2), frame(90.0, reason="blurred")]
    point = deformation_point(VISIT, frames, "deg")
    assert point.value == pytest.approx(30.1)
    assert point.readings == 2
    assert point.rejected == ("blurred",)
    # 0.2 apart: s = 0.1414, s / sqrt(2) = 0.1; with 0.03 from vision
    assert point.value_u == pytest.approx(np.hypot(0.1, 0.03))


def test_a_point_without_a_good_frame_has_no_value() -> None:
    point = deformation_point(VISIT, [frame(None, reason="no end cap")], "deg")
    assert point.value is None
    assert point.readings == 0


def test_a_force_is_in_grams_with_calibration_in_its_uncertainty() -> None:
    readings = [CellReading(19_999, "ok"), CellReading(20_001, "ok")]
    point = force_point(VISIT, readings, CELL)
    # 10 g is a quarter of the span: three quarters of the bow
    assert point.value == pytest.approx(10.0 - 0.15)
    spread = np.std([19_999, 20_001], ddof=1) / 2000
    # the value itself, 9.85 g, is 0.742 of the bow and what scales with the load
    linearity = 0.03 * 4 * 0.24625 * 0.75375
    parts = [spread / 2**0.5, spread / 20**0.5, 0.00985, linearity, 0.0005 * 9.85, 0.02]
    assert [p.sensitivity * p.u for p in point.value_parts] == pytest.approx(parts)
    assert point.value_u == pytest.approx(np.linalg.norm(parts))
    assert [p.name for p in point.value_parts if p.kind == "A"] == ["readings", "tare"]


def test_a_pressure_is_corrected_for_the_bow_and_carries_its_own_budget() -> None:
    point = deformation_point(VISIT, [frame(30.0)], "deg")
    # 3 kPa is a quarter of the span
    assert point.pressure_kpa == pytest.approx(3.0 + 0.03)
    share = 4 * (3.03 / 12) * (1 - 3.03 / 12)
    parts = [0.01 / 3**0.5, 0.001 * 3.03, 0.01 * share, 0.005]
    assert [p.sensitivity * p.u for p in point.pressure_parts] == pytest.approx(parts)
    assert point.pressure_u_kpa == pytest.approx(np.linalg.norm(parts))


def test_what_vision_is_unsure_of_is_not_averaged_away() -> None:
    """It is one error for all frames of a still scene, as large as on the mean of its squares."""
    point = deformation_point(VISIT, [frame(30.0, 0.01), frame(30.0, 0.07)], "deg")
    u = {p.name: p.u for p in point.value_parts}
    assert u == pytest.approx({"readings": 0.0, "edges": np.sqrt((0.01**2 + 0.07**2) / 2)})


def test_a_tare_is_the_mean_of_as_many_words_as_the_firmware_takes() -> None:
    header = library_root() / "firmware/rig_mega/src/core/tare.h"
    assert f"kWords = {TARE_WORDS};" in header.read_text()


def test_bad_words_and_outliers_are_left_out_with_their_reasons() -> None:
    rng = np.random.default_rng(1)
    good = [CellReading(int(c), "ok") for c in rng.normal(20_000, 50, 200)]
    bad = [CellReading(40_001, "ok"), CellReading(3, "desync"), CellReading(9, "saturated")]
    point = force_point(VISIT, good + bad, CELL)
    assert sorted(point.rejected) == ["desync", "outlier", "saturated"]
    assert point.value == pytest.approx(10.0 - 0.15, abs=0.01)
