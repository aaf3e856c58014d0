"""The bending bellow held by a stop under its tip, by finite elements."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest

from rig.mechanics.fe import Point, Pose, Result, follow, rotation_vector
from rig.mechanics.fe.rotation import rotation_matrix
from rig.mechanics.mesh.bellow_bending import BendingResolution
from rig.mechanics.simulate.bending import bending_model
from rig.mechanics.simulate.blocked import (
    BLOCKED_OPTIONS,
    Blocked,
    BlockedBendingModel,
    TipStop,
)
from rig.spec.actuator import BellowBendingGeometry

COARSE = BendingResolution(wall=1, crown=4)


@pytest.fixture(scope="module")
def short() -> BellowBendingGeometry:
    return BellowBendingGeometry.model_validate(
        {"family": "bellow-bending", "bellow_number": 2, "effective_length": 22}
    )


@dataclass(frozen=True)
class Held:
    """A blocked actuator and its equilibria, the first at zero pressure."""

    actuator: BlockedBendingModel
    result: Result

    def measured(self, name: str) -> np.ndarray:
        return np.array([self.actuator.measures(s)[name] for s in self.result.solutions])


def held(geometry, material, *pressures, **of_the_model) -> Held:
    build = partial(bending_model, resolution=COARSE, **of_the_model)
    actuator = Blocked(build)(geometry, material)
    points = [Point(0.0), *map(Point, pressures)]
    return Held(actuator, follow(actuator.model, points, options=BLOCKED_OPTIONS))


@pytest.fixture(scope="module")
def found(short, agilus30):
    return held(short, agilus30, 1e3, 2e3)


def test_the_stop_holds_what_the_clamp_feels(found):
    d = found.actuator.model.discretisation
    clamp = d.nodes_on("clamped")
    assert found.result.failure is None
    for solution, force in zip(found.result.solutions, found.measured("force"), strict=True):
        reaction = 2 * float(solution.residual[3 * clamp + 2].sum())
        assert reaction == pytest.approx(-force, rel=1e-4)


def test_the_tip_stays_on_the_stop_and_slides_and_turns_there(found):
    bending = found.actuator.bending
    for solution in found.result.solutions[1:]:
        x, z = bending.tip(solution.state)
        assert z == pytest.approx(bending.shape.underside, abs=1e-6)
        assert abs(x - bending.shape.tip) > 1e-5
    assert np.all(np.diff(found.measured("angle")) > np.deg2rad(1))
    # only the edge touches: the underside behind it is free
    assert np.all(found.measured("clearance")[1:] > 0)


def test_flanks_that_are_pushed_together_are_closer(found):
    bending, solution = found.actuator.bending, found.result.solutions[0]
    d, shape = bending.model.discretisation, bending.shape
    between = 2 * (shape.trough_arc - shape.wall)
    at_rest = np.zeros(d.size)
    for share in (0.0, 0.3, 0.6):
        x = at_rest.copy()
        x[: d.displacement_size : 3] = -share * d.nodes[:, 0]
        state = replace(solution.state, x=x)
        gap = found.actuator.measures(replace(solution, state=state))["flank_gap"]
        left = 1 - share
        # round the root, now half an ellipse, chords between normals 30 degrees apart are shorter
        chord = np.cos(np.arctan(np.tan(np.pi / 12) / left))
        assert 0.98 * chord * left * between < gap <= left * between * (1 + 1e-6)
    x = at_rest.copy()
    x[: d.displacement_size : 3] = d.nodes[:, 0]
    assert bending.flanks.gap(replace(solution.state, x=x)) == np.inf


def test_the_hanging_weight_presses_on_the_stop_and_hardly_changes_what_pressure_adds(
    found, short, agilus30
):
    lying = held(short, agilus30, 1e3, acceleration=(0.0, 0.0, 0.0)).measured("force")
    hanging = found.measured("force")
    assert lying[0] == pytest.approx(0.0, abs=1e-9)
    assert hanging[0] > 0.02 * hanging[1]
    assert hanging[1] - hanging[0] == pytest.approx(lying[1], rel=0.05)


def test_the_sign_of_the_force_tells_that_the_tip_would_leave_the_stop(short, agilus30):
    lifting = held(short, agilus30, -300.0, acceleration=(0.0, 0.0, 0.0))
    assert lifting.result.failure is None
    assert lifting.measured("force")[-1] < -1e-3


def test_the_gap_follows_the_edge_of_the_rigid_cap_at_any_pose(found):
    bending = found.actuator.bending
    d, body = bending.model.discretisation, bending.model.bodies[0]
    stop = TipStop(d, bending.shape, stiffness=1e3)
    x = np.zeros(d.size)
    for angle in (-0.7, 0.0, 1.2, 3.0):
        pose = Pose(np.array([2e-3, 0.0, -8e-3]), rotation_matrix(np.array([0.0, angle, 0.0])))
        assert rotation_vector(pose.rotation)[1] == pytest.approx(angle)
        x[body.dofs] = body.displacements(pose)
        edge = np.array([bending.shape.tip, 0.0, bending.shape.underside])
        moved = body.centre + pose.shift + pose.rotation @ (edge - body.centre)
        assert stop.gap(x) == pytest.approx(moved[2] - bending.shape.underside, abs=1e-12)
        # the forces on the nodes do the work of one force at the edge
        residual, _ = stop.evaluate(x)
        work = np.zeros(d.size)
        work[stop.dofs[0]] = -residual[0]
        along = body.directions(pose).T @ work[body.dofs]
        arm = moved - body.centre - pose.shift
        force = np.array([0.0, 0.0, stop.force(x)])
        assert along == pytest.approx([0.0, force[2], np.cross(arm, force)[1]], abs=1e-12)
