"""`rig optimise` from the command line."""

from __future__ import annotations

import json
from pathlib import Path

from rig.spec.check import check_file
from rig.spec.workspace import Workspace, library_root

from .conftest import Command
from .test_bad_input import assert_explained

SHIPPED = Workspace(library_root()).path("optimisation", "bellow-bending-angle")


def test_the_shipped_search_beats_the_default_within_its_limits(
    rig: Command, tmp_path: Path
) -> None:
    file = tmp_path / "short.yaml"
    file.write_text(SHIPPED.read_text().replace("starts: 4, hops: 2", "starts: 1, hops: 1"))
    outcome = rig("optimise", file, "--out", tmp_path / "out", "--json", "--no-plot")
    assert outcome.code == 0, outcome.err
    told = json.loads(outcome.out)
    (best,) = told["best"]
    assert best["responses"]["angle"] > 1.2 * told["default"]["angle"]
    assert best["responses"]["air"] <= 14.538 * (1 + 1e-6)
    assert best["responses"]["force"] >= 18.447 * (1 - 1e-6)
    assert check_file(tmp_path / "out" / "best-1.yaml").problems == ()


def test_limits_that_nothing_keeps_are_told_of(rig: Command, tmp_path: Path) -> None:
    file = tmp_path / "none.yaml"
    text = SHIPPED.read_text().replace("starts: 4, hops: 2", "starts: 1, hops: 0")
    file.write_text(text.replace("at_least: 18.447", "at_least: 1800"))
    assert_explained(rig("optimise", file, "--out", tmp_path / "out"), "relax them")


def test_a_search_of_one_point_shows_it_without_a_picture(rig: Command, tmp_path: Path) -> None:
    file, out = tmp_path / "one.yaml", tmp_path / "out"
    text = SHIPPED.read_text().replace("at_most: 14.538", "at_most: 100")
    head, _ = text.replace("at_least: 18.447", "at_least: 0").split("search:")
    file.write_text(f"{head}search: {{kind: bayesian, evaluations: 1}}\n")
    out.mkdir()
    for stale in ("best-2.yaml", "best-2-material.yaml", "best-of-all.yaml"):
        (out / stale).touch()
    outcome = rig("optimise", file, "--out", out)
    assert outcome.code == 0, outcome.err
    assert "best" in outcome.out
    assert "no picture: 1 evaluations" in outcome.out
    names = {path.name for path in out.glob("*.yaml")}
    assert names == {"best-1.yaml", "best-of-all.yaml"}
    (out / "evaluations.json").unlink()
    (out / "evaluations.json").mkdir()
    assert_explained(rig("optimise", file, "--out", out), "evaluations.json", "cannot be written")
