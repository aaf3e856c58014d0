"""Stress and strain fields against closed forms: bars, shear, thick walls, two materials."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from scipy.integrate import quad

from rig.mechanics.fe import (
    DisplacementControl,
    Kinematics,
    Model,
    Options,
    Point,
    PressureSurface,
    Solid,
    Solution,
    Support,
    discretise,
    follow,
)
from rig.mechanics.fe.extremes import summarise, volume_percentile
from rig.mechanics.fe.fields import nodal_fields, point_fields, recovered
from rig.mechanics.hyperelastic import (
    Hyperelastic,
    Mode,
    MooneyRivlin,
    NeoHookean,
    QuadraticVolume,
    Yeoh,
    response,
)
from tests.mechanics.fe_problems import BULK, SHEAR, curved_triangles, driven, meshes, ring

SHARP = Options(tolerance=1e-10, correction=0.0)
MESHES = meshes()
SOLIDS = ("hexahedra", "tetrahedra")


def _solved(model: Model) -> Solution:
    result = follow(model, [Point(0.0)], options=SHARP)
    assert result.failure is None
    return result.solutions[0]


@pytest.mark.parametrize("mixed", [True, False])
@pytest.mark.parametrize("name", SOLIDS)
def test_a_pulled_bar_has_the_stress_and_stretch_of_the_material_test(
    name: str, mixed: bool
) -> None:
    energy, volume = Yeoh(60e3, 5e3, 1e3), QuadraticVolume(BULK)
    bar = response(Hyperelastic(energy, volume), Mode.UNIAXIAL, np.array([1.6]))
    across = float(bar.transverse_stretch[0])
    d = discretise(MESHES[name][0], mixed=mixed)
    solid = Solid(d, energy, volume)
    solution = _solved(driven(d, [solid], np.diag([0.6, across - 1, across - 1])))
    true_stress = float((bar.nominal_stress * 1.6 / bar.volume_ratio)[0])
    at_points = point_fields(solid, solution.state.x, solution.state.points[0])
    for found in (at_points, recovered(solid, at_points)):
        np.testing.assert_allclose(found.von_mises, true_stress, rtol=1e-6)
        np.testing.assert_allclose(found.pressure, -true_stress / 3, rtol=1e-5)
        np.testing.assert_allclose(found.principal_stress[0], true_stress, rtol=1e-6)
        np.testing.assert_allclose(found.principal_stretch[0], 1.6, rtol=1e-8)
        np.testing.assert_allclose(found.principal_stretch[1:], across, rtol=1e-7)
        # the data sheet's stress: force over the section at rest
        np.testing.assert_allclose(found.nominal_stress[0], bar.nominal_stress[0], rtol=1e-6)


@pytest.mark.parametrize("name", [*SOLIDS, "plane quads", "plane triangles"])
def test_simple_shear_has_rivlins_stresses_and_stretches(name: str) -> None:
    mesh, kinematics = MESHES[name]
    amount = 0.8
    d = discretise(mesh, kinematics)
    solid = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))
    slope = np.zeros((d.dim, d.dim))
    slope[0, 1] = amount
    model = driven(d, [solid], slope)
    (found,) = nodal_fields(model, _solved(model).state)
    np.testing.assert_allclose(found.stress[0, 1], SHEAR * amount, rtol=1e-7)
    np.testing.assert_allclose(found.stress[0, 0] - found.stress[1, 1], SHEAR * amount**2)
    np.testing.assert_allclose(
        found.von_mises, SHEAR * np.sqrt(amount**4 + 3 * amount**2), rtol=1e-7
    )
    longest = amount / 2 + np.hypot(1, amount / 2)
    for value, expected in zip(found.principal_stretch, (longest, 1.0, 1 / longest), strict=True):
        np.testing.assert_allclose(value, expected, rtol=1e-7)


# Auysakul et al. (2023): W = C10 (I1 - 3) + C11 (I1 - 3)(I2 - 3) in MPa, lengths in mm
C10, C11, INNER, OUTER, BORE = 0.1192, 0.01484, 10.0, 20.0, 14.0
RUBBER = MooneyRivlin(C10, 0.0, c11=C11)


def _deviators(stretches: tuple[float, float, float]) -> np.ndarray:
    """lambda_a dW/dlambda_a, (3,): the Cauchy stresses but for a pressure."""
    s = np.array(stretches) ** 2
    i1, i2 = s.sum(), (1 / s).sum()
    return 2 * s * (C10 + C11 * (i2 - 3)) - 2 / s * C11 * (i1 - 3)


def _wall_stress(radius: float, exponent: int) -> tuple[float, float]:
    """Radial and von Mises stress at a radius at rest of an incompressible cylinder (2), sphere (3)
    whose bore is widened, the outside free."""

    def hoop_less_radial(at: float) -> float:
        now = (at**exponent + BORE**exponent - INNER**exponent) ** (1 / exponent)
        hoop = now / at
        stretches = (1 / hoop, hoop, 1.0) if exponent == 2 else (hoop**-2, hoop, hoop)
        dev = _deviators(stretches)
        return float(dev[1] - dev[0])

    def slope(at: float) -> float:
        """d sigma_r / dR."""
        cube = at**exponent + BORE**exponent - INNER**exponent
        return (exponent - 1) * hoop_less_radial(at) * at ** (exponent - 1) / cube

    now = (radius**exponent + BORE**exponent - INNER**exponent) ** (1 / exponent)
    hoop = now / radius
    stretches = (1 / hoop, hoop, 1.0) if exponent == 2 else (hoop**-2, hoop, hoop)
    dev = _deviators(stretches)
    dev -= dev.mean()
    radial = -quad(slope, radius, OUTER)[0]
    return radial, float(np.sqrt(1.5 * np.sum(dev**2)))


def _inflated_wall(n: int, kinematics: Kinematics, triangles: bool) -> tuple[Model, Solution]:
    mesh = ring(n, 2 * n, INNER, OUTER)
    if triangles:
        mesh = curved_triangles(mesh)
    d = discretise(mesh, kinematics)
    first, second = ("r", "z") if kinematics is Kinematics.AXISYMMETRIC else ("x", "y")
    supports = [
        Support.of(d, d.nodes_at(**{first: 0.0}), (0,)),
        Support.of(d, d.nodes_at(**{second: 0.0}), (1,)),
    ]
    solid = Solid(d, RUBBER, QuadraticVolume(1e5 * C10))
    model = Model(d, [solid], supports=supports, surface=PressureSurface(d, d.facets_on("bore")))
    corner = 2 * int(d.nodes_at(**{first: INNER, second: 0.0})[0])
    result = follow(model, [Point(BORE - INNER)], DisplacementControl((corner,)), options=SHARP)
    assert result.failure is None
    return model, result.solutions[0]


def _wall_errors(n: int, kinematics: Kinematics, triangles: bool) -> tuple[float, float]:
    """Root mean square error over the nodes of the radial and of the von Mises stress, relative to
    the largest exact value."""
    model, solution = _inflated_wall(n, kinematics, triangles)
    (found,) = nodal_fields(model, solution.state)
    nodes = model.discretisation.nodes[found.nodes]
    radius = np.linalg.norm(nodes, axis=1)
    distinct, back = np.unique(radius.round(9), return_inverse=True)
    exponent = 2 if kinematics is Kinematics.PLANE_STRAIN else 3
    radial, mises = np.array([_wall_stress(r, exponent) for r in distinct]).T[:, back]
    out = nodes / radius[:, None]
    along = np.einsum("ni,ijn,nj->n", out, found.stress[:2, :2], out)
    return (
        float(np.sqrt(np.mean((along - radial) ** 2)) / np.abs(radial).max()),
        float(np.sqrt(np.mean((found.von_mises - mises) ** 2)) / mises.max()),
    )


@pytest.mark.parametrize("kinematics", [Kinematics.PLANE_STRAIN, Kinematics.AXISYMMETRIC])
@pytest.mark.parametrize("triangles", [False, True])
def test_stress_in_thick_walls_converges_to_the_closed_form_at_second_order(
    kinematics: Kinematics, triangles: bool
) -> None:
    errors = np.array([_wall_errors(n, kinematics, triangles) for n in (2, 4, 8)])
    assert np.all(errors[-1] < 0.01)
    assert np.all(np.log2(errors[1] / errors[2]) > 1.8)


def test_two_materials_keep_their_own_stress_at_the_nodes_between_them() -> None:
    d = discretise(skfem.MeshHex().refined(1))
    upper = d.nodes[d.connectivity].mean(axis=1)[:, 2] > 0.5
    soft = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK), np.flatnonzero(~upper))
    stiff = Solid(d, NeoHookean(4 * SHEAR), QuadraticVolume(4 * BULK), np.flatnonzero(upper))
    # alike but for a factor: pulled side by side, both contract as the whole does
    bar = response(Hyperelastic(soft.distortion, soft.volume), Mode.UNIAXIAL, np.array([1.5]))
    across = float(bar.transverse_stretch[0])
    true_stress = float((bar.nominal_stress * 1.5 / bar.volume_ratio)[0])
    model = driven(d, [soft, stiff], np.diag([0.5, across - 1, across - 1]))
    solution = _solved(model)
    below, above = nodal_fields(model, solution.state)
    np.testing.assert_allclose(below.stress[0, 0], true_stress, rtol=1e-6)
    np.testing.assert_allclose(above.stress[0, 0], 4 * true_stress, rtol=1e-6)
    between = np.intersect1d(below.nodes, above.nodes)
    np.testing.assert_allclose(d.nodes[between][:, 2], 0.5)
    assert len(between) == 25
    peak = summarise(model, solution).von_mises
    assert peak.solid == 1
    assert peak.value == pytest.approx(4 * true_stress)
    # half the volume has four times the stress: more than 99.5 % of it is not below that
    assert peak.bulk == pytest.approx(peak.value)


def test_the_peak_is_where_the_closed_form_has_it() -> None:
    model, solution = _inflated_wall(6, Kinematics.PLANE_STRAIN, triangles=False)
    found = summarise(model, solution)
    radial, mises = _wall_stress(INNER, 2)
    assert -radial == pytest.approx(found.pressure, rel=1e-3)
    for peak in (found.von_mises, found.principal_strain, found.compression):
        assert np.linalg.norm(peak.place) == pytest.approx(INNER)
    assert found.von_mises.value == pytest.approx(mises, rel=0.01)
    assert found.principal_strain.value == pytest.approx(BORE / INNER - 1, rel=0.01)
    assert found.compression.value == pytest.approx(1 - INNER / BORE, rel=0.01)
    (solid,) = model.solids
    assert found.von_mises.bulk < found.von_mises.value
    at = point_fields(solid, solution.state.x, solution.state.points[0])
    for share in (0.5, 0.9):
        # so much of the volume lies beyond this radius at rest, where the stress is lower
        radius = float(np.sqrt(OUTER**2 - share * (OUTER**2 - INNER**2)))
        within = volume_percentile(at.von_mises.reshape(-1), at.weights.reshape(-1), share)
        assert within == pytest.approx(_wall_stress(radius, 2)[1], rel=0.02)


def test_a_volume_percentile_weighs_values_with_their_volumes() -> None:
    values, volumes = np.array([3.0, 1.0, 2.0]), np.array([1.0, 98.0, 1.0])
    assert volume_percentile(values, volumes, 0.98) == 1.0
    assert volume_percentile(values, volumes, 0.985) == 2.0
    assert volume_percentile(values, volumes, 1.0) == 3.0
