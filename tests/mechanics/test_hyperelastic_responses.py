"""Material tests by computation: closed forms, energy balance, and inflated thick walls."""

from __future__ import annotations

import numpy as np
import pytest
from hyperelastic_cases import ISOCHORIC, OBJECTIVE
from scipy.integrate import quad

from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic import (
    Array,
    Energy,
    Hyperelastic,
    LinearElastic,
    Mode,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    OgdenTerm,
    QuadraticVolume,
    SaintVenantKirchhoff,
    incompressible_response,
    neo_hookean_from,
    response,
)

STRETCHES = np.array([0.3, 0.7, 0.99, 1.0, 1.01, 1.5, 3.0, 6.0])


def mooney_rivlin_stress(mode: Mode, x: Array, c10: float, c01: float) -> Array:
    """Nominal stress of an incompressible Mooney-Rivlin solid, Treloar, 1975, chapter 5."""
    return {
        Mode.UNIAXIAL: 2 * (x - x**-2) * (c10 + c01 / x),
        Mode.EQUIBIAXIAL: 2 * (x - x**-5) * (c10 + c01 * x**2),
        Mode.PLANAR: 2 * (x - x**-3) * (c10 + c01),
    }[mode]


@pytest.mark.parametrize("mode", Mode)
def test_neo_hookean_and_mooney_rivlin_have_their_closed_forms(mode: Mode) -> None:
    for energy, c10, c01 in (
        (NeoHookean(150e3), 75e3, 0.0),
        (MooneyRivlin(60e3, 15e3), 60e3, 15e3),
        (Ogden((OgdenTerm(120e3, 2.0), OgdenTerm(30e3, -2.0))), 60e3, 15e3),
    ):
        found = incompressible_response(energy, mode, STRETCHES).nominal_stress
        expected = mooney_rivlin_stress(mode, STRETCHES, c10, c01)
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-8)


@pytest.mark.parametrize("mode", Mode)
def test_ogden_has_its_closed_form(mode: Mode) -> None:
    terms = (OgdenTerm(99e3, 1.3), OgdenTerm(3e3, 5.0), OgdenTerm(12e3, -2.0))
    free = {Mode.UNIAXIAL: -0.5, Mode.EQUIBIAXIAL: -2.0, Mode.PLANAR: -1.0}[mode]
    x = STRETCHES
    expected = sum(
        2 * t.mu / t.alpha * (x ** (t.alpha - 1) - x ** (free * t.alpha - 1)) for t in terms
    )
    found = incompressible_response(Ogden(terms), mode, x).nominal_stress
    assert found == pytest.approx(expected, rel=1e-10, abs=1e-8)


@pytest.mark.parametrize("mode", Mode)
@pytest.mark.parametrize("energy", ISOCHORIC.values(), ids=ISOCHORIC)
def test_the_work_of_the_stress_is_the_energy(energy: Energy, mode: Mode) -> None:
    def stress(stretch: float) -> float:
        return float(incompressible_response(energy, mode, np.array(stretch)).nominal_stress)

    pulled_directions = 2 if mode is Mode.EQUIBIAXIAL else 1
    work, _ = quad(stress, 1, 1.8, epsrel=1e-10)
    free = incompressible_response(energy, mode, np.array(1.8)).transverse_stretch
    second = {Mode.UNIAXIAL: float(free), Mode.EQUIBIAXIAL: 1.8, Mode.PLANAR: 1.0}[mode]
    stored = energy.energy(np.diag((1.8, second, float(free))))
    assert pulled_directions * work == pytest.approx(float(stored), rel=1e-9)


@pytest.mark.parametrize("mode", Mode)
@pytest.mark.parametrize("energy", OBJECTIVE.values(), ids=OBJECTIVE)
def test_the_free_direction_is_free(energy: Energy, mode: Mode) -> None:
    material = energy
    if energy in ISOCHORIC.values():
        material = Hyperelastic(energy, QuadraticVolume(7.5e6))
    stretch = np.linspace(0.7, 1.3, 13)
    found = response(material, mode, stretch)
    free, pulled = found.transverse_stretch, found.stretch
    for at in range(stretch.size):
        second = {Mode.UNIAXIAL: free, Mode.EQUIBIAXIAL: pulled, Mode.PLANAR: np.ones(13)}[mode][at]
        f = np.diag((pulled[at], second, free[at]))
        stress = material.first_piola(f)
        assert stress[2, 2] == pytest.approx(0, abs=1e-4)
        assert stress[0, 0] == pytest.approx(found.nominal_stress[at], rel=1e-12, abs=1e-6)
        assert np.linalg.det(f) == pytest.approx(found.volume_ratio[at], rel=1e-12)


@pytest.mark.parametrize("mode", Mode)
def test_nearly_incompressible_tends_to_incompressible(mode: Mode) -> None:
    """The volume ratio is 1 + O(1/K), and so is the difference of the stresses."""
    stretch = np.array([0.5, 0.8, 1.3, 2.0, 3.0])
    differences, volumes = [], []
    for poisson in (0.499, 0.4999, 0.49999):
        material = neo_hookean_from(450e3, poisson)
        stress = incompressible_response(material.distortion, mode, stretch).nominal_stress
        found = response(material, mode, stretch)
        differences.append(np.abs(found.nominal_stress / stress - 1).max())
        volumes.append(np.abs(found.volume_ratio - 1).max())
    for errors in (differences, volumes):
        assert errors[0] / errors[1] == pytest.approx(10, rel=0.05)
        assert errors[1] / errors[2] == pytest.approx(10, rel=0.05)


def test_the_part_for_volume_drops_out_of_an_incompressible_test() -> None:
    material = neo_hookean_from(450e3, 0.49)
    whole = incompressible_response(material, Mode.UNIAXIAL, STRETCHES)
    part = incompressible_response(material.distortion, Mode.UNIAXIAL, STRETCHES)
    assert whole.nominal_stress == pytest.approx(part.nominal_stress, rel=1e-7, abs=1e-6)


def test_saint_venant_kirchhoff_contracts_by_poissons_ratio_of_green_strain() -> None:
    stretch = np.array([0.8, 1.0, 1.4])
    found = response(SaintVenantKirchhoff(450e3, 0.3), Mode.UNIAXIAL, stretch)
    assert found.transverse_stretch**2 - 1 == pytest.approx(-0.3 * (stretch**2 - 1), abs=1e-12)
    assert found.nominal_stress == pytest.approx(450e3 * stretch * (stretch**2 - 1) / 2, abs=1e-6)


def test_a_linear_bar_obeys_hooke() -> None:
    found = response(LinearElastic(450e3, 0.3), Mode.UNIAXIAL, np.array([0.9, 1.2]))
    assert found.nominal_stress == pytest.approx([-45e3, 90e3], rel=1e-12)
    assert found.transverse_stretch == pytest.approx([1.03, 0.94], rel=1e-12)


@pytest.mark.parametrize(
    ("mode", "inner_radius", "pressure_mpa"),
    [(Mode.PLANAR, 18.0, 0.149731), (Mode.EQUIBIAXIAL, 15.0, 0.227968)],
    ids=["cylinder", "sphere"],
)
def test_inflated_thick_walls_need_the_pressure_of_the_closed_form(
    mode: Mode, inner_radius: float, pressure_mpa: float
) -> None:
    """Walls from 10 to 20 mm: planar tension at each radius of a cylinder, biaxial of a sphere.

    The hoop stretch x falls from bore to outside, and the pressure is the integral of
    W'(x) / (x^k - 1), k = 2 for the cylinder and 3 for the sphere, W' the work per stretch.
    """
    wall = MooneyRivlin(0.1192, 0.0, c11=0.01484)
    power, directions = (2, 1) if mode is Mode.PLANAR else (3, 2)
    outer_radius = (20**power - 10**power + inner_radius**power) ** (1 / power)

    def by_stretch(x: float) -> float:
        stress = incompressible_response(wall, mode, np.array(x)).nominal_stress
        return directions * float(stress) / (x**power - 1)

    pressure, _ = quad(by_stretch, outer_radius / 20, inner_radius / 10, epsrel=1e-10)
    assert pressure == pytest.approx(pressure_mpa, abs=1e-6)


@pytest.mark.parametrize("stretch", [0.0, -1.0, np.nan, np.inf])
def test_stretches_that_cannot_be_are_refused(stretch: float) -> None:
    for test in (incompressible_response, response):
        with pytest.raises(MechanicsError, match="expected lengths over their lengths at rest"):
            test(neo_hookean_from(450e3, 0.49), Mode.PLANAR, np.array([1.0, stretch]))


@pytest.mark.parametrize(
    ("mode", "flat_at"),
    [
        (Mode.UNIAXIAL, (1 + 1 / 0.4) ** 0.5),
        (Mode.EQUIBIAXIAL, (1 + 0.6 / 0.8) ** 0.5),
        (Mode.PLANAR, (1 + 0.6 / 0.4) ** 0.5),
    ],
)
def test_a_material_that_collapses_is_told_where(mode: Mode, flat_at: float) -> None:
    """Saint Venant-Kirchhoff is squeezed flat where its Green strain would be below -1/2."""
    material = SaintVenantKirchhoff(450e3, 0.4)
    assert response(material, mode, np.array([0.99 * flat_at])).transverse_stretch < 0.3
    beyond = 1.01 * flat_at
    with pytest.raises(MechanicsError, match=f"{mode} response stops at a stretch of {beyond:.4g}"):
        response(material, mode, np.array([1.0, beyond, 2 * beyond]))
