"""A study's surfaces in place of its model: here of beam theory, which can be asked itself."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from test_run import LIBRARY, plan_of

from rig.mechanics.beam import BeamTheory
from rig.mechanics.blocked import blocked_force
from rig.spec.actuator import BellowBendingGeometry
from rig.study.errors import StudyError
from rig.study.executor import InProcess
from rig.study.forward import Priors
from rig.study.measured import Measured
from rig.study.results import Folder
from rig.study.run import Study, run_study
from rig.study.surrogate import SurfaceForward
from rig.study.updating import update_model

ACTUATOR, MATERIAL = LIBRARY.actuator("bellow-bending"), LIBRARY.material("agilus30")
TEXT = """\
kind: study
name: levels
actuator: bellow-bending
factors:
  - {name: modulus, field: material.young_modulus.value, low: 382.5 kPa, high: 517.5 kPa}
  - {name: wall, field: actuator.geometry.wall_thickness, low: 1.41 mm, high: 1.59 mm}
design: {kind: central-composite, face: faced, centre_points: 1}
check_points: 5
responses:
""" + "".join(
    f"  - {{name: {q}-{p}, quantity: {q}, model: beam, pressure: {p} kPa}}\n".replace(
        "_", "-", 1
    ).replace("quantity: blocked-force", "quantity: blocked_force")
    for q in ("angle", "blocked_force")
    for p in (0, 2, 4, 6, 8)
    if q == "angle" or p
)
TRUE = {"modulus": 470e3, "wall": 1.46e-3, "offset": float(np.radians(1.5))}
U_ANGLE, U_FORCE = float(np.radians(0.1)), 0.1e-3 * 9.80665


def finished(folder: Path, text: str = TEXT) -> Study:
    study = run_study(plan_of(folder, text), Folder(folder / "out"), InProcess())
    assert study is not None
    return study


def measured(seed: int, pressures: np.ndarray, wall: float = TRUE["wall"]) -> Measured:
    """Of a bellow with the true modulus and wall that is mounted 1.5 deg off."""
    assert isinstance(ACTUATOR.geometry, BellowBendingGeometry)
    geometry = ACTUATOR.geometry.model_copy(update={"wall_thickness": wall})
    young = MATERIAL.young_modulus.model_copy(update={"value": TRUE["modulus"]})
    theory = BeamTheory.of(geometry, MATERIAL.model_copy(update={"young_modulus": young}))
    rng = np.random.default_rng(seed)
    n = pressures.size
    return Measured(
        pressures,
        TRUE["offset"] + theory.angle(pressures) + U_ANGLE * rng.standard_normal(n),
        np.full(n, U_ANGLE),
        pressures,
        np.asarray(blocked_force(geometry, pressures)) + U_FORCE * rng.standard_normal(n),
        np.full(n, U_FORCE),
    )


RELAXED = Priors(creep=1e-3)
"""Of a run that waited at every level."""


def test_modulus_and_wall_come_back_within_their_intervals(tmp_path: Path) -> None:
    forward = SurfaceForward.of(finished(tmp_path), ACTUATOR, MATERIAL, RELAXED)
    inside = dict.fromkeys(TRUE, 0)
    for seed in range(6):
        update = update_model(forward, measured(seed, np.linspace(0.5e3, 8e3, 9)))
        assert update.at_bounds == ()
        for name, true in TRUE.items():
            low, high = update[name].interval()
            inside[name] += low <= true <= high
        for name in ("modulus", "wall"):
            assert update[name].deviation < 0.7 * update[name].prior_deviation
    angles, forces = update.predict(measured(50, np.array([3e3, 7e3])))
    assert np.degrees(angles.rmse) < 0.4
    assert forces.rmse < 3 * U_FORCE
    assert min(inside.values()) >= 5


def test_a_run_that_did_not_wait_for_creep_is_not_taken_for_another_actuator(
    tmp_path: Path,
) -> None:
    study = finished(tmp_path)
    run = measured(0, np.linspace(0.5e3, 8e3, 9))
    early = replace(
        run,
        angle=TRUE["offset"] + 0.95 * (run.angle - TRUE["offset"]),
        force=0.95 * run.force,
    )
    relaxed, creeping = (
        SurfaceForward.of(study, ACTUATOR, MATERIAL, priors) for priors in (RELAXED, Priors())
    )

    def moved(forward: SurfaceForward) -> float:
        """Of modulus and wall, in prior deviations, by what is missing from the levels."""
        now, then = update_model(forward, early), update_model(forward, run)
        steps = [
            (now[name].value - then[name].value) / now[name].prior_deviation
            for name in ("modulus", "wall")
        ]
        return float(np.hypot(*steps))

    assert moved(relaxed) > 0.5
    assert moved(creeping) < 0.5 * moved(relaxed)
    update = update_model(creeping, early)
    for name in ("modulus", "wall"):
        low, high = update[name].interval()
        assert low <= TRUE[name] <= high
    assert update["creep"].value > 0.02


def test_the_surfaces_error_is_that_of_the_check_points_and_counts(tmp_path: Path) -> None:
    study = finished(tmp_path)
    forward = SurfaceForward.of(study, ACTUATOR, MATERIAL)
    run = measured(0, np.array([2e3, 4e3, 8e3]))
    angle_error, force_error = forward.error(run)
    points = [p for p, _ in study.checked]
    off = []
    for point, values in study.checked:
        unit = np.array(
            [
                (point.values["modulus"] / 450e3 - 1) / 0.05,
                (point.values["wall"] / 1.5e-3 - 1) / 0.02,
                0.0,
                0.0,
            ]
        )
        angle, _ = forward.answers(unit, run)
        off.append(np.degrees(angle) - [values[f"angle-{p}"] for p in (2, 4, 8)])
    assert len(points) == 5
    assert np.degrees(angle_error) == pytest.approx(np.sqrt(np.mean(np.square(off), axis=0)))
    assert np.all(force_error > 0)
    blurred = replace(forward, angles=replace(forward.angles, error=100 * forward.angles.error))
    worse = update_model(blurred, run)["offset"].deviation
    assert worse > 2 * update_model(forward, run)["offset"].deviation


def test_a_run_beyond_the_levels_is_told_of(tmp_path: Path) -> None:
    """Levels of the wall end 6 % above the drawing's; this one is 10 % above."""
    forward = SurfaceForward.of(finished(tmp_path), ACTUATOR, MATERIAL, Priors(wall=0.05))
    run = measured(0, np.linspace(0.5e3, 8e3, 9), wall=1.65e-3)
    assert "wall" in update_model(forward, run).at_bounds
    long = measured(0, np.array([3e3, 6e3, 8.1e3, 9e3]))
    kept = forward.covered(long)
    assert kept.angle_pressure == pytest.approx([3e3, 6e3, 8.1e3])
    assert kept.force == pytest.approx(long.force[:3])
    with pytest.raises(StudyError, match="at 9 kPa, the study from 0 to 8 kPa"):
        update_model(forward, measured(0, np.array([3e3, 6e3, 9e3])))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("check_points: 5", "check_points: 0", "not checked"),
        ("actuator: bellow-bending\n", "actuator: bellow-bending-n7\n", "another geometry"),
        ("material.young_modulus.value", "actuator.geometry.average_radius", "expected material"),
        ("quantity: angle", "quantity: angle_range", "0 pressures for angle"),
    ],
)
def test_studies_that_cannot_answer_are_refused(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    text = TEXT.replace(old, new).replace(", pressure: 0 kPa", ", pressure: 1 kPa")
    if "average_radius" in new:
        text = text.replace("382.5 kPa", "5.8 mm").replace("517.5 kPa", "6.2 mm")
    with pytest.raises(StudyError, match=words):
        SurfaceForward.of(finished(tmp_path, text), ACTUATOR, MATERIAL)
