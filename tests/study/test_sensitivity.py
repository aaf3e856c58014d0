"""Sensitivity: closed forms, the vectorised beam against the beam, and tolerances."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_run import LIBRARY, STUDY, plan_of

from rig.mechanics.beam import BeamTheory
from rig.spec.actuator import BellowBendingGeometry
from rig.study.analysis import surface_of
from rig.study.beams import ManyBeams
from rig.study.errors import StudyError
from rig.study.executor import InProcess
from rig.study.factors import Factor
from rig.study.model import beam_model, surface_model
from rig.study.results import Folder
from rig.study.run import known_study, run_study
from rig.study.sensitivity import morris_screening, sobol_indices, tolerance

PI = Factor("x", -np.pi, np.pi)
THREE = (PI, Factor("y", -np.pi, np.pi), Factor("z", -np.pi, np.pi))


def ishigami(points: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    return np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


def test_sobol_indices_of_ishigamis_function_are_the_exact_ones() -> None:
    """Ishigami and Homma (1990), a = 7, b = 0.1."""
    a, b = 7.0, 0.1
    total = a**2 / 8 + b * np.pi**4 / 5 + b**2 * np.pi**8 / 18 + 0.5
    one, two = 0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8
    both = b**2 * np.pi**8 * 8 / 225
    found = sobol_indices(ishigami, THREE, 2**13, seed=1)
    assert found.first == pytest.approx(np.array([one, two, 0]) / total, abs=0.015)
    assert found.total == pytest.approx(np.array([one + both, two, both]) / total, abs=0.015)
    assert found.evaluations == 2**13 * 5


def test_morris_effects_of_a_plane_are_its_slopes() -> None:
    factors = (Factor("x", 0, 2), Factor("y", -1, 1))
    found = morris_screening(lambda p: 3 * p[:, 0] - 5 * p[:, 1] + 1, factors, 20, seed=0)
    assert found.mean == pytest.approx([6, -10])
    assert found.absolute == pytest.approx([6, 10])
    assert found.spread == pytest.approx([0, 0], abs=1e-9)


def test_tolerances_of_a_plane_are_normal_with_the_known_deviation() -> None:
    factors = (Factor("x", 8, 12), Factor("y", -1, 1))  # deviations 1 and 0.5
    found = tolerance(lambda p: 3 * p[:, 0] + 8 * p[:, 1], factors, 50_000, seed=2)
    assert found.mean == pytest.approx(30, abs=0.1)
    assert found.deviation == pytest.approx(5, rel=0.02)
    assert found.percentiles[97.5] == pytest.approx(30 + 1.96 * 5, abs=0.2)
    assert found.shares["x"] == pytest.approx(9 / 25, abs=0.02)


def test_many_beams_are_the_beam_and_end_where_it_ends() -> None:
    """Two hundred random actuators at a pressure that some do not reach."""
    rng = np.random.default_rng(8)
    n = 200
    parts = {
        "effective_length": rng.uniform(0.05, 0.08, n),
        "bellow_number": rng.integers(4, 9, n).astype(float),
        "average_radius": rng.uniform(0.005, 0.007, n),
        "radius_ratio": rng.uniform(0.2, 0.5, n),
        "wall_thickness": rng.uniform(0.001, 0.0025, n),
    }
    modulus = rng.uniform(300e3, 1500e3, n)
    found = ManyBeams(**parts, young_modulus=modulus).angle(6e3)
    material = LIBRARY.material("agilus30")
    ended = 0
    for i in range(n):
        own = {
            name: f"{float(values[i])!r} m" for name, values in parts.items() if name[-1] in "hs"
        }
        try:
            geometry = BellowBendingGeometry.model_validate(
                {
                    "family": "bellow-bending",
                    "effective_length": own["effective_length"],
                    "bellow_number": int(parts["bellow_number"][i]),
                    "average_radius": own["average_radius"],
                    "radius_ratio": float(parts["radius_ratio"][i]),
                    "wall_thickness": own["wall_thickness"],
                }
            )
        except ValueError:
            assert np.isnan(found[i])
            continue
        young = material.young_modulus.model_copy(update={"value": modulus[i]})
        theory = BeamTheory.of(geometry, material.model_copy(update={"young_modulus": young}))
        if theory.limit_pressure < 6e3:
            ended += 1
            assert np.isnan(found[i])
        else:
            assert found[i] == pytest.approx(float(theory.angle(6e3)), rel=1e-12)
    assert 5 < ended < 150


def test_the_beams_response_is_sensitive_to_its_wall_first(tmp_path: Path) -> None:
    plan = plan_of(tmp_path)
    found = sobol_indices(
        beam_model(plan.space, plan.spec.responses[0]), plan.factors, 2**10, seed=0
    )
    assert found.factors[int(np.argmax(found.total))] == "wall"
    assert np.all(found.total >= found.first - 0.02)
    with pytest.raises(StudyError, match="no angle"):
        beam_model(plan.space, plan.spec.responses[1])


def test_a_finished_studys_surface_answers_as_the_model_does(tmp_path: Path) -> None:
    smooth = STUDY.replace(
        "bellow_number, low: 5, high: 7", "average_radius, low: 5.8 mm, high: 6.2 mm"
    )
    plan = plan_of(tmp_path, smooth)
    folder = Folder(tmp_path / "out")
    with pytest.raises(StudyError, match="not finished"):
        known_study(plan, folder)
    run_study(plan, folder, InProcess())
    study = known_study(plan, folder)
    surface = surface_model(surface_of(study, "angle"), plan.space)
    direct = sobol_indices(
        beam_model(plan.space, plan.spec.responses[0]), plan.factors, 2**10, seed=0
    )
    by_surface = sobol_indices(surface, plan.factors, 2**10, seed=0)
    assert by_surface.total == pytest.approx(direct.total, abs=0.04)


def test_what_cannot_be_sampled_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="power of two"):
        sobol_indices(ishigami, THREE, 1000, seed=0)
    plan = plan_of(tmp_path, STUDY.replace("high: 1.8 mm", "high: 3.2 mm"))
    with pytest.raises(StudyError, match="no response"):
        sobol_indices(beam_model(plan.space, plan.spec.responses[0]), plan.factors, 64, seed=0)
    with pytest.raises(StudyError, match="narrow the tolerances"):
        tolerance(beam_model(plan.space, plan.spec.responses[0]), plan.factors, 1000, seed=0)
    plan = plan_of(
        tmp_path, STUDY.replace("material.young_modulus.value", "material.density.value")
        .replace("400 kPa", "1000 kg/m**3").replace("500 kPa", "1200 kg/m**3"),
    )  # fmt: skip
    with pytest.raises(StudyError, match="does not depend"):
        beam_model(plan.space, plan.spec.responses[0])(np.array([[1.5e-3, 6, 1100]]))
