"""Pressure on a cavity, dead loads, rigid bodies: forces, stiffness and volume."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from rig.mechanics.fe import (
    FiniteElementError,
    Kinematics,
    MeshError,
    Model,
    Pose,
    PressureSurface,
    RigidBody,
    Solid,
    discretise,
    gravity,
    rotation_vector,
    traction,
)
from rig.mechanics.fe.pattern import Pattern
from rig.mechanics.fe.rotation import rotation_matrix, skew
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume
from tests.mechanics.fe_problems import BULK, SHEAR, bending_tube, meshes, ring, scattered

MESHES = meshes()
RNG = np.random.default_rng


def _closed(name: str, **options):
    mesh, kinematics = MESHES[name]
    d = discretise(mesh, kinematics)
    surface = PressureSurface(d, mesh.boundary_facets(), **options)
    x = 0.05 * RNG(1).standard_normal(d.size)
    return d, surface, x


@pytest.mark.parametrize("name", ["hexahedra", "tetrahedra", "plane quads", "plane triangles"])
def test_the_area_vector_of_a_closed_surface_vanishes_however_deformed(name: str) -> None:
    d, surface, x = _closed(name)
    for at in (np.zeros_like(x), x):
        total = surface.evaluate(at).residual.reshape(-1, d.dim).sum(axis=0)
        np.testing.assert_allclose(total, 0.0, atol=1e-13)
    np.testing.assert_allclose(surface.rest_area, 0.0, atol=1e-14)


@pytest.mark.parametrize("name", MESHES)
def test_the_boundary_encloses_the_volume_of_the_solid(name: str) -> None:
    d, surface, x = _closed(name)
    # seen from the cavity, which here is the solid itself turned inside out
    assert -surface.rest_volume == pytest.approx(d.weights.sum(), rel=1e-12)
    solid = Solid(d, NeoHookean(1.0), QuadraticVolume(1.0))
    f = solid.deformation_gradient(x)
    now = float(np.sum(d.weights * np.linalg.det(np.moveaxis(f, (0, 1), (-2, -1)))))
    # quadrature of det F in the solid is not exact on distorted elements
    assert -surface.evaluate(x).volume == pytest.approx(now, rel=2e-3)


@pytest.mark.parametrize("name", ["hexahedra", "plane quads"])
def test_the_volume_of_a_closed_surface_does_not_depend_on_the_origin(name: str) -> None:
    d, here, x = _closed(name)
    _, there, _ = _closed(name, origin=np.full(d.dim, 3.0))
    assert there.evaluate(x).volume == pytest.approx(here.evaluate(x).volume, rel=1e-12)


@pytest.mark.parametrize("name", MESHES)
def test_pressure_works_on_the_change_of_volume(name: str) -> None:
    d, surface, x = _closed(name)
    at = surface.evaluate(x)
    force = scattered(surface.dofs, at.residual, d.size)
    slope = scattered(surface.dofs, at.volume_slope, d.size)
    np.testing.assert_allclose(force, -slope, atol=1e-13 * np.abs(force).max())
    step = 1e-5 * RNG(2).standard_normal(d.size)
    change = (surface.evaluate(x + step).volume - surface.evaluate(x - step).volume) / 2
    assert change == pytest.approx(float(slope @ step), rel=1e-7)


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("name", MESHES)
def test_load_stiffness_is_the_slope_of_the_force(name: str, symmetric: bool) -> None:
    d, surface, x = _closed(name, symmetric=symmetric)
    step = 1e-5 * RNG(3).standard_normal(d.size)

    def force(x: np.ndarray) -> np.ndarray:
        return scattered(surface.dofs, surface.evaluate(x).residual, d.size)

    moved = np.einsum("fij,fj->fi", surface.evaluate(x).tangent, step[surface.dofs])
    expected = (force(x + step) - force(x - step)) / 2
    found = scattered(surface.dofs, moved, d.size)
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


def test_the_stiffness_of_an_open_surface_is_not_symmetric_but_its_slope_all_the_same() -> None:
    mesh, _ = MESHES["hexahedra"]
    d = discretise(mesh)
    facets = mesh.facets_satisfying(lambda x: np.isclose(x[0], 1.0))
    surface = PressureSurface(d, facets, symmetric=False)
    x = 0.05 * RNG(4).standard_normal(d.size)
    step = 1e-5 * RNG(5).standard_normal(d.size)
    tangent = surface.evaluate(x).tangent
    moved = scattered(surface.dofs, np.einsum("fij,fj->fi", tangent, step[surface.dofs]), d.size)
    force = [
        scattered(surface.dofs, surface.evaluate(x + s * step).residual, d.size) for s in (1, -1)
    ]
    np.testing.assert_allclose(moved, (force[0] - force[1]) / 2, atol=1e-12)
    pattern = Pattern(d.size, [surface.dofs], d.dim)
    matrix = pattern.matrix(pattern.assemble([tangent]))
    assert abs(matrix - matrix.T).max() > 1e-3 * abs(matrix).max()


def test_the_sphere_of_a_turned_quarter_ring_encloses_half_a_ball() -> None:
    mesh = ring(1, 8, 1.0, 2.0)
    d = discretise(mesh, Kinematics.AXISYMMETRIC)
    surface = PressureSurface(d, d.facets_on("bore"))
    assert surface.rest_volume == pytest.approx(2 / 3 * np.pi, rel=1e-5)
    # the pressure pushes the hemisphere up on pi r^2
    np.testing.assert_allclose(surface.rest_area[1], -np.pi, rtol=1e-5)


def test_dead_pressure_stays_as_it_was() -> None:
    _, surface, x = _closed("hexahedra", follower=False)
    at = surface.evaluate(x)
    np.testing.assert_array_equal(at.residual, surface.evaluate(0 * x).residual)
    assert not at.tangent.any()
    follower = _closed("hexahedra")[1]
    np.testing.assert_array_equal(at.residual, follower.evaluate(0 * x).residual)
    assert at.volume == follower.evaluate(x).volume


def test_pressure_inside_the_solid_is_refused() -> None:
    mesh, _ = MESHES["hexahedra"]
    d = discretise(mesh)
    inside = np.setdiff1d(np.arange(mesh.nfacets), mesh.boundary_facets())
    with pytest.raises(MeshError, match="between two elements"):
        PressureSurface(d, inside)
    with pytest.raises(MeshError, match="at least one facet"):
        PressureSurface(d, inside[:0])


def test_gravity_weighs_the_solid_and_acts_at_its_centre() -> None:
    tube = bending_tube()
    d = tube.discretisation
    weight = gravity(tube.solid, 1160.0, np.array([9.81, 0.0, -1.0])).reshape(-1, 3)
    volume = d.weights.sum()
    np.testing.assert_allclose(
        weight.sum(axis=0), 1160 * volume * np.array([9.81, 0, -1]), rtol=1e-12, atol=1e-15
    )
    points = np.moveaxis(np.asarray(d.basis.global_coordinates()), 0, -1)
    centre = np.einsum("eq,eqi->i", d.weights, points) / volume
    moment = np.cross(d.nodes - centre, weight).sum(axis=0)
    np.testing.assert_allclose(moment, 0.0, atol=1e-12 * np.abs(weight).sum())


def test_a_traction_adds_up_to_stress_times_area() -> None:
    mesh, kinematics = MESHES["axisymmetric quads"]
    d = discretise(mesh, kinematics)
    top = mesh.facets_satisfying(lambda x: np.isclose(x[1], 1.0))
    force = traction(d, top, np.array([0.0, 5.0])).reshape(-1, 2).sum(axis=0)
    np.testing.assert_allclose(force, [0.0, 5.0 * np.pi * (2**2 - 1**2)], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, 3.0, np.pi])
def test_rotations_come_back_as_the_vector_they_were_made_from(angle: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3
    turn = rotation_matrix(angle * axis)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(np.abs(rotation_vector(turn)), np.abs(angle * axis), atol=1e-12)
    if angle < np.pi:
        np.testing.assert_allclose(rotation_vector(turn), angle * axis, atol=1e-12)
    np.testing.assert_allclose(skew(axis) @ axis, 0.0, atol=1e-16)


@pytest.mark.parametrize("free", [("x", "y", "z", "about_x", "about_y", "about_z"), ("x", "z")])
def test_a_rigid_body_keeps_all_distances(free: tuple[str, ...]) -> None:
    tube = bending_tube()
    d = tube.discretisation
    body = RigidBody(d, tube.cap.nodes, free=free, centre=np.array([1.0, 2.0, 3.0]))
    pose = Pose()
    for seed in range(5):
        pose = body.moved(pose, RNG(seed).standard_normal(body.size))
    before = d.nodes[body.nodes]
    after = before + body.displacements(pose).reshape(-1, 3)
    spread = np.linalg.norm(before[:, None] - before, axis=-1)
    np.testing.assert_allclose(np.linalg.norm(after[:, None] - after, axis=-1), spread, atol=1e-14)


def test_directions_and_curvature_of_a_rigid_body_are_its_first_and_second_slopes() -> None:
    tube = bending_tube()
    body = RigidBody(
        tube.discretisation,
        tube.cap.nodes,
        free=("x", "y", "z", "about_x", "about_y", "about_z"),
        centre=np.array([0.01, 0.0, -0.02]),
    )
    pose = body.moved(Pose(), RNG(1).standard_normal(6))
    forces = RNG(2).standard_normal(len(body.dofs))
    step, h = RNG(3).standard_normal(6), 1e-4
    moved = [body.displacements(body.moved(pose, s * h * step)) for s in (-1, 0, 1)]
    first = (moved[2] - moved[0]) / (2 * h)
    second = forces @ (moved[2] - 2 * moved[1] + moved[0]) / h**2
    np.testing.assert_allclose(body.directions(pose) @ step, first, atol=1e-8)
    assert second == pytest.approx(step @ body.curvature(pose, forces) @ step, rel=1e-5)


def test_rigid_bodies_that_make_no_sense_are_refused() -> None:
    tube = bending_tube()
    d = tube.discretisation
    with pytest.raises(FiniteElementError, match="cannot do 'twist'"):
        RigidBody(d, tube.cap.nodes, free=("twist",), centre=np.zeros(3))
    with pytest.raises(FiniteElementError, match="share nodes"):
        Model(d, [tube.solid], bodies=[tube.cap, tube.cap])
    with pytest.raises(FiniteElementError, match="cover 1 of"):
        Model(d, [Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK), np.array([0]))])


def test_assembly_adds_what_the_plain_way_adds() -> None:
    d = discretise(skfem.MeshHex().refined(1))
    blocks = [d.dofs, d.dofs[:2, :27]]
    values = [RNG(i).standard_normal((*b.shape, b.shape[1])) for i, b in enumerate(blocks)]
    expected = np.zeros((d.size, d.size))
    for dofs, k in zip(blocks, values, strict=True):
        for row, local in zip(dofs, k, strict=True):
            expected[np.ix_(row, row)] += local
    for dim in (1, 3):
        pattern = Pattern(d.size, blocks, dim)
        data = pattern.assemble(values)
        np.testing.assert_allclose(pattern.matrix(data).toarray(), expected, atol=1e-13)
        keep = np.arange(5, d.size, 2)
        np.testing.assert_allclose(
            pattern.submatrix(keep).take(data).toarray(), expected[np.ix_(keep, keep)], atol=1e-13
        )
        # a zero stays an entry: the pattern is for life
        assert pattern.matrix(0 * data).nnz == len(data)
