"""Actuators that lengthen, whatever their family: seen from the side, at rest, free and held."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.fe import Point, follow
from rig.mechanics.outline import FLAG_PAPER, body_of, side_profile
from rig.mechanics.simulate.families import FAMILIES
from rig.mechanics.simulate.joint import joint_model
from rig.spec.workspace import Workspace

LIBRARY = Workspace.find()
NAMES = (
    "bellow-axisymmetric",
    "bellow-joint",
    "bellow-gripper-cube",
    "multi-chamber-linear",
    "shell-reinforced-linear",
)
SMALL = 50.0
"""Pa at which all of them are linear."""


def measures(model, pressure):
    result = follow(model.model, [Point(0.0), Point(pressure)])
    assert result.failure is None
    return [model.measures(solution) for solution in result.solutions]


@pytest.mark.parametrize("name", NAMES)
def test_cap_and_marker_move_by_the_elongation_and_nothing_else_does(name):
    geometry = LIBRARY.actuator(name).geometry
    rest, long = side_profile(geometry, 0.0), side_profile(geometry, 0.007)
    np.testing.assert_allclose(long.end_cap - rest.end_cap, np.tile((0.007, 0.0), (4, 1)))
    np.testing.assert_allclose(long.flags - rest.flags, [(0.0, 0.0), (0.007, 0.0)])
    np.testing.assert_array_equal(long.connector, rest.connector)
    np.testing.assert_array_equal(long.bellow[:, 1], rest.bellow[:, 1])
    # the body reaches from the connector to the cap
    assert rest.bellow[:, 0].min() == pytest.approx(rest.connector[:, 0].max())
    assert long.bellow[:, 0].max() == pytest.approx(long.end_cap[:, 0].min())
    # neither paper hides the other part of the actuator's ends from the camera
    assert long.flags[1, 0] - FLAG_PAPER / 2 > long.end_cap[:, 0].max()
    assert long.bottom_layer is None


@pytest.mark.parametrize("name", NAMES[:4])
def test_the_body_at_rest_has_the_volumes_of_the_finite_elements(name):
    actuator = LIBRARY.actuator(name)
    body = body_of(actuator.geometry)
    material = LIBRARY.material(actuator.material)
    (rest, _) = measures(
        FAMILIES[actuator.geometry.family].specimen.free(actuator.geometry, material), 1.0
    )
    assert body.cavity_volume == pytest.approx(rest["volume"], rel=2e-3)


@pytest.mark.parametrize("name", ["bellow-axisymmetric", "bellow-joint"])
def test_the_outline_turned_about_the_axis_has_the_volume_of_cavity_and_wall(name):
    geometry = LIBRARY.actuator(name).geometry
    body, outline = body_of(geometry), side_profile(geometry, 0.0).bellow
    x, z = outline[: len(outline) // 2].T
    outside = np.trapezoid(np.pi * z**2, x)
    caps = 1 if name == "bellow-axisymmetric" else 2
    solid = body.soft_mass(1.0) + caps * body.cap_mass(1.0)
    assert outside == pytest.approx(body.cavity_volume + solid, rel=5e-3)


@pytest.mark.parametrize("name", ["bellow-joint", "multi-chamber-linear"])
def test_free_and_held_are_reciprocal_where_they_are_linear(name):
    """Betti: F u = p (V_free - V_held), of the force held and the elongation free at one pressure.

    Only where all of the end moves alike: the axisymmetric bellow's soft top does not.
    """
    actuator = LIBRARY.actuator(name)
    meshing = FAMILIES[actuator.geometry.family].specimen
    material = LIBRARY.material(actuator.material)
    _, free = measures(meshing.free(actuator.geometry, material), SMALL)
    _, held = measures(meshing.blocked(actuator.geometry, material), SMALL)
    work = SMALL * (free["volume"] - held["volume"])
    assert held["force"] * free["displacement"] == pytest.approx(work, rel=2e-2)
    assert held["force"] > 0


def test_a_held_joint_pushes_as_hard_as_its_stiffness_times_what_it_would_move():
    actuator = LIBRARY.actuator("bellow-joint")
    material = LIBRARY.material(actuator.material)
    meshing = FAMILIES["bellow-joint"].specimen
    _, free = measures(meshing.free(actuator.geometry, material), SMALL)
    _, held = measures(meshing.blocked(actuator.geometry, material), SMALL)
    pulled = joint_model(actuator.geometry, material, moved=free["displacement"])
    result = follow(pulled.model, [Point(0.0, motion=1.0)])
    assert result.failure is None
    top = pulled.model.discretisation.nodes_on("top")
    pull = float(result.solutions[0].residual[2 * top + 1].sum())
    assert held["force"] == pytest.approx(pull, rel=5e-3)


def test_a_plate_over_the_axisymmetric_bellow_takes_what_the_foot_does_not():
    """Pressure on the open foot lifts the body; plate and clamp hold it down."""
    actuator = LIBRARY.actuator("bellow-axisymmetric")
    model = FAMILIES["bellow-axisymmetric"].specimen.blocked(
        actuator.geometry, LIBRARY.material(actuator.material)
    )
    pressure = 20e3
    result = follow(model.model, [Point(0.0), Point(pressure / 2), Point(pressure)])
    assert result.failure is None
    solution = result.solutions[-1]
    d, geometry = model.model.discretisation, actuator.geometry
    clamp = float(solution.residual[2 * d.nodes_on("clamped") + 1].sum())
    bore = np.pi * (geometry.top_diameter / 2 - geometry.wall_thickness) ** 2
    assert model.measures(solution)["force"] == pytest.approx(pressure * bore + clamp, rel=1e-6)
    assert model.measures(solution)["force"] > 0
