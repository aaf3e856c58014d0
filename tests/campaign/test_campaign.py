"""Whole runs on a bench that breaks: the campaign's judgement, and that it can fail."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from rig.campaign.campaign import Campaign
from rig.campaign.judge import Verdict, judge
from rig.campaign.scenario import Outcome
from rig.campaign.table import write_tables
from rig.spec.faults import Expectation, FaultScript
from rig.spec.workspace import Workspace

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = Workspace(ROOT)
QUICK = (
    "sensor-open",
    "sensor-drift-down",
    "burst",
    "tube-blocked",
    "home-switch-stuck-closed",
    "hx711-stuck-low",
    "cable-pulled",
    "frames-replayed-at-rest",
    "brown-out",
    "watchdog-reset",
)
"""One of each sort; the others are behind the slow marker."""


Judged = Callable[..., Verdict]


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> Judged:
    campaign = Campaign(LIBRARY, "bellow-bending", "virtual-beam", 1)
    known: dict[str, Outcome] = {}

    def take(script: FaultScript, *, again: bool = False) -> Verdict:
        key = script.model_dump_json(exclude={"expect"})
        if again or key not in known:
            known[key] = campaign.judged(script, tmp_path_factory.mktemp("campaign")).outcome
        return judge(replace(known[key], script=script), campaign.healthy(script.protocol))

    return take


def script(name: str = "sensor-open", **changes: object) -> FaultScript:
    data = LIBRARY.faults(name).model_dump(mode="json", exclude_none=True)
    return FaultScript.model_validate({**data, **changes})


@pytest.mark.parametrize("name", QUICK)
def test_a_fault_is_taken_as_required(name: str, judged: Judged) -> None:
    verdict = judged(script(name))
    assert verdict.complaints == ()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_every_fault_is_taken_as_required(seed: int) -> None:
    campaign = Campaign(LIBRARY, "bellow-bending", "virtual-beam", seed)
    verdicts = campaign.run([LIBRARY.faults(name) for name in LIBRARY.names("faults")])
    assert {v.outcome.script.name: v.complaints for v in verdicts if not v.passed} == {}


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"expect": {"codes": ["leak"], "within": 1, "run": "failed"}}, "the fault code is"),
        ({"expect": {"codes": ["sensor_open"], "within": 0.005, "run": "failed"}}, "reacted after"),
        ({"expect": {"codes": ["sensor_open"], "within": 1, "run": "success"}}, "the run ended"),
        ({"expect": {"run": "failed"}}, "expected none"),
    ],
)
def test_another_reaction_than_expected_is_complained_about(
    changes: dict[str, object], complaint: str, judged: Judged
) -> None:
    verdict = judged(script(**changes))
    assert any(complaint in c for c in verdict.complaints)


def test_wrong_points_are_found(judged: Judged) -> None:
    expect = {"run": "failed", "actuator": "pressurised"}
    verdict = judged(script("tube-blocked", expect=expect))
    assert verdict.complaints == (f"{verdict.wrong_points} points are wrong and nobody was told",)


def test_a_fault_whose_moment_never_comes_is_complained_about(judged: Judged) -> None:
    never = {"kind": "sensor_open", "when": {"above": "30 kPa"}}
    verdict = judged(script(faults=[never], expect={"run": "success"}))
    assert verdict.complaints == ("the moment of the fault never came",)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"peak_kpa": 14.6}, "is above"),
        ({"final_kpa": 3.0}, "the actuator ended"),
        ({"valve_open": False}, "the actuator ended"),
        ({"log_problem": "it ends too soon"}, "the log"),
        ({"told": ()}, "other points"),
        ({"points": (), "told": ()}, "lacks points"),
    ],
)
def test_whatever_is_unsafe_or_lost_is_complained_about(
    changes: dict[str, object], complaint: str, judged: Judged
) -> None:
    healthy = judged(script("healthy")).outcome
    assert judge(healthy, healthy).passed
    verdict = judge(replace(healthy, **changes), healthy)  # type: ignore[arg-type]
    assert len(verdict.complaints) == 1
    assert complaint in verdict.complaints[0]


def test_the_same_seed_gives_the_same_table(judged: Judged, tmp_path: Path) -> None:
    for n in range(2):
        write_tables(tmp_path / str(n), [judged(script("bit-errors"), again=True)], "virtual")
    for name in ("campaign.csv", "campaign.json", "campaign.md"):
        assert (tmp_path / "0" / name).read_bytes() == (tmp_path / "1" / name).read_bytes()


def test_the_table_holds_what_was_judged(judged: Judged, tmp_path: Path) -> None:
    verdict = judged(script("sensor-open"))
    write_tables(tmp_path, [verdict], "virtual")
    (line,) = csv.DictReader((tmp_path / "campaign.csv").open(encoding="utf-8"))
    (scenario,) = json.loads((tmp_path / "campaign.json").read_text(encoding="utf-8"))["scenarios"]
    assert line["verdict"] == scenario["verdict"] == "pass"
    assert scenario["code"] == "sensor_open"
    assert float(line["valve_open_after_s"]) <= float(line["bound_s"]) == 0.016
    assert scenario["points"] == len(verdict.outcome.points) == 2


def test_no_script_may_expect_wrong_points_of_a_run_that_succeeds() -> None:
    with pytest.raises(ValueError, match="nobody would be told"):
        Expectation.model_validate({"run": "success", "wrong_points": True})
