"""The truth from finite elements: scaled stiffness, tables that go on, nothing half computed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.mechanics.fe import (
    Model,
    PressureSurface,
    Progress,
    RigidBody,
    Solid,
    Solution,
    Support,
    gravity,
    rotation_vector,
)
from rig.mechanics.hyperelastic import neo_hookean_from
from rig.mechanics.job import Job
from rig.mechanics.simulate import families
from rig.mechanics.simulate.families import Family, Meshing
from rig.plant.errors import SpecimenError
from rig.plant.fe_truth import finite_element_truth
from rig.spec.material import MaterialSpec
from rig.spec.workspace import Workspace
from tests.mechanics.fe_problems import bending_tube

LIBRARY = Workspace(Path(__file__).parents[2])
PRESSURE = np.arange(-1e3, 14.1e3, 250.0)


class Tube:
    """A box beam that bends, cheap enough for a test, of the material and under its weight."""

    mirror = 1

    def __init__(self, _geometry: object, material: MaterialSpec) -> None:
        tube = bending_tube(along=2)
        d = tube.discretisation
        energies = neo_hookean_from(material.young_modulus.value, material.poisson_ratio.value)
        assert energies.volume is not None
        solid = Solid(d, energies.distortion, energies.volume)
        self.model = Model(
            d,
            [solid],
            supports=[
                Support.of(d, d.nodes_on("clamp"), (0, 1, 2)),
                Support.of(d, d.nodes_on("symmetry"), (1,)),
            ],
            surface=PressureSurface(d, d.facets_on("cavity"), symmetric=True),
            dead_load=gravity(solid, material.density.value, np.array([0.0, 0.0, -9.81])),
            bodies=[RigidBody(d, tube.cap.nodes, free=tube.cap.free, centre=tube.cap.centre)],
        )

    def measures(self, solution: Solution) -> dict[str, float]:
        angle = float(rotation_vector(solution.state.poses[0].rotation)[1])
        # what holds the clamped end carries the weight and nothing else: a force to scale
        return {"angle": angle, "volume": 2 * solution.volume, "force": solution.pressure * 1e-4}


@pytest.fixture(autouse=True)
def cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    tubes = Meshing(Tube, Tube)
    monkeypatch.setitem(families.FAMILIES, "bellow-bending", Family(tubes, tubes))


@pytest.fixture(scope="module")
def setup():
    return LIBRARY.setup("bellow-bending")


def test_a_stiffer_print_is_the_same_as_less_load_times_the_stiffness(setup) -> None:
    young = setup.material.young_modulus
    stiffer = setup.material.model_copy(
        update={"young_modulus": young.model_copy(update={"value": 1.2 * young.value})}
    )
    scaled = finite_element_truth(setup.actuator, setup.material, 1.2, PRESSURE, Job())
    direct = finite_element_truth(setup.actuator, stiffer, 1.0, PRESSURE, Job())
    for name in ("deformation", "volume_free", "volume_blocked", "blocked_force"):
        # the rungs lie elsewhere, so that interpolation differs a little
        expected = getattr(direct, name)
        slack = 2e-3 * np.ptp(expected)
        np.testing.assert_allclose(getattr(scaled, name), expected, atol=slack, err_msg=name)
    soft = finite_element_truth(setup.actuator, setup.material, 1.0, PRESSURE, Job())
    assert soft.deformation[-1] - scaled.deformation[-1] > 0.05 * soft.deformation[-1]


def test_beyond_the_limit_and_below_zero_the_tables_go_straight_on(setup) -> None:
    tables = finite_element_truth(setup.actuator, setup.material, 1.0, PRESSURE, Job())
    for values in (tables.deformation, tables.volume_free):
        below, above = values[PRESSURE < 0], values[setup.actuator.limits.pressure < PRESSURE]
        for part in (below, above):
            np.testing.assert_allclose(np.diff(part), np.diff(part)[0], rtol=1e-9)
        assert np.all(np.diff(values) > 0)


def test_a_stopped_calculation_is_no_specimen(setup) -> None:
    def stop_late(_: str, progress: Progress) -> bool:
        return progress.point < 8

    with pytest.raises(SpecimenError, match=r"tip free.*cancelled.*response: beam"):
        finite_element_truth(setup.actuator, setup.material, 1.0, PRESSURE, Job(watch=stop_late))
