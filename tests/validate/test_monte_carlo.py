"""Budgets against the propagation of distributions (GUM Supplement 1), and that against itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import date

import numpy as np
import pytest

from rig.spec.calibration import LoadCellCalibration, Provenance, TransducerCalibration
from rig.validate.budget import (
    READINGS,
    force_components,
    pressure_components,
    readings,
    tare_component,
)
from rig.validate.errors import ValidateError
from rig.validate.monte_carlo import Array, propagate
from rig.validate.uncertainty import Component, combine

TRIALS = 400_000
PROVENANCE = Provenance(date=date(2026, 1, 1), method="test", instrument="none")
# bare numbers are in kPa and grams
TRANSDUCER = TransducerCalibration(
    kind="calibration",
    instrument="transducer",
    gain=10.0,
    gain_u=0.001,
    offset_voltage=0.5,
    span=14.0,
    bow=0.03,
    linearity_u=0.008,
    zero_u=0.005,
    provenance=PROVENANCE,
)
CELL = LoadCellCalibration(
    kind="calibration",
    instrument="load-cell",
    counts_per_gram=2000.0,
    counts_per_gram_u=0.001,
    span=200.0,
    bow=-0.05,
    linearity_u=0.04,
    creep_u=0.0005,
    zero_u=0.02,
    provenance=PROVENANCE,
)


def pressure_model(indicated_kpa: float, inputs: Mapping[str, Array]) -> Array:
    """The measurement as such, without a derivative: reading, line, bow."""
    line = (indicated_kpa + inputs[READINGS]) * (1 + inputs["pressure gain"])
    bow = TRANSDUCER.bow / 1e3 + inputs["pressure linearity"]
    x = line * 1e3 / TRANSDUCER.span
    return line + bow * 4 * x * (1 - x) + inputs["pressure zero"]


def force_model(indicated_g: float, inputs: Mapping[str, Array]) -> Array:
    """Counts over a sensitivity, which is what is uncertain, and what comes on top."""
    line = (indicated_g + inputs[READINGS] - inputs["tare"]) / (1 + inputs["load-cell sensitivity"])
    bow = CELL.bow * 1e3 + inputs["load-cell linearity"]
    x = line / 1e3 / CELL.span
    crept = line / (1 + inputs["load-cell creep"])
    return crept + bow * 4 * x * (1 - x) + inputs["load-cell zero"]


@pytest.mark.parametrize("indicated", [0.2, 3.0, 7.0, 13.5])
def test_the_budget_of_a_pressure_is_that_of_its_distribution(indicated: float) -> None:
    value = TRANSDUCER.corrected(indicated * 1e3) / 1e3
    budget = [readings(0.008, 20, "kPa"), *pressure_components(TRANSDUCER, value)]
    whole = combine(value, budget)
    found = propagate(
        lambda errors: pressure_model(indicated, errors), budget, TRIALS, np.random.default_rng(1)
    )
    assert found.mean == pytest.approx(value, abs=0.01 * whole.u)
    assert found.half_width == pytest.approx(whole.u95, rel=0.02)


@pytest.mark.parametrize("indicated", [2.0, 40.0, 100.0, 190.0])
def test_the_budget_of_a_force_is_that_of_its_distribution(indicated: float) -> None:
    value = CELL.corrected(indicated / 1e3) * 1e3
    budget = [
        readings(0.05, 30, "g"),
        tare_component(0.05, 30, 20),
        *force_components(CELL, value),
    ]
    whole = combine(value, budget)
    found = propagate(
        lambda errors: force_model(indicated, errors), budget, TRIALS, np.random.default_rng(2)
    )
    assert found.mean == pytest.approx(value, abs=0.01 * whole.u)
    assert found.half_width == pytest.approx(whole.u95, rel=0.02)


@pytest.mark.parametrize("calibration", [0.0, 0.03, 0.08])
def test_welch_and_satterthwaite_cover_as_often_as_they_say(calibration: float) -> None:
    # S1 takes the few repeats' t for the state of knowledge and is wider here; what counts is how
    # often the interval holds the truth
    rng = np.random.default_rng(3)
    held = 0
    for _ in range(4000):
        repeats = rng.normal(0, 0.1 * math.sqrt(5), 5)
        budget = [
            Component("repeats", float(repeats.std(ddof=1)) / math.sqrt(5), 4, kind="A"),
            Component("calibration", calibration),
        ]
        error = float(repeats.mean()) + calibration * rng.normal()
        held += abs(error) <= combine(0.0, budget).u95
    assert held / 4000 == pytest.approx(0.95, abs=0.012)


def test_a_rectangle_has_its_own_interval() -> None:
    # JCGM 101, 9.2.3: one rectangle of unit standard deviation reaches 0.95 sqrt(3)
    budget = [Component("resolution", 1.0, distribution="rectangular")]
    found = propagate(lambda e: e["resolution"], budget, TRIALS, np.random.default_rng(4))
    assert found.half_width == pytest.approx(0.95 * math.sqrt(3), rel=0.005)
    assert found.sd == pytest.approx(1.0, rel=0.005)


def test_four_rectangles_are_the_example_of_the_supplement() -> None:
    # JCGM 101, Table 3: four rectangles of unit standard deviation, interval [-3.88, 3.88]
    budget = [Component(str(n), 1.0, distribution="rectangular") for n in range(4)]
    found = propagate(
        lambda e: e["0"] + e["1"] + e["2"] + e["3"], budget, TRIALS, np.random.default_rng(5)
    )
    assert (found.low, found.high) == pytest.approx((-3.88, 3.88), abs=0.02)
    # the GUM's own would be 3.92: normal
    assert combine(0.0, budget).u95 == pytest.approx(3.92, abs=0.005)


def test_components_of_one_name_are_refused() -> None:
    with pytest.raises(ValidateError, match="names of their own"):
        propagate(lambda e: e["a"], [Component("a", 1.0)] * 2, 10, np.random.default_rng(1))
