"""Drucker stability: sound energies pass, unsound ones are told where they fail."""

from __future__ import annotations

import numpy as np
import pytest
from hyperelastic_cases import ISOCHORIC
from scipy.optimize import brentq

from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic import (
    Energy,
    Mode,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    OgdenTerm,
    Yeoh,
    check_stability,
    neo_hookean_from,
)


@pytest.mark.parametrize(
    "energy",
    [
        NeoHookean(150e3),
        MooneyRivlin(60e3, 15e3),
        Yeoh(70e3, 3e3, 400.0),
        Ogden((OgdenTerm(99e3, 1.3), OgdenTerm(3e3, 5.0), OgdenTerm(12e3, -2.0))),
        ISOCHORIC["Arruda-Boyce"],
        neo_hookean_from(450e3, 0.49),
    ],
    ids=lambda energy: type(energy).__name__,
)
def test_sound_energies_are_stable_everywhere(energy: Energy) -> None:
    found = check_stability(energy)
    assert found.stable
    assert found.warning is None


def test_a_negative_c01_is_unstable_where_its_convexity_ends() -> None:
    """Uniaxial tension: the Hessian in log strains of c10 I1 + c01 I2 loses its determinant."""
    c10, c01 = 1.0, -0.2

    def determinant(x: float) -> float:
        one, three = x**2, 1 / x  # squares of the axial and of both transverse stretches
        h11 = 4 * (c10 * (one + three) + c01 * (1 / one + 1 / three))
        h22 = 4 * (c10 * (three + three) + c01 * (1 / three + 1 / three))
        h12 = 4 * (c10 * three + c01 / three)
        return h11 * h22 - h12**2

    found = {r.mode: r for r in check_stability(MooneyRivlin(c10, c01)).ranges}
    expected = brentq(determinant, 1.1, 4)
    assert found[Mode.UNIAXIAL].high == pytest.approx(expected, rel=1e-6)
    # volume-preserving: biaxial compression to x is uniaxial tension to x^-2
    assert found[Mode.EQUIBIAXIAL].low == pytest.approx(expected**-0.5, rel=1e-6)
    planar = found[Mode.PLANAR]
    assert planar.low is not None
    assert planar.high == pytest.approx(1 / planar.low, rel=1e-6)  # axes change places


def test_the_warning_names_mode_and_stretch() -> None:
    warning = check_stability(MooneyRivlin(1.0, -0.2)).warning
    assert warning is not None
    assert "MooneyRivlin(c10=1.0, c01=-0.2" in warning
    for words in (
        "uniaxial tension above a stretch of 2.236",
        "equibiaxial tension above a stretch of 1.64",
        "planar tension above a stretch of 2.122",
        "uniaxial compression below a stretch of 0.372",
    ):
        assert words in warning
    assert "\n" not in warning


def test_stress_turns_over_beyond_the_limit_and_not_before() -> None:
    """True stress along the free path may only fall where the check says unstable."""
    energy = Yeoh(1.0, -0.1, 0.0)
    (uniaxial,) = (r for r in check_stability(energy).ranges if r.mode is Mode.UNIAXIAL)
    assert uniaxial.high is not None

    def true_stress_slope(x: float, h: float = 1e-5) -> float:
        def stress(s: float) -> float:
            i1 = s * s + 2 / s
            return 2 * (s**2 - 1 / s) * (1.0 - 0.2 * (i1 - 3))

        return (stress(x + h) - stress(x - h)) / (2 * h)

    turning = brentq(true_stress_slope, 1.05, 3)
    assert uniaxial.high == pytest.approx(turning, rel=1e-6)


def test_an_energy_that_softens_from_the_start_is_told_so() -> None:
    found = check_stability(NeoHookean(-1.0))
    assert not found.stable
    assert found.warning is not None
    assert "uniaxial loading already at rest" in found.warning


def test_only_the_asked_range_is_checked() -> None:
    energy = MooneyRivlin(1.0, -0.2)
    assert check_stability(energy, 0.8, 1.3).stable
    assert not check_stability(energy, 0.8, 1.8).stable


@pytest.mark.parametrize(("low", "high"), [(1.0, 2.0), (0.5, 1.0), (0.0, 2.0), (0.5, np.inf)])
def test_a_range_without_rest_inside_is_refused(low: float, high: float) -> None:
    with pytest.raises(MechanicsError, match="0 < lowest < 1 < highest"):
        check_stability(NeoHookean(1.0), low, high)
