"""The batched kernels against scikit-fem's own forms, and against differences of the energy."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from skfem.helpers import ddot, det, grad, inv, transpose

from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import Kinematics, MeshError, Solid, discretise
from rig.mechanics.fe.discretisation import Discretisation
from rig.mechanics.fe.solid import volume_ratio
from rig.mechanics.fe.state import PointState
from rig.mechanics.hyperelastic import LogarithmicVolume, NeoHookean, QuadraticVolume
from tests.mechanics.fe_problems import BULK, SHEAR, distorted, meshes, scattered

MESHES = meshes()
ALONE = ", displacements alone"
PROBLEMS = [*MESHES, *(f"{name}{ALONE}" for name in MESHES)]


def _problem(name: str) -> tuple[Discretisation, Solid, np.ndarray, PointState]:
    mesh, kinematics = MESHES[name.removesuffix(ALONE)]
    d = discretise(mesh, kinematics, mixed=not name.endswith(ALONE))
    solid = Solid(d, NeoHookean(1.0), LogarithmicVolume(20.0))
    rng = np.random.default_rng(3)
    x = 0.03 * rng.standard_normal(d.size)
    pressure = 0.1 * rng.standard_normal(solid.initial().pressure.shape)
    return d, solid, x, PointState(pressure)


def _at_rest_in_pressure(solid: Solid, x: np.ndarray, points: PointState) -> PointState:
    """Discontinuous pressures where they make the energy stationary."""
    for _ in range(15):
        points = solid.advance(points, solid.evaluate(x, points), x, 0 * x, 1.0)
    return points


@pytest.mark.parametrize("name", ["hexahedra", "tetrahedra"])
def test_residual_and_tangent_are_those_of_scikit_fem_forms(name: str) -> None:
    d, solid, x, points = _problem(name)
    vector = skfem.Basis(d.mesh, skfem.ElementVector(d.element), quadrature=d.basis.quadrature)
    np.testing.assert_array_equal(vector.element_dofs.T, d.dofs)
    kappa, u = 20.0, vector.interpolate(x[: d.displacement_size])
    p = solid.pressure(x, points)

    def first_piola(f, p):
        j, f_t = det(f), transpose(inv(f))
        i1 = ddot(f, f)
        return j ** (-2 / 3) * (f - i1 / 3 * f_t) + p * j * f_t

    def identity(g):
        return np.eye(3)[:, :, None, None] + g

    @skfem.LinearForm
    def internal(v, w):
        return ddot(first_piola(identity(w["u"].grad), w["p"]), grad(v))

    @skfem.BilinearForm
    def slope(u, v, w):
        f, h = identity(w["u"].grad), grad(u)
        j, g = det(f), transpose(inv(f))
        i1 = ddot(f, f)
        turned = np.einsum("ij...,kj...,kl...->il...", g, h, g)  # -dF^-T
        along = ddot(g, h)
        distortion = j ** (-2 / 3) * (
            h - 2 / 3 * ddot(f, h) * g + i1 / 3 * turned - 2 / 3 * along * (f - i1 / 3 * g)
        )
        return ddot(distortion + w["p"] * j * (along * g - turned), grad(v))

    @skfem.LinearForm
    def volume_slope(v, w):
        f = identity(w["u"].grad)
        return w["phi"] * ddot(det(f) * transpose(inv(f)), grad(v))

    expected_r = internal.elemental(vector, u=u, p=p).tolocal()
    expected_k = slope.elemental(vector, u=u, p=p).tolocal()
    modes = range(d.pressure_values.shape[2])
    coupling = np.stack(
        [
            volume_slope.elemental(vector, u=u, phi=d.pressure_values[..., m]).tolocal()
            for m in modes
        ],
        axis=-1,
    )
    j = det(identity(u.grad))
    j_of_p = p / kappa + np.sqrt((p / kappa) ** 2 + 1)  # the root of p = kappa/2 (J - 1/J)
    compliance = 2 / (kappa * (1 + j_of_p**-2))
    phi, w = d.pressure_values, np.asarray(vector.dx)
    r_p = np.einsum("eq,eqm->em", w * (j - j_of_p), phi)
    bulk = np.einsum("eq,eqm,eqn->emn", w * compliance, phi, phi)
    if d.pressure_nodes:
        expected_r = np.concatenate((expected_r, r_p), axis=1)
        expected_k = np.block([[expected_k, coupling], [coupling.swapaxes(1, 2), -bulk]])
    else:
        inverse = np.linalg.inv(bulk)
        expected_r += np.einsum("eam,emn,en->ea", coupling, inverse, r_p)
        expected_k += coupling @ inverse @ coupling.swapaxes(1, 2)
    found = solid.evaluate(x, points)
    assert found.tangent is not None
    np.testing.assert_allclose(found.residual, expected_r, atol=1e-13 * np.abs(expected_r).max())
    np.testing.assert_allclose(found.tangent, expected_k, atol=1e-13 * np.abs(expected_k).max())


@pytest.mark.parametrize("name", PROBLEMS)
def test_residual_is_the_slope_of_the_energy(name: str) -> None:
    d, solid, x, points = _problem(name)
    step = 1e-6 * np.random.default_rng(4).standard_normal(d.size)

    def energy(x: np.ndarray) -> float:
        return solid.energy(x, _at_rest_in_pressure(solid, x, points))

    at = solid.evaluate(x, _at_rest_in_pressure(solid, x, points))
    slope = float(scattered(solid.dofs, at.residual, d.size) @ step)
    assert (energy(x + step) - energy(x - step)) / 2 == pytest.approx(slope, rel=1e-7)


@pytest.mark.parametrize("name", PROBLEMS)
def test_tangent_is_the_slope_of_the_residual_and_symmetric(name: str) -> None:
    d, solid, x, points = _problem(name)
    step = 1e-6 * np.random.default_rng(5).standard_normal(d.size)

    def residual(x: np.ndarray) -> np.ndarray:
        rest = _at_rest_in_pressure(solid, x, points)
        return scattered(solid.dofs, solid.evaluate(x, rest).residual, d.size)

    tangent = solid.evaluate(x, _at_rest_in_pressure(solid, x, points)).tangent
    assert tangent is not None
    largest = np.abs(tangent).max()
    np.testing.assert_allclose(tangent, tangent.swapaxes(1, 2), atol=1e-14 * largest)
    moved = np.einsum("eij,ej->ei", tangent, step[solid.dofs])
    expected = (residual(x + step) - residual(x - step)) / 2
    found = scattered(solid.dofs, moved, d.size)
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("name", PROBLEMS)
def test_independent_points_agree_where_strains_do(name: str) -> None:
    _, solid, x, points = _problem(name)
    plain = solid.evaluate(x, points)
    mixed = solid.evaluate(x, solid.free_points(x, points))
    assert mixed.gap == 0.0
    scale = np.abs(plain.tangent).max()
    np.testing.assert_allclose(mixed.residual, plain.residual, atol=1e-12 * scale)
    np.testing.assert_allclose(mixed.tangent, plain.tangent, atol=1e-12 * scale)


@pytest.mark.parametrize(
    "name", ["hexahedra", "tetrahedra", "axisymmetric quads", f"tetrahedra{ALONE}"]
)
def test_independent_points_see_the_strain_of_the_displacements_to_first_order(name: str) -> None:
    _, solid, x, points = _problem(name)
    points = _at_rest_in_pressure(solid, x, points)
    start = solid.free_points(x, points)
    direction = np.random.default_rng(6).standard_normal(x.shape)

    def miss(size: float) -> float:
        mixed = solid.evaluate(x + size * direction, start, tangent=False)
        plain = solid.evaluate(x + size * direction, points, tangent=False)
        return float(np.abs(mixed.residual - plain.residual).max())

    assert np.log2(miss(2e-4) / miss(1e-4)) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("name", ["hexahedra", "tetrahedra"])
def test_a_rigid_motion_costs_nothing(name: str) -> None:
    d, solid, _, _ = _problem(name)
    turn = np.linalg.qr(np.random.default_rng(7).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    x = np.zeros(d.size)
    x[: d.displacement_size] = (d.nodes @ (turn.T - np.eye(3)) + 0.3).reshape(-1)
    found = solid.evaluate(x, solid.initial())
    assert np.abs(found.residual).max() < 1e-14 * 20.0  # round-off of the bulk modulus
    assert solid.energy(x, solid.initial()) == pytest.approx(0.0, abs=1e-14)


def test_two_materials_share_a_mesh() -> None:
    mesh = skfem.MeshHex().refined(1)
    d = discretise(mesh)
    x = 0.02 * np.random.default_rng(8).standard_normal(d.size)
    whole = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))
    parts = [
        Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK), np.arange(a, b))
        for a, b in ((0, 3), (3, 8))
    ]
    total = sum(p.energy(x, p.initial()) for p in parts)
    assert total == pytest.approx(whole.energy(x, whole.initial()), rel=1e-13)
    together = np.concatenate([p.evaluate(x, p.initial()).residual for p in parts])
    np.testing.assert_array_equal(together, whole.evaluate(x, whole.initial()).residual)


@pytest.mark.parametrize("volume", [QuadraticVolume(2.0), LogarithmicVolume(2.0)])
def test_volume_follows_from_pressure(volume) -> None:
    wanted = np.linspace(-0.9, 3.0, 14)
    j, compliance = volume_ratio(volume, wanted)
    np.testing.assert_allclose(volume.pressure(j), wanted, atol=1e-13)
    np.testing.assert_allclose(compliance * volume.stiffness(j), 1.0, atol=1e-13)


def test_a_pressure_that_no_volume_has_gives_no_number() -> None:
    class Saturating:
        def energy(self, j):
            return np.log(np.cosh(j - 1))

        def pressure(self, j):
            return np.tanh(j - 1)

        def stiffness(self, j):
            return np.cosh(j - 1) ** -2.0

    j, compliance = volume_ratio(Saturating(), np.array([0.2, 2.0]))
    assert Saturating().pressure(j[0]) == pytest.approx(0.2)
    assert np.isnan(j[1])
    assert np.isnan(compliance[1])


def test_an_inverted_element_is_named() -> None:
    mesh = skfem.MeshHex().refined(1)
    places = mesh.p.copy()
    places[:, mesh.interior_nodes()[0]] += 0.8
    with pytest.raises(MeshError, match=r"inverted or flat, the first being element \d+ around"):
        discretise(skfem.MeshHex(places, mesh.t))


def test_meshes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(MeshError, match="no mixed element"):
        discretise(skfem.MeshLine())
    with pytest.raises(MeshError, match="needs a mesh in 2 dimensions"):
        discretise(skfem.MeshHex(), Kinematics.AXISYMMETRIC)
    d = discretise(skfem.MeshHex())
    with pytest.raises(MechanicsError, match="no boundary named 'cavity'"):
        d.facets_on("cavity")


def test_distortion_of_the_test_meshes_is_real() -> None:
    mesh = skfem.MeshHex().refined(1)
    assert np.abs(distorted(mesh).p - mesh.p).max() > 0.02
