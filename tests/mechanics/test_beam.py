"""The closed form of equations (2) to (9) against symbolic and numerical Castigliano."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from bellow_strategies import bending_bellows
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import diags
from scipy.sparse.linalg import spsolve

from rig.mechanics.beam import (
    BeamTheory,
    fit_free_parameter,
    lever_integrals,
    published_free_parameter,
)
from rig.mechanics.bellow import BellowShape
from rig.mechanics.errors import MechanicsError
from rig.spec.actuator import BellowBendingGeometry

E = 450e3


@pytest.fixture(scope="module")
def symbolic():
    """M_A and dx as functions of (R1, R2, f, F_A, p, EI), straight from (2) to (7)."""
    r1, r2, f, load, p, rigidity = sp.symbols("R1 R2 f F_A p EI", positive=True)
    moment_a, s, phi = sp.symbols("M_A s phi", real=True)
    m1 = moment_a + p * r1**2 * (1 - sp.cos(phi)) ** 2 / 2 - load * r1 * (1 - sp.cos(phi))
    m2 = moment_a + p * (s + r1) ** 2 / 2 - load * (s + r1)
    x3 = r1 + f + r2 * sp.sin(phi)
    m3 = moment_a + p * x3**2 / 2 - load * x3
    energy = (
        sp.integrate(sp.expand(m1**2) * r1, (phi, 0, sp.pi / 2))
        + sp.integrate(sp.expand(m2**2), (s, 0, f))
        + sp.integrate(sp.expand(m3**2) * r2, (phi, 0, sp.pi / 2))
    ) / (2 * rigidity)
    solved = sp.solve(sp.diff(energy, moment_a), moment_a)[0]
    displacement = sp.diff(energy, load).subs(moment_a, solved)
    arguments = (r1, r2, f, load, p, rigidity)
    return [lambda *values, e=e: _evaluate(e, arguments, values) for e in (solved, displacement)]


def _evaluate(expression, symbols, values):
    exact = {symbol: sp.Float(value, 40) for symbol, value in zip(symbols, values, strict=True)}
    return float(expression.evalf(40, subs=exact))


def _arguments(theory: BeamTheory, pressure: float):
    half, wall = theory.shape.middle_surface, theory.shape.wall
    rigidity = theory.young_modulus * wall**3 / 12
    load = float(theory.axial_load(pressure))
    return half.crest_radius, half.trough_radius, half.flank, load, pressure, rigidity


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"wall_thickness": "0.6 mm"},
        {"bellow_number": 9},
        {"radius_ratio": 0.5},
        {"average_radius": "4.125 mm", "bellow_number": 6},  # no flank
        {"effective_length": "120 mm", "average_radius": "20 mm", "wall_thickness": "4.9 mm"},
    ],
)
def test_closed_form_is_symbolic_castigliano(symbolic, changes):
    geometry = BellowBendingGeometry(family="bellow-bending", **changes)
    theory = BeamTheory(geometry, E, 1.0)
    moment, displacement = symbolic
    arguments = _arguments(theory, 7e3)
    assert float(theory.crest_moment(7e3)) == pytest.approx(moment(*arguments), rel=1e-12)
    assert float(theory.axial_displacement(7e3)) == pytest.approx(
        displacement(*arguments), rel=1e-12
    )


@settings(max_examples=40)
@given(geometry=bending_bellows())
def test_closed_form_minimises_the_complementary_energy(geometry):
    """Gauss quadrature of M^2; the minimum over M_A of a quadratic by three evaluations."""
    theory = BeamTheory(geometry, E, 1.0)
    lever, weight = _beam_quadrature(theory)
    *_, load, pressure, rigidity = _arguments(theory, 5e3)

    def energy(crest_moment, axial_load):
        moment = crest_moment + pressure * lever**2 / 2 - axial_load * lever
        return weight @ moment**2 / (2 * rigidity)

    def minimum(axial_load):
        scale = abs(axial_load) * lever.max()
        values = np.array([energy(m * scale, axial_load) for m in (-1.0, 0.0, 1.0)])
        best = (values[0] - values[2]) / (2 * (values[0] - 2 * values[1] + values[2])) * scale
        return best, energy(best, axial_load)

    best, _ = minimum(load)
    step = 0.5 * load  # the minimum is quadratic in the load: a central difference is exact
    slope = (minimum(load + step)[1] - minimum(load - step)[1]) / (2 * step)
    assert float(theory.crest_moment(pressure)) == pytest.approx(best, rel=1e-9)
    assert float(theory.axial_displacement(pressure)) == pytest.approx(slope, rel=1e-7)


@pytest.mark.parametrize("changes", [{}, {"wall_thickness": "0.5 mm"}, {"radius_ratio": 0.2}])
def test_closed_form_minimises_the_total_potential_energy(changes):
    """Displacement form: finite elements for the rotation psi of the guided cantilever.

    Potential = integral EI psi'^2 / 2 ds - F_A u(A) + integral p u dX with u = -integral psi dX
    from D and psi = 0 at A and D. Nothing of the force method enters.
    """
    theory = BeamTheory(BellowBendingGeometry(family="bellow-bending", **changes), E, 1.0)
    r1, r2, f, load, pressure, rigidity = _arguments(theory, 10e3)
    ends = np.cumsum([0.0, r1 * np.pi / 2, f, r2 * np.pi / 2])
    s = np.unique(np.concatenate([np.linspace(a, b, 1500) for a, b in pairwise(ends)]))
    lever = np.where(
        s < ends[1],
        r1 * (1 - np.cos(s / r1)),
        np.where(s < ends[2], r1 + s - ends[1], r1 + f + r2 * np.sin((s - ends[2]) / r2)),
    )
    lengths, rises = np.diff(s), np.diff(lever)
    middle = (lever[1:] + lever[:-1]) / 2
    stiffness = rigidity * diags(
        [-1 / lengths[1:-1], 1 / lengths[1:] + 1 / lengths[:-1], -1 / lengths[1:-1]], [-1, 0, 1]
    )
    torque = (load - pressure * middle) * rises / 2  # work of loads on psi, half to either node
    psi = np.zeros_like(s)
    psi[1:-1] = spsolve(stiffness.tocsc(), torque[1:] + torque[:-1])
    elongation = np.sum((psi[1:] + psi[:-1]) / 2 * rises)
    assert float(theory.axial_displacement(10e3)) == pytest.approx(elongation, rel=1e-5)


def _beam_quadrature(theory: BeamTheory):
    half = theory.shape.middle_surface
    nodes, weights = np.polynomial.legendre.leggauss(40)
    share, weights = (nodes + 1) / 2, weights / 2
    quarter = np.pi / 2
    lever = np.concatenate(
        [
            half.crest_radius * (1 - np.cos(share * quarter)),
            half.crest_radius + share * half.flank,
            half.crest_radius + half.flank + half.trough_radius * np.sin(share * quarter),
        ]
    )
    lengths = (half.crest_radius * quarter, half.flank, half.trough_radius * quarter)
    return lever, np.concatenate([length * weights for length in lengths])


@given(geometry=bending_bellows())
def test_lever_integrals_are_the_integrals_of_the_lever(geometry):
    theory = BeamTheory(geometry, E, 1.0)
    half = theory.shape.middle_surface
    j = lever_integrals(half.crest_radius, half.flank, half.trough_radius)
    lever, weight = _beam_quadrature(theory)
    expected = [weight @ lever**n for n in range(4)]
    np.testing.assert_allclose([j.j0, j.j1, j.j2, j.j3], expected, rtol=1e-13)


@given(geometry=bending_bellows(), pressure=st.floats(1.0, 20e3))
def test_axial_load_of_paper_and_toolbox_are_one(geometry, pressure):
    theory = BeamTheory(geometry, E, 1.0)
    shape = BellowShape.of(geometry)
    toolbox = pressure * (shape.outer_radius - shape.inner_radius) / 2
    toolbox += pressure * shape.inner_radius / 2
    assert float(theory.axial_load(pressure)) == pytest.approx(toolbox, rel=1e-9)


@given(geometry=bending_bellows(), pressure=st.floats(0, 50e3), factor=st.floats(0, 10))
def test_the_theory_is_linear_in_pressure(geometry, pressure, factor):
    theory = BeamTheory(geometry, E, published_free_parameter(geometry, E))
    once, scaled = theory.angle([pressure, factor * pressure])
    assert scaled == pytest.approx(factor * once, rel=1e-12, abs=1e-300)


@given(geometry=bending_bellows())
def test_pressure_opens_every_admissible_bellow(geometry):
    theory = BeamTheory(geometry, E, published_free_parameter(geometry, E))
    assert float(theory.axial_displacement(1e3)) > 0
    assert float(theory.angle(1e3)) > 0


def test_default_design_at_10_kpa(default_geometry, agilus30):
    """Regression of the figures that docs/theory/beam.md reports."""
    theory = BeamTheory.of(default_geometry, agilus30)
    assert theory.free_parameter == pytest.approx(0.93528, abs=1e-5)
    assert float(theory.axial_displacement(10e3)) * 1e3 == pytest.approx(7.1731, abs=1e-4)
    assert float(np.degrees(theory.angle(10e3))) == pytest.approx(114.633, abs=1e-3)


def test_a_thin_wall_bends_more(agilus30):
    thick, thin = (
        BeamTheory.of(BellowBendingGeometry(family="bellow-bending", wall_thickness=t), agilus30)
        for t in ("1.5 mm", "1.2 mm")
    )
    assert float(thin.angle(5e3)) > float(thick.angle(5e3))


def test_stiffness_grows_only_with_the_modulus_to_the_power_0_4(default_geometry):
    soft, stiff = (
        BeamTheory(default_geometry, e, published_free_parameter(default_geometry, e))
        for e in (450e3, 4500e3)
    )
    assert float(soft.angle(1e4) / stiff.angle(1e4)) == pytest.approx(10**0.4, rel=1e-12)


def test_angle_is_length_difference_over_the_height(default_geometry, agilus30):
    theory = BeamTheory.of(default_geometry, agilus30)
    pressures = np.linspace(0, 12e3, 7)
    count, height = 6, 2 * 10e-3 + 3e-3
    elongation = count * theory.axial_displacement(pressures) / theory.free_parameter
    np.testing.assert_allclose(theory.length_difference(pressures), elongation, rtol=1e-14)
    np.testing.assert_allclose(theory.angle(pressures), elongation / height, rtol=1e-14)


def test_fit_recovers_the_free_parameter_and_its_offset(default_geometry, agilus30):
    pressures = np.linspace(0, 10e3, 11)
    theory = BeamTheory.of(default_geometry, agilus30, free_parameter=0.8)
    fit = fit_free_parameter(default_geometry, agilus30, pressures, theory.angle(pressures))
    assert fit.value == pytest.approx(0.8, rel=1e-12)
    assert fit.standard_uncertainty == pytest.approx(0, abs=1e-12)
    shifted = theory.angle(pressures) + 0.07
    fit = fit_free_parameter(default_geometry, agilus30, pressures, shifted, with_offset=True)
    assert fit.value == pytest.approx(0.8, rel=1e-10)
    assert fit.offset == pytest.approx(0.07, rel=1e-10)


def test_uncertainty_of_the_fit_is_the_scatter_of_repeated_fits(default_geometry, agilus30):
    rng = np.random.default_rng(5)
    pressures = np.linspace(0, 10e3, 11)
    clean = BeamTheory.of(default_geometry, agilus30, free_parameter=0.9).angle(pressures)
    fits = [
        fit_free_parameter(
            default_geometry, agilus30, pressures, clean + rng.normal(0, 0.03, clean.size)
        )
        for _ in range(1000)
    ]
    scatter = np.std([fit.value for fit in fits], ddof=1)
    stated = np.sqrt(np.mean([fit.standard_uncertainty**2 for fit in fits]))
    assert stated == pytest.approx(scatter, rel=0.1)  # 1000 fits: scatter known to 2 %


@pytest.mark.parametrize(
    ("pressures", "angles"),
    [([1e3], [0.2]), ([1e3, 2e3], [0.2]), ([0.0, 0.0], [0.1, 0.2]), ([1e3, 2e3], [-0.1, -0.2])],
)
def test_fit_refuses_data_that_cannot_determine_b(default_geometry, agilus30, pressures, angles):
    with pytest.raises(MechanicsError, match="free parameter"):
        fit_free_parameter(default_geometry, agilus30, pressures, angles)


def test_unfolding_pressure_is_where_the_arcs_are_used_up(default_geometry, agilus30):
    theory = BeamTheory.of(default_geometry, agilus30)
    limit = theory.unfolding_pressure
    half = theory.deformed_convolution([0.5 * limit, limit])
    assert half.trough_angle[0] > 0.5
    assert half.trough_angle[1] == pytest.approx(0.1, abs=1e-6)
    np.testing.assert_allclose(half.stretch, 1.0, rtol=1e-9)
    with pytest.raises(MechanicsError, match=r"14\.64 kPa"):
        theory.deformed_convolution(1.01 * limit)
