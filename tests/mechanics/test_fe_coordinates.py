"""Coordinates that bend with the body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.mechanics.fe import Options, Point, Pose, State, follow
from rig.mechanics.fe.coordinates import Bending, Cartesian
from rig.mechanics.fe.rotation import rotation_matrix
from rig.mechanics.mesh.bellow_bending import BendingResolution
from rig.mechanics.simulate.bending import bending_model
from rig.spec.actuator import BellowBendingGeometry

START, END, HEIGHT = -1.0e-3, 59.0e-3, -14e-3


class Bar:
    """What the coordinates know of a discretisation and its rigid end."""

    nodes = np.stack(
        np.meshgrid(np.linspace(START, END, 7), [0.0, 5e-3], np.linspace(HEIGHT, 12e-3, 4)), axis=-1
    ).reshape(-1, 3)
    displacement_size = nodes.size
    centre = np.array([END, 0.0, 0.0])


def coordinates() -> Bending:
    return Bending(Bar, Bar, START, END, HEIGHT)  # type: ignore[arg-type]


def arc(angle: float) -> State:
    """The bar with its lower side bent to an arc, sections plane and normal to it."""

    def placed(point: np.ndarray) -> np.ndarray:
        share = (point[0] - START) / (END - START)
        radius = (END - START) / angle
        section = rotation_matrix(np.array([0.0, share * angle, 0.0]))
        centre = np.array([START, 0.0, HEIGHT - radius])
        return centre + section @ (np.array([START, *point[1:]]) - centre)

    x = np.concatenate([placed(p) - p for p in Bar.nodes])
    return State(x, (), (replace(pose(angle), shift=placed(Bar.centre) - Bar.centre),))


def pose(angle: float) -> Pose:
    turn = np.array([0.0, angle, 0.0])
    return Pose(np.zeros(3), rotation_matrix(turn), turn)


@given(st.floats(0.01, 5.0), st.floats(0.01, 5.0), st.floats(0.01, 3.0))
@settings(max_examples=30)
def test_between_arcs_of_two_angles_is_the_arc_of_the_angle_between(one, other, share):
    weights = np.array([1 - share / 3, share / 3])
    between = float(weights @ [one, other])
    x, (end,) = coordinates().blended([arc(one), arc(other)], weights, (pose(between),))
    expected = arc(between)
    np.testing.assert_allclose(x, expected.x, atol=1e-12)
    np.testing.assert_allclose(end.shift, expected.poses[0].shift, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-7, 3e-5, 0.2, -0.3, 2.5, 4.0])
def test_a_small_step_is_the_straight_one_to_second_order(angle):
    rng = np.random.default_rng(7)
    state = arc(angle) if angle else State(np.zeros(Bar.nodes.size), (), (pose(0.0),))
    state = state.with_x(state.x + 1e-4 * rng.normal(size=state.x.size))
    direction, spin, push = rng.normal(size=state.x.size), 30.0, rng.normal(size=3)
    push[1] = 0.0
    misses = []
    for size in (1e-4, 1e-5):
        before = state.poses[0]
        step = np.array([0.0, size * spin, 0.0])
        turned = rotation_matrix(step) @ before.rotation
        after = Pose(before.shift + size * push, turned, before.angles + step)
        x, (end,) = coordinates().moved(state, size * direction, (after,))
        straight, _ = Cartesian().moved(state, size * direction, (after,))
        misses.append(np.abs(x - straight).max() + np.abs(end.shift - after.shift).max())
    assert misses[0] < 2e-5
    assert misses[1] < 0.012 * misses[0]


def test_the_first_step_strains_less_on_the_way_to_the_same_equilibrium(agilus30):
    geometry = BellowBendingGeometry.model_validate(
        {"family": "bellow-bending", "bellow_number": 3, "effective_length": 33}
    )
    coarse = BendingResolution(wall=1, crown=3, plate=2)
    strained, angles = {}, {}
    for arc_like in (True, False):
        actuator = bending_model(geometry, agilus30, resolution=coarse, arc=arc_like)
        result = follow(
            actuator.model, [Point(1e3, dead=0.0)], options=Options(correction=0.0, first_step=1.0)
        )
        assert result.failure is None
        strained[arc_like] = result.history[0].iterations[1].gap
        angles[arc_like] = actuator.angle(result.solutions[0].state)
    assert angles[True] == pytest.approx(angles[False], rel=1e-6)
    assert strained[True] < strained[False] / 3
