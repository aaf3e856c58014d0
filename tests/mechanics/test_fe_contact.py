"""Contact with rigid obstacles against closed forms, equilibrium and finite differences."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest
import skfem
from fe_problems import BULK, SHEAR

from rig.mechanics.fe import (
    Discretisation,
    Kinematics,
    Model,
    Options,
    Point,
    Solid,
    Support,
    discretise,
)
from rig.mechanics.fe.contact import Contact, Sampling, settle
from rig.mechanics.fe.obstacles import Cylinder, Obstacle, Plane, Sphere
from rig.mechanics.fe.onset import rounded
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume

SIDE = 1e-2
# energies have kinks where contact begins: searching along a line finds those, not equilibrium
EXACT = Options(mixed_points=False, line_search=False, correction=0.0, tolerance=1e-10)
YOUNG = 9 * BULK * SHEAR / (3 * BULK + SHEAR)
POISSON = YOUNG / (2 * SHEAR) - 1


@dataclass(frozen=True)
class Pressed:
    """A body pushed downwards by its top on to an obstacle."""

    discretisation: Discretisation
    contact: Contact
    model: Model
    top: np.ndarray

    def push(self, solution) -> np.ndarray:
        """Reactions of the top on the model, (dim,)."""
        d = self.discretisation
        return solution.residual[: d.displacement_size].reshape(-1, d.dim)[self.top].sum(axis=0)


def pressed(
    mesh,
    kinematics: Kinematics,
    obstacle: Obstacle,
    *,
    motion: tuple[tuple[int, float], ...],
    sides: tuple[tuple[float, int], ...] = (),
    penalty: float = 100 * YOUNG / SIDE,
    friction: float = 0.0,
    tolerance: float = 1e-10,
) -> Pressed:
    """The mesh's underside (last coordinate 0) against an obstacle, its top moved by `motion`."""
    up = mesh.p[-1]
    facets = mesh.boundary_facets()
    height = up[mesh.facets[:, facets]]
    under = facets[np.all(np.abs(height) < 1e-9, axis=0)]
    d = discretise(mesh, kinematics)
    solid = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))
    contact = Contact(
        Sampling.of_facets(d, under),
        obstacle,
        penalty=penalty,
        friction=friction,
        tolerance=tolerance,
    )
    top = np.flatnonzero(np.abs(d.nodes[:, -1] - up.max()) < 1e-9)
    supports = [Support.of(d, top, (axis,), value) for axis, value in motion]
    supports += [
        Support.of(d, np.flatnonzero(np.abs(d.nodes[:, axis] - at) < 1e-12), (axis,))
        for at, axis in sides
    ]
    return Pressed(d, contact, Model(d, [solid], supports=supports, items=[contact]), top)


def strip(columns: int = 3, rows: int = 3):
    return skfem.MeshQuad.init_tensor(
        np.linspace(0, SIDE, columns + 1), np.linspace(0, SIDE, rows + 1)
    )


# --- obstacles ---------------------------------------------------------------------------------

OBSTACLES = {
    "plane": Plane((0.1, 0.2, 0.3), (1.0, 2.0, 2.0)),
    "sphere": Sphere((0.4, 0.5, -0.8), 1.0),
    "cylinder": Cylinder((0.1, 0.2, 0.3), (1.0, 1.0, 0.5), 0.3),
}


@pytest.mark.parametrize("name", OBSTACLES)
def test_normal_and_curvature_are_the_derivatives_of_the_gap(name):
    obstacle = OBSTACLES[name]
    points = np.random.default_rng(3).uniform(-1, 1, (20, 3))
    gap, normal, curvature = obstacle.distance(points)
    step = 1e-6
    for axis in range(3):
        ahead = obstacle.distance(points + step * np.eye(3)[axis])
        behind = obstacle.distance(points - step * np.eye(3)[axis])
        assert (ahead.gap - behind.gap) / (2 * step) == pytest.approx(normal[:, axis], abs=1e-8)
        assert (ahead.normal - behind.normal) / (2 * step) == pytest.approx(
            curvature[:, :, axis], abs=1e-6
        )
    # a point moved by its gap along the normal lies on the surface
    on = obstacle.distance(points - gap[:, None] * normal)
    assert on.gap == pytest.approx(0.0, abs=1e-12)


# --- tangents ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("friction", "softness"), [(0, 0), (0.02, 0), (5, 0), (0, 0.1), (0.02, 0.1)]
)
@pytest.mark.parametrize("name", OBSTACLES)
def test_the_derivative_of_contact_is_that_of_its_forces(name, friction, softness):
    mesh = skfem.MeshHex().refined(1)
    d = discretise(mesh)
    under = mesh.facets_satisfying(lambda y: y[2] < 1e-9)
    contact = Contact(
        Sampling.of_facets(d, under),
        OBSTACLES[name],
        penalty=3.0,
        friction=friction,
        tolerance=1e-9,
        softness=softness,
    )
    rng = np.random.default_rng(5)
    x = 0.1 * rng.standard_normal(d.size)
    contact.settle(x)  # multipliers that are not zero
    x += 0.05 * rng.standard_normal(d.size)
    touched = contact.touch(x)
    assert touched.area > 0
    if friction:
        assert (touched.slipping > 0.5) == (friction < 1)
    _, tangent = contact.evaluate(x)
    step = 1e-7
    for k in range(contact.dofs.shape[1]):
        for part in range(len(contact.dofs)):
            there, back = x.copy(), x.copy()
            there[contact.dofs[part, k]] += step
            back[contact.dofs[part, k]] -= step
            slope = (contact.evaluate(there)[0] - contact.evaluate(back)[0])[part] / (2 * step)
            assert slope == pytest.approx(tangent[part, :, k], abs=2e-6)
    symmetric = np.allclose(tangent, tangent.swapaxes(1, 2), atol=1e-12)
    assert contact.symmetric == (friction == 0.0)
    if not friction:
        assert symmetric


def test_an_onset_rounded_off_meets_both_sides_without_a_kink():
    depth = np.linspace(-3.0, 3.0, 601)
    counted, slope = rounded(depth, 1.0)
    assert np.all(counted[depth <= -1] == 0)
    np.testing.assert_allclose(counted[depth >= 1], depth[depth >= 1], rtol=1e-12)
    np.testing.assert_allclose(np.gradient(counted, depth)[1:-1], slope[1:-1], atol=3e-3)
    assert np.abs(np.diff(slope)).max() < 6e-3
    sudden, step = rounded(depth, 0.0)
    np.testing.assert_array_equal(sudden, np.maximum(depth, 0.0))
    np.testing.assert_array_equal(step, depth >= 0)


# --- patch, equilibrium, convergence ----------------------------------------------------------


def test_a_flat_block_on_a_plane_is_pressed_uniformly_whatever_its_mesh():
    mesh = strip(3, 2)
    moved = mesh.p.copy()
    inner = mesh.interior_nodes()
    moved[:, inner] += 5e-4 * np.random.default_rng(1).uniform(-1, 1, (2, len(inner)))
    # unequal facets underneath
    low = np.abs(moved[1]) < 1e-12
    moved[0, low] = SIDE * (moved[0, low] / SIDE) ** 1.3
    at = pressed(
        skfem.MeshQuad(moved, mesh.t),
        Kinematics.PLANE_STRAIN,
        Plane((0.0, 0.0), (0.0, 1.0)),
        motion=((1, -1e-3),),
        sides=((0.0, 0),),
    )
    result = settle(at.model, [Point(0.0)], [at.contact], options=EXACT)
    assert result.failure is None
    state = result.solutions[0].state
    solid = at.model.solids[0]
    # homogeneous: every quadrature point has the stretch of the block
    f = solid.deformation_gradient(state.x)
    assert f[1, 1] == pytest.approx(0.9, abs=1e-7)
    assert np.ptp(f[0, 0]) < 1e-7
    traction, _, _ = at.contact._tractions(state.x)
    assert np.ptp(traction[:, 1]) < 1e-6 * traction[:, 1].max()
    touch = at.contact.touches[-1]
    assert touch.area == pytest.approx(SIDE)
    assert touch.penetration < 1e-10


def test_contact_and_supports_are_in_equilibrium_and_newton_is_quadratic():
    at = pressed(
        strip(6, 4),
        Kinematics.PLANE_STRAIN,
        Sphere((0.4 * SIDE, -2 * SIDE), 2 * SIDE),
        motion=((0, 0.0), (1, -1.5e-3)),
    )
    result = settle(at.model, [Point(0.0)], [at.contact], options=EXACT)
    assert result.failure is None
    solution = result.solutions[0]
    touch = at.contact.touches[-1]
    assert touch.force[1] > 0
    assert at.push(solution) == pytest.approx(-touch.force, rel=1e-8)
    # once the set of touching points is found
    late = [
        (before.residual, after.residual)
        for record in result.history
        if record.converged
        for before, after in itertools.pairwise(record.iterations)
        if 1e-3 < before.residual < 1e-2
    ]
    assert late
    assert all(after < before**2 for before, after in late)


@dataclass(frozen=True)
class Indented:
    force: float
    half_width: float
    pressure: float


def indent(columns: int, kinematics: Kinematics, depth: float) -> Indented:
    """A round indenter of radius 10 into a body of half width and height 1, upside down: 1e-2 m."""
    # graded towards the contact
    across = SIDE * np.linspace(0, 1, columns + 1) ** 2
    mesh = skfem.MeshQuad.init_tensor(across, across)
    radius = 10 * SIDE
    at = pressed(
        mesh,
        kinematics,
        Sphere((0.0, -radius), radius),
        motion=((1, -depth),),
        sides=((0.0, 0),),
        tolerance=depth * 2e-3,
        penalty=200 * YOUNG / SIDE,
    )
    result = settle(at.model, [Point(0.0)], [at.contact], options=EXACT)
    assert result.failure is None
    touch = at.contact.touches[0]
    width = touch.area if kinematics is Kinematics.PLANE_STRAIN else np.sqrt(touch.area / np.pi)
    return Indented(touch.force[1], width, touch.pressure)


def test_a_cylinder_presses_like_hertz():
    """Line contact: a^2 = 4 F R / (pi E*), p_max = E* a / (2 R) per depth (Johnson 1985, 4.2)."""
    plane_modulus = YOUNG / (1 - POISSON**2)
    radius = 10 * SIDE
    found = indent(24, Kinematics.PLANE_STRAIN, 1e-4 * SIDE * 3)
    force = 2 * found.force  # half by symmetry
    half_width = np.sqrt(4 * force * radius / (np.pi * plane_modulus))
    assert half_width < 0.2 * SIDE
    assert found.pressure == pytest.approx(plane_modulus * half_width / (2 * radius), rel=5e-3)
    assert found.half_width == pytest.approx(half_width, rel=0.1)


def test_a_sphere_presses_like_hertz():
    """F = 4/3 E* sqrt(R) d^1.5, a^2 = R d, p_max = 3 F / (2 pi a^2) (Johnson 1985, 4.2)."""
    plane_modulus = YOUNG / (1 - POISSON**2)
    radius = 10 * SIDE
    found = indent(24, Kinematics.AXISYMMETRIC, 1e-4 * SIDE * 3)
    half_width = (3 * found.force * radius / (4 * plane_modulus)) ** (1 / 3)
    assert half_width < 0.2 * SIDE
    assert found.pressure == pytest.approx(3 * found.force / (2 * np.pi * half_width**2), rel=5e-3)
    assert found.half_width == pytest.approx(half_width, rel=0.1)


# --- friction ----------------------------------------------------------------------------------


def dragged(friction: float, shift: float, points: int = 1):
    """A block on a plane, pressed in and then dragged along by its top."""
    at = pressed(
        strip(4, 2),
        Kinematics.PLANE_STRAIN,
        Plane((0.0, 0.0), (0.0, 1.0)),
        motion=((0, shift), (1, -2e-4)),
        friction=friction,
        tolerance=1e-7,
        penalty=20 * YOUNG / SIDE,
    )
    path = [Point(0.0, motion=(k + 1) / points) for k in range(points)]
    result = settle(at.model, path, [at.contact], options=EXACT)
    assert result.failure is None, result.failure
    return at, result.solutions[-1]


def test_a_block_dragged_far_slides_with_the_force_of_coulomb():
    at, solution = dragged(0.3, 5e-3, points=4)
    touch = at.contact.touches[-1]
    assert touch.slipping == pytest.approx(1.0)
    assert touch.force[0] == pytest.approx(-0.3 * touch.force[1], rel=1e-9)
    assert at.push(solution) == pytest.approx(-touch.force, rel=1e-7)


def test_a_block_dragged_a_little_sticks():
    at, solution = dragged(2.0, 5e-5)
    touch = at.contact.touches[-1]
    # only at the edges is there more shear than pressure
    assert touch.slipping < 0.3
    assert abs(touch.force[0]) < 0.9 * 2.0 * touch.force[1]
    assert at.push(solution) == pytest.approx(-touch.force, rel=1e-7)


def test_friction_asks_for_an_unsymmetric_solver():
    at, _ = dragged(0.3, 1e-4)
    assert not at.model.symmetric
