"""`rig compare-controllers` as people call it; what it computes is tested beside the experiment."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rig.experiment import controllers
from tests.benches import BEAM_ACTUATOR
from tests.cli.conftest import Command
from tests.control.families import family_of, realistic

SHORT = tuple(c for c in controllers.GAS_CASES if c.name == "0 to 8 kPa")


def test_controllers_are_compared_on_one_page(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(controllers, "GAS_CASES", SHORT)
    family = family_of(realistic(5.0))
    gains = {"proportional_ml_s_kpa": 4.0, "integral_ml_s2_kpa": 3.0, "feed_forward": 1.0}
    family = family.model_copy(update={"parameters": family.parameters | gains})
    (tmp_path / "identification.json").write_text(family.model_dump_json())
    page = tmp_path / "controllers.html"
    done = rig(
        *("compare-controllers", tmp_path, "--actuator", BEAM_ACTUATOR),
        *("--bench", "virtual-beam", "--out", page, "--json"),
    )
    assert done.code == 0, done.err
    (found,) = json.loads(done.out)
    assert len(found["outcomes"]) == 5 * len(SHORT)
    tuned = [o for o in found["outcomes"] if o["controller"] == "tuned PI + feed-forward"]
    assert all(o["steady_rmse_kpa"] < 0.02 for o in tuned)
    assert page.read_text(encoding="utf-8").count("<svg") == len(SHORT)


def test_a_real_bench_is_refused(rig: Command, tmp_path: Path) -> None:
    (tmp_path / "identification.json").write_text(family_of(realistic(5.0)).model_dump_json())
    done = rig("compare-controllers", tmp_path, "--actuator", BEAM_ACTUATOR, "--bench", "mega")
    assert done.code == 1
    assert "Nothing was moved" in " ".join(done.err.split())
