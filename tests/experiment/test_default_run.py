"""The default characterisation, whole: pipeline error at three seeds. Minutes; `make slow`."""

from __future__ import annotations

from pathlib import Path

import pytest

from rig.experiment.plan import make_plan
from rig.experiment.setup import RunRequest
from rig.mechanics.profile import cavity_volume
from rig.spec.workspace import Workspace

from .conftest import ROOT, take
from .truth import errors

ANGLE_TARGET_DEG = 0.2
FORCE_TARGET_G = 0.1
PRESSURE_TARGET_KPA = 0.05


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_default_run_meets_its_targets(seed: int, tmp_path: Path) -> None:
    setup = Workspace(ROOT).setup("bellow-bending")
    plan = make_plan(setup.protocol, setup.actuator, setup.bench)
    volume = float(cavity_volume(setup.actuator.geometry, 0.0))
    run = take(tmp_path / "run", RunRequest(setup, plan, seed, volume))
    truth, points = run.truth(), run.reader.points()
    angle = errors(points, truth, "deformation")
    force = errors(points, truth, "blocked_force")
    worst_kpa = max(abs(angle.pressure_kpa).max(), abs(force.pressure_kpa).max())
    print(
        f"\nseed {seed}: angle RMS {angle.rms:.3f} deg, worst {abs(angle.value).max():.3f}; "
        f"force RMS {force.rms:.3f} g, worst {abs(force.value).max():.3f}; "
        f"pressure worst {worst_kpa:.3f} kPa; "
        f"within 2 u: angle {(abs(angle.value) < 2 * angle.u).mean():.0%}, "
        f"force {(abs(force.value) < 2 * force.u).mean():.0%}"
    )
    assert angle.rms < ANGLE_TARGET_DEG
    assert force.rms < FORCE_TARGET_G
    assert worst_kpa < PRESSURE_TARGET_KPA
    for found in (angle, force):
        assert abs(found.regulation_kpa).max() < PRESSURE_TARGET_KPA
