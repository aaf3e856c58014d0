"""`rig predict` tells how close flanks come, and warns where they would pass through each other."""

from __future__ import annotations

from pathlib import Path

import pytest

from rig.mechanics.fe import Solution
from rig.mechanics.simulate.families import FAMILIES
from tests.mechanics.test_simulate_inflation import TUBES, BendingTube

from .conftest import Command


@pytest.fixture(autouse=True)
def a_small_model(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(FAMILIES, "bellow-bending", TUBES)
    monkeypatch.setenv("RIG_CACHE_DIR", str(tmp_path / "cache"))


def told(rig: Command, monkeypatch: pytest.MonkeyPatch, closing: float) -> str:
    """Output up to 2 kPa for flanks 1 mm apart that close by so many m/Pa."""
    measures = BendingTube.measures

    def with_flanks(self: BendingTube, solution: Solution) -> dict[str, float]:
        return {**measures(self, solution), "flank_gap": 1e-3 - closing * solution.pressure}

    monkeypatch.setattr(BendingTube, "measures", with_flanks)
    outcome = rig(
        *("predict", "--actuator", "models/actuators/bellow-bending.yaml", "--model", "fe"),
        *("--pressures", "0:2:1"),
    )
    assert outcome.code == 0, outcome.err
    return " ".join(outcome.out.split())


def test_the_smallest_gap_is_told(rig: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    out = told(rig, monkeypatch, 2e-7)
    assert "Tip free: flanks come as close as 0.6 mm, at 2 kPa." in out
    assert "Tip blocked: flanks come as close as 0.6 mm, at 2 kPa." in out
    assert "Warning" not in out


def test_flanks_that_touch_are_warned_of(rig: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    out = told(rig, monkeypatch, 1e-6)
    assert "Warning: tip free, flanks touch at 1 kPa and overlap by up to 1 mm, at 2 kPa" in out
