"""The plant keeps to every closed form, within the tolerance that its case states."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.closed_forms import (
    AIR,
    CASES,
    TUBE_AREA,
    TUBE_DIAMETER,
    TUBE_LENGTH,
    steady_flow,
)


@pytest.mark.parametrize("what", CASES)
def test_the_plant_agrees_with_theory(what: str) -> None:
    found = CASES[what]()
    assert found.plant == pytest.approx(found.theory, rel=found.tolerance, abs=0.0)


def test_the_site_shows_the_cases(evidence) -> None:
    found = {what: compare() for what, compare in CASES.items()}
    evidence(
        "closed-forms-of-the-plant",
        "Virtual bench: gas, flow and drive against closed forms",
        {
            "case": list(found),
            "theory (SI)": [c.theory for c in found.values()],
            "plant (SI)": [c.plant for c in found.values()],
            "tolerated relative difference": [c.tolerance for c in found.values()],
        },
        rel=1e-4,
    )


def test_between_laminar_and_turbulent_more_pressure_brings_more_flow_without_jumps() -> None:
    resistance = 128 * AIR * TUBE_LENGTH / (np.pi * TUBE_DIAMETER**4)
    pressures = np.linspace(500, 8_000, 60)
    found = [steady_flow(p, tube_resistance=resistance, turbulence=1) for p in pressures]
    flow = np.array([q for q, _ in found])
    reynolds = np.array([q * rho * TUBE_DIAMETER / (AIR * TUBE_AREA) for q, rho in found])
    assert reynolds[0] < 2_300 < 4_000 < reynolds[-1]
    assert np.all(np.diff(flow) > 0)
    # per pressure never more than laminar flow, and falling from there evenly
    share = flow * resistance / pressures
    assert share[reynolds < 2_300] == pytest.approx(1, rel=1e-5)
    assert np.all(np.diff(share) < 1e-5)
    assert np.max(-np.diff(share)) < 0.06
