"""The plant keeps to every closed form, within the tolerance that its case states."""

from __future__ import annotations

import pytest

from tests.plant.closed_forms import CASES


@pytest.mark.parametrize("what", CASES)
def test_the_plant_agrees_with_theory(what: str) -> None:
    found = CASES[what]()
    assert found.plant == pytest.approx(found.theory, rel=found.tolerance, abs=0.0)
