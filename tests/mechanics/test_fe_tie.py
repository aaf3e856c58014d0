"""Ties between meshes that do not match: patch tests, rigid motions, tangents, convergence."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import skfem
from fe_problems import BULK, SHEAR, scattered

from rig.mechanics.fe import (
    Kinematics,
    MeshError,
    Model,
    Options,
    Point,
    Solid,
    Support,
    discretise,
    traction,
)
from rig.mechanics.fe.contact import settle
from rig.mechanics.fe.rotation import rotation_matrix
from rig.mechanics.fe.tie import Tie
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume

SIDE = 1e-2
YOUNG = 9 * BULK * SHEAR / (3 * BULK + SHEAR)
EXACT = Options(mixed_points=False, correction=0.0, tolerance=1e-10)


def uneven(count: int, length: float = SIDE) -> np.ndarray:
    """Boundaries of elements that do not repeat."""
    s = np.linspace(0, 1, count + 1)
    return length * (s + 0.13 * np.sin(np.pi * s) ** 2)


def beside(lower, upper):
    """Two meshes as one that shares no node, and the number of elements of the first."""
    points = np.hstack((lower.p, upper.p))
    return type(lower)(points, np.hstack((lower.t, upper.t + lower.p.shape[1]))), lower.nelements


def blocks(family: str, below: int = 2, above: int = 3):
    """Two cubes or squares, one on the other, with different divisions."""
    flat = family in ("quads", "triangles", "axisymmetric")
    dim = 2 if flat else 3
    make = skfem.MeshQuad if flat else skfem.MeshHex
    parts = [
        make.init_tensor(*[uneven(n)] * (dim - 1), at + np.linspace(0, SIDE, 3))
        for n, at in ((below, 0.0), (above, SIDE))
    ]
    if family == "triangles":
        parts = [part.to_meshtri() for part in parts]
    if family == "tetrahedra":
        parts = [part.to_meshtet() for part in parts]
    return beside(*parts)


KINEMATICS = {
    "hexahedra": Kinematics.SOLID,
    "tetrahedra": Kinematics.SOLID,
    "quads": Kinematics.PLANE_STRAIN,
    "triangles": Kinematics.PLANE_STRAIN,
    "axisymmetric": Kinematics.AXISYMMETRIC,
}


def tied(mesh, count: int, kinematics: Kinematics, tolerance: float = 1e-12):
    """Discretisation and tie at the last coordinate SIDE, the second part being the slave."""
    d = discretise(mesh, kinematics)
    facets = mesh.boundary_facets()
    level = np.abs(mesh.p[-1][mesh.facets[:, facets]] - SIDE).max(axis=0) < 1e-9
    second = mesh.f2t[0, facets] >= count
    tie = Tie(
        d,
        facets[level & second],
        facets[level & ~second],
        penalty=100 * YOUNG / SIDE,
        tolerance=tolerance,
    )
    return d, tie


@pytest.mark.parametrize("name", KINEMATICS)
def test_a_stretched_pair_of_blocks_passes_the_patch_test(name):
    d, tie = tied(*blocks(name), KINEMATICS[name])
    stretch, up = 0.1, d.dim - 1
    top, bottom = d.nodes[:, up] > 2 * SIDE - 1e-9, d.nodes[:, up] < 1e-9
    supports = [
        Support.of(d, np.flatnonzero(top), (up,), 2 * SIDE * stretch),
        Support.of(d, np.flatnonzero(bottom), (up,)),
        *(
            Support.of(d, np.flatnonzero(np.abs(d.nodes[:, i]) < 1e-12), (i,))
            for i in range(d.dim - 1)
        ),
    ]
    solid = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))
    model = Model(d, [solid], supports=supports, items=[tie])
    result = settle(model, [Point(0.0)], [tie], options=EXACT)
    assert result.failure is None, result.failure
    x = result.solutions[0].state.x
    u = x[: d.displacement_size].reshape(-1, d.dim)
    assert u[:, up] == pytest.approx(stretch * d.nodes[:, up], abs=1e-10 * SIDE)
    narrower = u[top, 0] @ d.nodes[top, 0] / (d.nodes[top, 0] @ d.nodes[top, 0])
    assert -0.11 < narrower < -0.04
    for i in range(d.dim - 1):
        assert u[:, i] == pytest.approx(narrower * d.nodes[:, i], abs=1e-10 * SIDE)
    # tractions are the force by the area, at each corner
    residual = result.solutions[0].residual[: d.displacement_size].reshape(-1, d.dim)
    area = {2: SIDE, 3: SIDE**2}[d.dim] if name != "axisymmetric" else np.pi * SIDE**2
    found = tie.traction(x)
    assert -found[:, up] == pytest.approx(residual[top, up].sum() / area, rel=1e-7)


@pytest.mark.parametrize("name", ["hexahedra", "quads"])
def test_a_rigid_motion_strains_nothing(name):
    d, tie = tied(*blocks(name), KINEMATICS[name])
    turn = rotation_matrix(np.array([0.3, -0.8, 0.5]) if d.dim == 3 else np.array([0, 0, 2.0]))
    moved = d.nodes @ turn[: d.dim, : d.dim].T + 0.03 * np.arange(d.dim)
    x = np.zeros(d.size)
    x[: d.displacement_size] = (moved - d.nodes).reshape(-1)
    assert np.abs(tie.gap(x)).max() < 1e-11 * SIDE
    # whatever the gap, both parts feel opposite forces
    x += 1e-4 * np.random.default_rng(0).standard_normal(d.size)
    residual, _ = tie.evaluate(x)
    force = scattered(tie.dofs, residual, d.size)[: d.displacement_size].reshape(-1, d.dim)
    assert np.abs(force).max() > 0
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()


def test_the_derivative_is_that_of_the_forces():
    d, tie = tied(*blocks("hexahedra"), Kinematics.SOLID)
    rng = np.random.default_rng(1)
    x = 1e-3 * rng.standard_normal(d.size)
    tie.settle(x)
    x += 1e-3 * rng.standard_normal(d.size)
    way, step = rng.standard_normal(d.size), 1e-5
    ahead, behind = (tie.evaluate(x + sign * step * way)[0] for sign in (1, -1))
    _, tangent = tie.evaluate(x)
    expected = np.einsum("ckl,cl->ck", tangent, way[tie.dofs])
    assert (ahead - behind) / (2 * step) == pytest.approx(
        expected, abs=1e-7 * np.abs(expected).max()
    )
    lopsided = np.abs(tangent - tangent.swapaxes(1, 2)).max()
    assert lopsided < 1e-14 * np.abs(tangent).max()


@cache
def _sheared(below: int, above: int | None) -> float:
    """Deflection of a clamped two-layer column's top under a shear load; None: one mesh."""
    if above is None:
        s = SIDE * np.linspace(0, 1, below + 1)
        mesh = skfem.MeshQuad.init_tensor(s, np.linspace(0, 2 * SIDE, 2 * below + 1))
        d, ties = discretise(mesh, Kinematics.PLANE_STRAIN), []
    else:
        mesh, count = beside(
            *(
                skfem.MeshQuad.init_tensor(
                    SIDE * np.linspace(0, 1, n + 1), at + SIDE * np.linspace(0, 1, n + 1)
                )
                for n, at in ((below, 0.0), (above, SIDE))
            )
        )
        d, tie = tied(mesh, count, Kinematics.PLANE_STRAIN, tolerance=1e-9)
        ties = [tie]
    top = mesh.facets_satisfying(lambda y: np.isclose(y[1], 2 * SIDE))
    load = traction(d, top, np.array([0.02 * SHEAR, 0.0]))
    solid = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))
    clamp = Support.of(d, d.nodes_at(y=0.0), (0, 1))
    model = Model(d, [solid], supports=[clamp], dead_load=load, items=ties)
    result = settle(model, [Point(0.0)], ties, options=EXACT)
    assert result.failure is None, result.failure
    corner = int(d.nodes_at(x=SIDE, y=2 * SIDE)[0])
    return float(result.solutions[0].state.x[2 * corner])


def test_tied_meshes_converge_to_what_a_matching_one_gives():
    reference = _sheared(16, None)
    alone = [abs(_sheared(n, None) / reference - 1) for n in (2, 4)]
    errors = [abs(_sheared(n, n + n // 2) / reference - 1) for n in (2, 4)]
    # about as good as the coarser of the two meshes all over; the clamp's corners set the order
    assert errors[0] < 1.1 * alone[0]
    assert errors[1] < 1.1 * alone[1]
    assert errors[1] < 0.55 * errors[0]


@pytest.mark.parametrize(("axis", "shift"), [(0, 0.3 * SIDE), (2, 0.05 * SIDE)])
def test_parts_that_do_not_lie_on_each_other_are_refused(axis: int, shift: float):
    mesh, count = blocks("hexahedra")
    points = mesh.p.copy()
    points[axis, mesh.t[:, count:].min() :] += shift
    apart = skfem.MeshHex(points, mesh.t)
    facets = apart.boundary_facets()
    height = points[2, apart.facets[:, facets]]
    second = apart.f2t[0, facets] >= count
    with pytest.raises(MeshError, match=r"% of the facet around .* lies on the part"):
        Tie(
            discretise(apart),
            facets[second & (height.max(axis=0) < 1.2 * SIDE)],
            facets[~second & (height.min(axis=0) > 0.9 * SIDE)],
            penalty=1.0,
            tolerance=1e-9,
        )
