"""The gripper: balance of forces, the friction model, and space against axisymmetry."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from pydantic import ValidationError

from rig.mechanics.cad.parts import parts_of
from rig.mechanics.fe import Point, Solution, follow
from rig.mechanics.simulate.gripper import FINGERS, GripModel, grip_model
from rig.spec.actuator import BellowGripperGeometry
from rig.spec.workspace import Workspace, library_root

LIBRARY = Workspace(library_root(), is_library=True)
RUBBER = LIBRARY.material("dragon-skin-30")
PRESSURE = 15e3
BORE = 0.017


def gripper(held: str, **changed: float) -> BellowGripperGeometry:
    geometry = LIBRARY.actuator(f"bellow-gripper-{held}").geometry
    assert isinstance(geometry, BellowGripperGeometry)
    assert geometry.held == held
    return geometry.model_copy(update=changed)


@cache
def pressed(held: str, in_space: bool | None = None) -> tuple[GripModel, Solution]:
    actuator = grip_model(gripper(held), RUBBER, in_space=in_space)
    result = follow(actuator.model, [Point(p) for p in (PRESSURE / 2, PRESSURE)])
    assert result.failure is None
    return actuator, result.solutions[-1]


@pytest.mark.parametrize("held", ["cube", "cylinder", "sphere"])
def test_base_object_and_pressure_are_in_equilibrium(held: str) -> None:
    actuator, solution = pressed(held)
    d = actuator.model.discretisation
    up = -solution.residual[d.dim * d.nodes_on("clamped") + d.dim - 1].sum() * actuator.share
    hole = 1e-3 if d.dim == 3 else 0.0
    lift = PRESSURE * np.pi * (BORE**2 - hole**2)
    normal = actuator.measures(solution)["normal_force"]
    assert normal > 1.0
    assert up == pytest.approx(lift - normal, rel=5e-3)


def test_nothing_is_held_before_the_bellow_touches() -> None:
    actuator = grip_model(gripper("cube"), RUBBER)
    (solution,) = follow(actuator.model, [Point(1e3)]).solutions
    measured = actuator.measures(solution)
    assert measured["force"] == measured["normal_force"] == measured["contact_area"] == 0.0


def test_a_flat_object_is_held_by_coulomb_s_law_alone() -> None:
    actuator, solution = pressed("cube")
    measured = actuator.measures(solution)
    expected = FINGERS * gripper("cube").friction * measured["normal_force"]
    assert measured["force"] == pytest.approx(expected, rel=1e-12)


def test_a_sphere_s_pressure_leans_on_the_way_so_that_less_of_it_holds() -> None:
    """Between 2 mu N, had it the sum of the normals alone, and 2 mu int p dA, had it all."""
    actuator, solution = pressed("sphere")
    measured = actuator.measures(solution)
    x = solution.state.x
    sampling = actuator.contact.sampling
    gap, _, _ = actuator.contact.obstacle.distance(sampling.places(x).reshape(-1, 2))
    pressure = actuator.contact.penalty * np.maximum(-gap, 0)
    all_of_it = float(sampling.weights.reshape(-1) @ pressure)
    assert measured["normal_force"] < measured["force"] / (FINGERS * 0.13) < all_of_it


def test_an_imprint_holds_the_same_summed_in_space_as_round_the_axis() -> None:
    """Without equilibrium: the bellow as it is, lifted into the sphere by 7 mm."""
    leaning = []
    for in_space in (False, True):
        actuator = grip_model(gripper("sphere"), RUBBER, in_space=in_space)
        d = actuator.model.discretisation
        x = np.zeros(d.size)
        x[d.dim - 1 : d.displacement_size : d.dim] = 10e-3
        state = replace(actuator.model.start(), x=x)
        measured = actuator.measures(SimpleNamespace(state=state, volume=0.0))  # type: ignore[arg-type]
        leaning.append(measured["force"] / measured["normal_force"] / (FINGERS * 0.13))
    assert leaning[1] == pytest.approx(leaning[0], rel=5e-3)


@pytest.mark.parametrize("held", ["cube", pytest.param("sphere", marks=pytest.mark.slow)])
def test_a_quarter_in_space_presses_like_the_axisymmetric_bellow(held: str) -> None:
    flat, space = pressed(held), pressed(held, in_space=True)
    ours, theirs = (actuator.measures(solution) for actuator, solution in (flat, space))
    assert theirs["normal_force"] == pytest.approx(ours["normal_force"], rel=0.05)
    leaning = [m["force"] / m["normal_force"] for m in (ours, theirs)]
    assert leaning[1] == pytest.approx(leaning[0], rel=2e-3)


def test_the_order_of_objects_is_the_published_one() -> None:
    force = {
        h: pressed(h)[0].measures(pressed(h)[1])["force"] for h in ("cube", "cylinder", "sphere")
    }
    assert force["cube"] > force["cylinder"] > force["sphere"]


def test_a_farther_object_is_held_less() -> None:
    actuator = grip_model(gripper("cube", clearance=6e-3), RUBBER)
    (solution,) = follow(actuator.model, [Point(PRESSURE)]).solutions
    near, at = pressed("cube")
    assert actuator.measures(solution)["force"] < 0.6 * near.measures(at)["force"]


def test_what_is_printed_is_a_finger() -> None:
    assert parts_of(gripper("cube")) == parts_of(gripper("cube").finger)


def test_a_cube_that_the_top_overlaps_is_refused() -> None:
    given = gripper("cube").model_dump(mode="json") | {"object_size": "30 mm"}
    with pytest.raises(ValidationError, match="the cube is smaller than the top"):
        BellowGripperGeometry.model_validate(given)
