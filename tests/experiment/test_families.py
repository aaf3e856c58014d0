"""One actuator of every family, through the whole chain on the virtual bench."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.experiment.replay import ReplayedRun
from rig.mechanics.simulate.families import FAMILIES
from rig.spec.workspace import Workspace
from tests.experiment.conftest import make_request, take
from tests.experiment.truth import errors

BENCHES = {
    "bellow-bending": "virtual",
    "bellow-axisymmetric": "virtual",
    "bellow-gripper-sphere": "virtual",
    "bellow-joint": "virtual",
    "bellow-rectangular": "virtual-underwater",
    "multi-chamber-bending": "virtual",
    "multi-chamber-linear": "virtual",
    "shell-reinforced-bending": "virtual",
    "shell-reinforced-linear": "virtual",
}
"""Where an actuator is measured."""
SIGMAS = 3.0
"""Two of a hundred and fifty points may lie further than two."""


def test_every_family_has_an_actuator_here() -> None:
    library = Workspace.find()
    assert {library.actuator(name).geometry.family for name in BENCHES} == set(FAMILIES)


@pytest.mark.slow
@pytest.mark.parametrize("name", BENCHES)
def test_what_is_measured_is_what_is_so(name: str, tmp_path: Path) -> None:
    request = make_request(bench=BENCHES[name], actuator=name)
    run = take(tmp_path / "run", request)
    assert run.outcome.stop.exit_status == "success"
    points, truth = run.reader.points(), run.truth()
    unit = request.setup.actuator.measurand.unit
    assert {p.unit for p in points if p.key.experiment == "deformation"} == {unit}
    for experiment in ("deformation", "blocked_force"):
        found = errors(points, truth, experiment)
        assert (np.abs(found.value) < SIGMAS * found.u).all(), experiment
    assert ReplayedRun(run.folder).points() == points
