"""Energies: stress and tangent are true derivatives, and obey what physics asks of any solid."""

from __future__ import annotations

import numpy as np
import pytest
from hyperelastic_cases import (
    ALL,
    ISOCHORIC,
    OBJECTIVE,
    deformations,
    random_deformations,
    rotations,
)
from hypothesis import given, settings
from scipy.optimize import brentq

from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic import (
    Array,
    ArrudaBoyce,
    Energy,
    Hyperelastic,
    LinearElastic,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    OgdenTerm,
    SaintVenantKirchhoff,
    Yeoh,
    bulk_modulus_from,
    neo_hookean_from,
    shear_modulus_at_rest,
)
from rig.mechanics.hyperelastic.tensors import BLOCK

CLOSED = {
    name: energy
    for name, energy in ALL.items()
    if not isinstance(energy.distortion if isinstance(energy, Hyperelastic) else energy, Ogden)
}
"""Closed expressions in F, so that a complex step goes through; Ogden's iterates for its axes."""


def each(energies: dict[str, Energy]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("energy", energies.values(), ids=energies)


def relative(found: Array, expected: Array) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


@each(CLOSED)
def test_stress_and_tangent_are_derivatives_to_round_off(energy: Energy) -> None:
    f = random_deformations(50)
    stress, tangent = np.empty_like(f), np.empty((3, 3, *f.shape))
    for k in range(3):
        for l in range(3):  # noqa: E741
            step = f.astype(complex)
            step[k, l] += 1e-30j
            stress[k, l] = energy.energy(step).imag / 1e-30
            tangent[:, :, k, l] = energy.first_piola(step).imag / 1e-30
    assert relative(energy.first_piola(f), stress) < 1e-12
    assert relative(energy.tangent(f), tangent) < 1e-12


@each(ALL)
def test_stress_and_tangent_are_the_slopes_of_small_differences(energy: Energy) -> None:
    f = random_deformations(50)
    h = 1e-5
    stress, tangent = np.empty_like(f), np.empty((3, 3, *f.shape))
    for k in range(3):
        for l in range(3):  # noqa: E741
            ahead, behind = f.copy(), f.copy()
            ahead[k, l] += h
            behind[k, l] -= h
            stress[k, l] = (energy.energy(ahead) - energy.energy(behind)) / (2 * h)
            tangent[:, :, k, l] = (energy.first_piola(ahead) - energy.first_piola(behind)) / (2 * h)
    assert relative(energy.first_piola(f), stress) < 1e-6
    assert relative(energy.tangent(f), tangent) < 1e-6


@each(ALL)
@settings(max_examples=15)
@given(f=deformations())
def test_the_tangent_is_symmetric(energy: Energy, f: Array) -> None:
    tangent = energy.tangent(f)
    assert relative(tangent, np.einsum("ijkl->klij", tangent)) < 1e-13


@each(OBJECTIVE)
@settings(max_examples=15)
@given(f=deformations(), turn=rotations)
def test_a_turned_observer_sees_turned_stress(energy: Energy, f: Array, turn: Array) -> None:
    scale = np.abs(energy.tangent(f)).max()
    assert energy.energy(turn @ f) == pytest.approx(energy.energy(f), abs=1e-12 * scale)
    turned = turn @ energy.first_piola(f)
    assert energy.first_piola(turn @ f) == pytest.approx(turned, abs=1e-12 * scale)
    tangent = np.einsum("im,kn,mjnl->ijkl", turn, turn, energy.tangent(f))
    assert energy.tangent(turn @ f) == pytest.approx(tangent, abs=1e-11 * scale)


@each(OBJECTIVE)
@settings(max_examples=15)
@given(f=deformations(), turn=rotations)
def test_no_direction_of_the_material_is_special(energy: Energy, f: Array, turn: Array) -> None:
    scale = np.abs(energy.tangent(f)).max()
    assert energy.energy(f @ turn) == pytest.approx(energy.energy(f), abs=1e-12 * scale)
    turned = energy.first_piola(f) @ turn
    assert energy.first_piola(f @ turn) == pytest.approx(turned, abs=1e-12 * scale)


@each(OBJECTIVE)
@settings(max_examples=15)
@given(f=deformations())
def test_moments_balance(energy: Energy, f: Array) -> None:
    kirchhoff = energy.first_piola(f) @ f.T
    scale = np.abs(energy.tangent(f)).max()
    assert kirchhoff == pytest.approx(kirchhoff.T, abs=1e-12 * scale)


@each(ISOCHORIC)
@settings(max_examples=15)
@given(f=deformations())
def test_swelling_costs_an_isochoric_energy_nothing(energy: Energy, f: Array) -> None:
    assert energy.energy(1.7 * f) == pytest.approx(energy.energy(f), rel=1e-11, abs=1e-9)
    scale = np.abs(energy.tangent(f)).max()
    mean_stress = np.einsum("ij,ij", energy.first_piola(f), f)
    assert mean_stress == pytest.approx(0, abs=1e-12 * scale)


@each(ALL)
def test_at_rest_there_is_neither_energy_nor_stress(energy: Energy) -> None:
    scale = np.abs(energy.tangent(np.eye(3))).max()
    assert energy.energy(np.eye(3)) == pytest.approx(0, abs=1e-14 * scale)
    assert np.abs(energy.first_piola(np.eye(3))).max() <= 1e-14 * scale


@pytest.mark.parametrize(
    ("energy", "shear_modulus"),
    [
        (NeoHookean(3.0), 3.0),
        (MooneyRivlin(1.2, 0.3, 5.0, 6.0, 7.0), 2 * (1.2 + 0.3)),
        (Yeoh(1.2, 5.0, 6.0), 2 * 1.2),
        (Ogden((OgdenTerm(2.0, 1.3), OgdenTerm(0.5, -7.0))), 2.5),
        (Ogden.classic([(2.0, 1.3), (-0.5, -7.0)]), (2.0 * 1.3 + 0.5 * 7.0) / 2),
        (SaintVenantKirchhoff(2.6, 0.3), 1.0),
        (neo_hookean_from(2.6, 0.3), 1.0),
        (
            ArrudaBoyce(2.0, 3.0),
            2.0
            * (
                1
                + 3 / (5 * 3.0**2)
                + 99 / (175 * 3.0**4)
                + 513 / (875 * 3.0**6)
                + 42039 / (67375 * 3.0**8)
            ),
        ),
    ],
    ids=lambda case: type(case).__name__ if not isinstance(case, float) else "",
)
def test_small_strain_is_linear_elasticity(energy: Energy, shear_modulus: float) -> None:
    assert shear_modulus_at_rest(energy) == pytest.approx(shear_modulus, rel=1e-12)
    bulk = np.einsum("iijj", energy.tangent(np.eye(3))) / 9
    young = 9 * bulk * shear_modulus / (3 * bulk + shear_modulus)
    poisson = young / (2 * shear_modulus) - 1
    if bulk > 1e-9:
        linear = LinearElastic(young, poisson)
        assert energy.tangent(np.eye(3)) == pytest.approx(linear.tangent(np.eye(3)), abs=1e-12)
    else:  # isochoric: the deviatoric part of linear elasticity
        unit = np.eye(3)
        same = np.einsum("ik,jl->ijkl", unit, unit) + np.einsum("il,jk->ijkl", unit, unit)
        deviatoric = shear_modulus * (same - 2 / 3 * np.einsum("ij,kl->ijkl", unit, unit))
        assert energy.tangent(unit) == pytest.approx(deviatoric, abs=1e-12)


@pytest.mark.parametrize(
    ("ogden", "same"),
    [
        (Ogden((OgdenTerm(3.0, 2.0),)), NeoHookean(3.0)),
        (Ogden((OgdenTerm(2.4, 2.0), OgdenTerm(0.6, -2.0))), MooneyRivlin(1.2, 0.3)),
        # the sum of fourth powers is I1^2 - 2 I2, and of their inverses I2^2 - 2 I1
        (Ogden((OgdenTerm(8.0, 4.0),)), MooneyRivlin(6.0, -2.0, c20=1.0)),
        (Ogden((OgdenTerm(8.0, -4.0),)), MooneyRivlin(-2.0, 6.0, c02=1.0)),
    ],
    ids=["2", "2 and -2", "4", "-4"],
)
@pytest.mark.parametrize("gap", [0.3, 1e-3, 1e-6, 1e-8, 1e-10, 1e-13, 1e-15, 0.0])
def test_ogden_with_even_exponents_is_a_polynomial_however_near_the_stretches_are(
    ogden: Ogden, same: Energy, gap: float
) -> None:
    left, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    right, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    sign = np.linalg.det(left @ right)
    for principal in ((1.4, 1.4 * (1 + gap), 0.6), (1.1, 1.1 * (1 + gap), 1.1 * (1 - gap))):
        f = sign * left @ np.diag(principal) @ right
        assert ogden.energy(f) == pytest.approx(same.energy(f), rel=1e-12, abs=1e-14)
        assert ogden.first_piola(f) == pytest.approx(same.first_piola(f), abs=1e-12)
        assert ogden.tangent(f) == pytest.approx(same.tangent(f), abs=1e-12)


def test_the_two_conventions_of_ogden_differ_by_half_the_exponent() -> None:
    f = random_deformations(5)
    classic = Ogden.classic([(0.63, 1.3), (-0.01, -2.0)])
    stretches = np.linalg.svd(np.moveaxis(f, -1, 0), compute_uv=False)
    isochoric = stretches / stretches.prod(axis=1, keepdims=True) ** (1 / 3)
    by_hand = sum(
        mu / alpha * ((isochoric**alpha).sum(axis=1) - 3)
        for mu, alpha in ((0.63, 1.3), (-0.01, -2))
    )
    assert classic.energy(f) == pytest.approx(by_hand, rel=1e-12)


def test_arruda_boyce_is_the_integral_of_the_inverse_langevin_function() -> None:
    """dW/dI1 = mu / 6 x (inverse Langevin of x) / x', x = sqrt(I1/3) / lock; eq. (20), (23)."""
    mu, lock = 2.0, 4.0
    energy = ArrudaBoyce(mu, lock)
    stretch = 1.8
    f = np.diag((stretch, stretch**-0.5, stretch**-0.5))
    chain = np.sqrt((stretch**2 + 2 / stretch) / 3)
    beta = _inverse_langevin(chain / lock)
    slope = mu * lock * beta / (6 * chain)
    expected = 2 * slope * (stretch - stretch**-2)
    stress = energy.first_piola(f)
    nominal = stress[0, 0] - stress[2, 2] * f[2, 2] / f[0, 0]
    assert nominal == pytest.approx(expected, rel=1e-3)  # what the sixth term would add


def test_arruda_boyce_that_never_locks_is_neo_hookean() -> None:
    f = random_deformations(20)
    assert ArrudaBoyce(2.0, 1e7).tangent(f) == pytest.approx(NeoHookean(2.0).tangent(f), rel=1e-9)


@each(ALL)
def test_any_shape_of_points_gives_the_same_as_point_by_point(energy: Energy) -> None:
    f = random_deformations(BLOCK + 26).reshape(3, 3, 2, -1)
    for work, rank in ((energy.energy, 0), (energy.first_piola, 2), (energy.tangent, 4)):
        whole = work(f)
        assert whole.shape == (3,) * rank + f.shape[2:]
        for point in ((0, 0), (1, 511), (1, 524)):
            alone = work(f[(..., *point)])
            assert alone == pytest.approx(whole[(..., *point)], rel=1e-12, abs=1e-7)


@each(ISOCHORIC)
def test_an_inverted_point_is_infinite_and_leaves_the_others_alone(energy: Energy) -> None:
    sound = random_deformations(4)
    f = sound.copy()
    f[..., 1] = np.diag((-0.5, 1.0, 1.0))
    f[..., 2] = np.diag((0.0, 1.0, 1.0))
    assert np.isposinf(energy.energy(f)[[1, 2]]).all()
    assert np.isnan(energy.first_piola(f)[..., 1]).all()
    assert np.isnan(energy.tangent(f)[..., 1]).any()
    assert not np.isfinite(energy.first_piola(f)[..., 2]).all()
    for work in (energy.energy, energy.first_piola, energy.tangent):
        others = work(f)[..., [0, 3]]
        assert others == pytest.approx(work(sound)[..., [0, 3]], rel=1e-12, abs=1e-7)


def test_a_stiff_volume_does_not_touch_the_distortion() -> None:
    f = random_deformations(10)
    f /= np.linalg.det(np.moveaxis(f, -1, 0)) ** (1 / 3)
    assert neo_hookean_from(450e3, 0.4999).first_piola(f) == pytest.approx(
        neo_hookean_from(450e3, 0.4999).distortion.first_piola(f), abs=1e-3
    )


@pytest.mark.parametrize(("young", "poisson"), [(-1.0, 0.3), (1.0, 0.5), (1.0, -1.0), (0.0, 0.3)])
def test_constants_of_no_solid_are_refused(young: float, poisson: float) -> None:
    for refuse in (neo_hookean_from, SaintVenantKirchhoff, LinearElastic, bulk_modulus_from):
        with pytest.raises(MechanicsError, match="no elastic solid"):
            refuse(young, poisson)


@pytest.mark.parametrize("terms", [(), (OgdenTerm(1.0, 0.0),)])
def test_ogden_without_an_exponent_is_refused(terms: tuple[OgdenTerm, ...]) -> None:
    with pytest.raises(MechanicsError, match="at least one term"):
        Ogden(terms)


def _inverse_langevin(y: float) -> float:
    return float(brentq(lambda b: 1 / np.tanh(b) - 1 / b - y, 1e-6, 1e3, xtol=1e-13))
