"""`rig update` from the command line."""

from __future__ import annotations

import json
from pathlib import Path

from .conftest import Command
from .test_bad_input import assert_explained


def test_a_run_that_is_not_there_is_explained(rig: Command, tmp_path: Path) -> None:
    assert_explained(rig("update", tmp_path / "nothing"), "nothing", "rig characterise")


STUDY = """\
kind: study
name: wall-and-modulus
actuator: bellow-bending
factors:
  - {name: modulus, field: material.young_modulus.value, low: 382.5 kPa, high: 517.5 kPa}
  - {name: wall, field: actuator.geometry.wall_thickness, low: 1.41 mm, high: 1.59 mm}
design: {kind: central-composite, face: faced, centre_points: 1}
check_points: 4
responses:
""" + "".join(
    f"  - {{name: {kind}-{number}, quantity: {quantity}, model: beam, pressure: {pressure} kPa}}\n"
    for kind, quantity, pressures in (
        ("angle", "angle", (0, 2.5, 5, 7.5, 10)),
        ("force", "blocked_force", (2.5, 5, 7.5)),
    )
    for number, pressure in enumerate(pressures)
)


def test_a_run_tells_wall_and_modulus_by_the_surfaces_of_a_study(
    rig: Command, tmp_path: Path
) -> None:
    """Plain beam theory's surfaces do not know that the virtual actuator stiffens: it says so."""
    study, results, run = tmp_path / "study.yaml", tmp_path / "results", tmp_path / "run"
    study.write_text(STUDY, encoding="utf-8")
    made = rig(
        *("characterise", "--actuator", "tests/specs/bellow-bending.yaml"),
        *("--bench", "virtual-beam", "--protocol", "quick", "--seed", "2", "--out", run),
    )
    assert made.code == 0, made.err
    computed = rig("study", study, "--executor", "here", "--no-plots", "--out", results)
    assert computed.code == 0, computed.err

    asked = ("update", run, "--study", study, "--results", results)
    found = json.loads(rig(*asked, "--json").out)
    # the study has no force at 10 kPa
    assert found["levels_left_out"] == 1
    assert set(found["estimates"]) == {"modulus", "wall", "offset", "creep"}
    wall = found["estimates"]["wall"]
    assert wall["deviation"] < wall["prior_deviation"]
    told = rig(*asked)
    assert "1 levels are left out" in told.out
    assert "does not follow this run" in told.out
    assert "does not follow" not in rig("update", run).out

    nowhere = ("update", run, "--study", study, "--results", tmp_path / "nothing")
    assert_explained(rig(*nowhere), "nothing", "rig study")
