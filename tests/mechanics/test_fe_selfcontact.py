"""Smallest gap between facing parts of a surface, on shapes whose gap is known."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from fe_problems import BULK, SHEAR

from rig.mechanics.fe import (
    Kinematics,
    Model,
    Options,
    Point,
    Solid,
    Support,
    discretise,
    follow,
)
from rig.mechanics.fe.selfcontact import FacingSurface
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume
from rig.mechanics.mesh.bellow_bending import BendingResolution, mesh_bending_bellow
from rig.spec.actuator import BellowBendingGeometry

MM = 1e-3


def channel(arms: int = 3):
    """A U of 2 mm thick walls, 2 mm apart inside and 8 mm deep, in plane strain."""
    mesh = skfem.MeshQuad.init_tensor(
        MM * np.array([0, 1, 2, 3, 4, 5, 6]), MM * np.linspace(0, 10, 2 * arms + 1 - (arms == 3))
    )
    centre = mesh.p[:, mesh.t].mean(axis=1)
    hollow = (abs(centre[0] - 3 * MM) < MM) & (centre[1] > 2 * MM)
    return mesh.remove_elements(np.flatnonzero(hollow))


def test_the_gap_of_two_flanks_is_that_of_their_nearest_points():
    """One flank is bowed to a parabola; its vertex is between the samples."""
    mesh = skfem.MeshHex.init_tensor(*[MM * np.linspace(0, 6, 4)] * 3)
    centre = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.remove_elements(np.flatnonzero(abs(centre[2] - 3 * MM) < MM))
    d = discretise(mesh)
    surface = FacingSurface(d, mesh.boundary_facets(), reach=3 * MM, depth=MM)
    x = np.zeros(d.size)
    gap = surface.smallest_gap(x)
    assert gap is not None
    assert gap.distance == pytest.approx(2 * MM, rel=1e-12)
    upper = d.nodes[:, 2] > 3.9 * MM
    where = d.nodes[:, :2] - MM * np.array([2.7, 4.4])
    x[2::3] = upper * (-1.5 * MM + 10 * (where**2).sum(axis=1))
    gap = surface.smallest_gap(x)
    assert gap is not None
    assert gap.distance == pytest.approx(0.5 * MM, rel=1e-3)
    for place in gap.places:
        assert place[:2] == pytest.approx(MM * np.array([2.7, 4.4]), abs=0.1 * MM)


def test_parts_out_of_reach_have_no_gap_and_a_wall_is_not_one():
    mesh = channel()
    d = discretise(mesh, Kinematics.PLANE_STRAIN)
    surface = FacingSurface(d, mesh.boundary_facets(), reach=1.5 * MM, depth=1.0 * MM)
    assert surface.smallest_gap(np.zeros(d.size)) is None


@pytest.mark.parametrize("closing", [0.4, 0.9, 1.1])
def test_flanks_that_are_bent_together_close_and_pass(closing):
    mesh = channel()
    d = discretise(mesh, Kinematics.PLANE_STRAIN)
    solid = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))
    top = np.flatnonzero(np.abs(d.nodes[:, 1] - 10 * MM) < 1e-9)
    left, right = (top[s * (d.nodes[top, 0] - 3 * MM) > 0] for s in (-1, 1))
    model = Model(
        d,
        [solid],
        supports=[
            Support.of(d, d.nodes_at(y=0.0), (0, 1)),
            Support.of(d, left, (0,), closing * MM),
            Support.of(d, right, (0,), -closing * MM),
        ],
    )
    result = follow(model, [Point(0.0)], options=Options(mixed_points=False))
    assert result.failure is None
    surface = FacingSurface(d, mesh.boundary_facets(), reach=3 * MM, depth=1.0 * MM)
    gap = surface.smallest_gap(result.solutions[0].state.x)
    assert gap is not None
    assert gap.distance == pytest.approx((2 - 2 * closing) * MM, rel=0.05)
    assert gap.places[0][1] > 9 * MM


def test_the_flanks_of_a_bellow_at_rest_are_as_far_apart_as_drawn():
    geometry = BellowBendingGeometry.model_validate(
        {"family": "bellow-bending", "bellow_number": 2, "effective_length": 22}
    )
    body = mesh_bending_bellow(geometry, BendingResolution(wall=1, crown=4))
    shape = body.shape
    d = discretise(body.mesh)
    x = np.zeros(d.size)
    outside = FacingSurface(d, d.facets_on("outside"), reach=4 * MM, depth=0.4 * shape.wall)
    gap = outside.smallest_gap(x)
    assert gap is not None
    between = 2 * (shape.trough_arc - shape.wall)
    # round the root the chord of opposed points is the shorter
    assert 0.96 * between < gap.distance < (1 + 1e-6) * between
    middle = (gap.places[0] + gap.places[1]) / 2
    assert middle[0] == pytest.approx(11 * MM, abs=0.15 * MM)
