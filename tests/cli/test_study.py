"""`rig study` from the command line."""

from __future__ import annotations

import json
from pathlib import Path

from .conftest import Command
from .test_bad_input import assert_explained

STUDY = """\
kind: study
name: two
actuator: bellow-bending
factors:
  - {name: wall, field: actuator.geometry.wall_thickness, low: 1.2 mm, high: 1.8 mm}
  - {name: modulus, field: material.young_modulus.value, low: 400 kPa, high: 500 kPa}
design: {kind: central-composite, face: faced, centre_points: 1}
responses:
  - {name: angle, quantity: angle, model: beam, pressure: 5 kPa, goal: maximise}
"""


def test_a_study_runs_and_is_known_the_second_time(rig: Command, tmp_path: Path) -> None:
    out, file = tmp_path / "out", tmp_path / "two.yaml"
    file.write_text(STUDY)
    first = rig("study", file, "--out", out, "--executor", "here", "--json")
    assert first.code == 0, first.err
    told = json.loads(first.out)
    assert told["computed"] == 9
    assert told["responses"]["angle"]["r2"] > 0.99
    assert told["optimum"]["factors"]["wall"] < 1.3
    assert told["optimum"]["on_bounds"] == ["wall", "modulus"]
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["executor"] == "here"
    assert "workers" not in manifest
    assert "threads" not in manifest
    for name in ("results.parquet", "manifest.json", "angle-surface.png", "angle-residuals.png"):
        assert (out / name).is_file()
    again = rig("study", file, "--out", out, "--executor", "here", "--no-plots")
    assert "0 computed, 9 known before" in again.out
    assert "stationary point" in again.out
    assert "wall is at a level" in again.out
    assert "Shapiro-Wilk" in again.out


def test_a_dry_run_shows_the_points_and_writes_nothing(rig: Command, tmp_path: Path) -> None:
    outcome = rig("study", "bellow-box-behnken", "--dry-run", "--out", tmp_path / "out")
    assert outcome.code == 0
    assert "15" in outcome.out
    assert not (tmp_path / "out").exists()


def test_unknown_studies_are_explained(rig: Command) -> None:
    assert_explained(rig("study", "bellow-box-benken"), "bellow-box-behnken")
