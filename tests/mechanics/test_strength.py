"""Safety: engineering quantities against the data sheet's, true ones against true ones."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.fe.extremes import Extremes, Peak
from rig.mechanics.strength import Criterion, safety
from rig.spec.material import MaterialSpec

AGILUS = {
    "kind": "material",
    "name": "Agilus30",
    "young_modulus": {"value": "450 kPa", "source": "test"},
    "poisson_ratio": {"value": 0.49, "source": "test"},
    "density": {"value": "1160 kg/m**3", "source": "test"},
}
STRENGTH = {"tensile_strength": {"low": "2.4 MPa", "high": "3.1 MPa", "source": "data sheet"}}
ELONGATION = {"elongation_at_break": {"low": "220 %", "high": "270 %", "source": "data sheet"}}


def _extremes(nominal: float, strain: float) -> Extremes:
    """An incompressible pulled bar."""

    def peak(value: float) -> Peak:
        return Peak(value, np.zeros(3), 0, False, value / 2)

    true = nominal * (1 + strain)
    return Extremes(10e3, peak(true), peak(true), peak(nominal), peak(strain), peak(0.0))


def _material(**sections: object) -> MaterialSpec:
    return MaterialSpec.model_validate({**AGILUS, **sections})


def test_a_bar_at_the_data_sheets_break_has_a_factor_of_one_by_every_criterion() -> None:
    found = safety(_extremes(2.4e6, 2.2), _material(**STRENGTH, **ELONGATION))
    assert [m.criterion for m in found.margins] == list(Criterion)
    for margin in found.margins:
        assert margin.factor == pytest.approx(1.0)
        assert margin.bulk_factor == pytest.approx(2.0)
    high = safety(_extremes(3.1e6, 2.7), _material(**STRENGTH, **ELONGATION))
    for margin in high.margins:
        assert margin.factor_high == pytest.approx(1.0)
    assert found.pressure == 10e3


def test_the_governing_criterion_has_the_smallest_factor() -> None:
    stretched = safety(_extremes(0.2e6, 1.1), _material(**STRENGTH, **ELONGATION))
    assert stretched.governing is not None
    assert stretched.governing.criterion is Criterion.ENGINEERING_STRAIN
    assert stretched.governing.factor == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("sections", "criteria"),
    [
        (STRENGTH, [Criterion.NOMINAL_STRESS]),
        (ELONGATION, [Criterion.ENGINEERING_STRAIN]),
        ({}, []),
    ],
)
def test_criteria_without_data_are_left_out(sections: dict, criteria: list[Criterion]) -> None:
    found = safety(_extremes(1e6, 1.0), _material(**sections))
    assert [m.criterion for m in found.margins] == criteria
    assert (found.governing is None) == (not criteria)


def test_without_load_the_factor_is_infinite() -> None:
    found = safety(_extremes(0.0, 0.0), _material(**ELONGATION))
    assert found.margins[0].factor == float("inf")
