"""The bending bellow held by a stop under its tip, by finite elements."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.fe import Pose, rotation_vector
from rig.mechanics.fe.rotation import rotation_matrix
from rig.mechanics.mesh.bellow_bending import BendingResolution
from rig.mechanics.simulate.blocked import TipStop, blocked
from rig.spec.actuator import BellowBendingGeometry

COARSE = BendingResolution(wall=1, crown=4)


@pytest.fixture(scope="module")
def short() -> BellowBendingGeometry:
    return BellowBendingGeometry.model_validate(
        {"family": "bellow-bending", "bellow_number": 2, "effective_length": 22}
    )


@pytest.fixture(scope="module")
def found(short, agilus30):
    return blocked(short, agilus30, [1e3, 2e3], resolution=COARSE)


def test_the_stop_holds_what_the_clamp_feels(found):
    d = found.bending.model.discretisation
    clamp = d.nodes_on("clamped")
    assert found.failure is None
    for solution, force in zip(found.result.solutions[1:], found.force, strict=True):
        reaction = 2 * float(solution.residual[3 * clamp + 2].sum())
        assert reaction == pytest.approx(-(force + found.preload), rel=1e-4)


def test_the_tip_stays_on_the_stop_and_slides_and_turns_there(found):
    shape = found.bending.shape
    for solution in found.result.solutions[1:]:
        x, z = found.bending.tip(solution.state)
        assert z == pytest.approx(shape.underside, abs=3e-5)
        assert abs(x - shape.tip) > 1e-5
    assert np.all(np.diff(found.angle) > np.deg2rad(1))
    # only the edge touches: the underside behind it is free
    assert np.all(found.clearance > 0)


def test_the_hanging_weight_presses_on_the_stop_and_is_not_counted_as_force(found, short, agilus30):
    lying = blocked(short, agilus30, [1e3], resolution=COARSE, acceleration=(0.0, 0.0, 0.0))
    assert lying.preload == pytest.approx(0.0, abs=1e-9)
    assert found.preload > 0.02 * found.force[0]
    assert found.force[0] == pytest.approx(lying.force[0], rel=0.05)


def test_a_stop_that_is_not_touched_exerts_no_force(short, agilus30):
    lifting = blocked(short, agilus30, [-300.0], resolution=COARSE, acceleration=(0.0, 0.0, 0.0))
    assert lifting.failure is None
    assert lifting.force[0] == 0.0
    _x, z = lifting.bending.tip(lifting.result.solutions[-1].state)
    assert z > lifting.bending.shape.underside + 1e-5


def test_a_pressure_that_cannot_be_reached_is_told_and_keeps_the_preload(short, agilus30):
    asked = 0

    def once(_progress) -> bool:
        nonlocal asked
        asked += 1
        return asked < 2

    cut = blocked(short, agilus30, [500.0, 1e3], resolution=COARSE, progress=once)
    assert cut.failure is not None
    assert "cancelled" in cut.failure
    assert cut.preload > 0
    assert len(cut.pressure) == len(cut.force) == len(cut.volume) == len(cut.angle) == 0


def test_the_gap_follows_the_edge_of_the_rigid_cap_at_any_pose(found):
    bending = found.bending
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
