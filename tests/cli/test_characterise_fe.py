"""The main command as shipped: a specimen from finite elements, both models validated on it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from .conftest import ROOT


@pytest.mark.slow
def test_finite_elements_come_nearer_to_their_own_kind_than_beam_theory(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    command = [
        *(sys.executable, "-m", "rig", "characterise", "--protocol", "quick"),
        *("--actuator", "models/actuators/bellow-bending.yaml", "--out", str(folder)),
    ]
    surroundings = os.environ | {"RIG_CACHE_DIR": str(tmp_path / "cache")}
    subprocess.run(command, cwd=ROOT, env=surroundings, check=True)
    summary = json.loads((folder / "summary.json").read_text())
    for name in ("deformation", "blocked_force"):
        models = summary["experiments"][name]["models"]
        # print tolerances make the specimen differ from its model, but less than another theory
        assert 0 < models["fe"]["rmse"]["value"] < models["beam"]["rmse"]["value"]
    # the blocked actuator creases before 10 kPa: said, not hidden
    assert any("fe" in note and "blocked" in note for note in summary["notes"])
