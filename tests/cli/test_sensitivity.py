"""`rig sensitivity` from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rig.spec.workspace import Workspace, library_root

from .conftest import Command
from .test_bad_input import assert_explained


@pytest.mark.parametrize("method", ["sobol", "morris", "tolerance"])
def test_every_method_names_the_wall_first(rig: Command, method: str) -> None:
    arguments = ("bellow-bending-beam", "--method", method)
    outcome = rig("sensitivity", *arguments, "--samples", "256", "--json")
    assert outcome.code == 0, outcome.err
    factors = json.loads(outcome.out)["factors"]
    key = {"sobol": "total", "morris": "absolute", "tolerance": "share"}[method]
    assert max(factors, key=lambda name: factors[name][key]) == "wall"
    assert "wall" in rig("sensitivity", *arguments, "--samples", "256").out


def test_a_surface_answers_and_says_how_far_off_it_is(rig: Command, tmp_path: Path) -> None:
    shipped = Workspace(library_root()).path("study", "bellow-bending-beam").read_text()
    file, out = tmp_path / "checked.yaml", tmp_path / "out"
    file.write_text(shipped.replace("responses:", "check_points: 4\nresponses:"))
    done = rig("study", file, "--executor", "here", "--out", out, "--no-plots")
    assert done.code == 0, done.err
    assert "at 4 points that it was not fitted to" in done.out
    asked = ("sensitivity", file, "--method", "sobol", "--samples", "64", "--response", "volume")
    assert_explained(rig(*asked), "finished study")
    assert "at 4 points that it was not fitted to" in rig(*asked, "--study", out).out
    told = json.loads(rig(*asked, "--study", out, "--json").out)
    assert 0 < told["check"]["rmse"] <= told["check"]["largest"]


def test_what_beam_theory_cannot_answer_asks_for_a_study(rig: Command) -> None:
    assert_explained(
        rig("sensitivity", "bellow-box-behnken", "--method", "sobol"), "finished study"
    )
