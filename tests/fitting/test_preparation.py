"""What is done to specimens before a fit, and that it is told of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rig.fitting.errors import FittingError
from rig.fitting.families import families
from rig.fitting.prepare import Preparation, prepare
from rig.fitting.specimen import (
    Specimen,
    averaged,
    secant_modulus,
    thinned,
    until_rupture,
    within,
    without_outlying_points,
    without_outlying_specimens,
)
from rig.mechanics.hyperelastic import Mode

STRETCH = np.linspace(1.0, 3.0, 101)


def specimen(factor: float = 1.0, name: str = "one") -> Specimen:
    stress = factor * 100e3 * (STRETCH - STRETCH**-2)
    return Specimen(name, Mode.UNIAXIAL, STRETCH, stress, "made up")


def test_a_spike_is_left_out_and_told_of_and_noise_is_not() -> None:
    rng = np.random.default_rng(1)
    noisy = specimen().stress + 500 * rng.standard_normal(STRETCH.size)
    assert without_outlying_points(replace(specimen(), stress=noisy)).stretch.size == 101
    noisy[40] += 60e3
    kept = without_outlying_points(replace(specimen(), stress=noisy))
    assert STRETCH[40] not in kept.stretch
    assert kept.stretch.size == 100
    assert "1 of 101 points" in kept.notes[0]


def test_an_odd_specimen_is_left_out_and_three_are_kept() -> None:
    good = [specimen(f, f"s{f}") for f in (0.98, 1.0, 1.01, 1.03)]
    kept, notes = without_outlying_specimens([*good, specimen(1.6, "odd")])
    assert kept == tuple(good)
    assert "odd was left out" in notes[0]
    assert without_outlying_specimens([*good[:2], specimen(1.6)])[1] == ()


def test_what_follows_the_rupture_is_left_out() -> None:
    torn = specimen().stress.copy()
    torn[90:] = 0
    kept = until_rupture(replace(specimen(), stress=torn))
    assert kept.stretch.size == 90
    assert "11 points" in kept.notes[0]


def test_a_region_keeps_its_strains_only() -> None:
    assert within(specimen(), 0.5, 1.0).stretch == pytest.approx(np.linspace(1.5, 2.0, 26))
    with pytest.raises(FittingError, match="choose another region"):
        within(specimen(), 5, 6)
    with pytest.raises(FittingError, match="LOW below HIGH"):
        within(specimen(), 1, 0)


def test_thinning_makes_up_no_points() -> None:
    few = thinned(specimen(), 20)
    assert few.stretch.size == 20
    assert set(few.stretch) <= set(STRETCH)


def test_the_mean_curve_is_that_of_the_mean_modulus() -> None:
    mean = averaged([specimen(0.9), specimen(1.1)], 101)
    assert mean.stress == pytest.approx(specimen().stress, abs=1)


def test_preparation_tells_of_all_that_it_does() -> None:
    torn = specimen().stress.copy()
    torn[90:] = 0
    two = [replace(specimen(), stress=torn), specimen(1.1, "two")]
    prepared = prepare(two, Preparation(region=(0, 1), average=True, points=30))
    assert len(prepared.tested) == 2
    assert len(prepared.fitted) == 1
    assert prepared.fitted[0].longest <= 2
    told = " ".join(prepared.notes)
    assert "rupture" in told
    assert "averaged" in told


def test_equivalent_modulus_is_stress_over_strain() -> None:
    expected = 100e3 * (1.5 - 1.5**-2) / 0.5
    assert secant_modulus(specimen(), 0.5) == pytest.approx(expected, rel=1e-3)
    with pytest.raises(FittingError, match="within its data"):
        secant_modulus(specimen(), 4.0)


def test_a_spike_is_no_rupture() -> None:
    """Above the largest stress of the curve, a quarter of the way along it."""
    x = np.linspace(1.0, 3.0, 60)
    y = 100e3 * (x - x**-2)
    y[15] = 2 * y[-1]
    prepared = prepare(
        [Specimen("spiked", Mode.UNIAXIAL, x, y, "made up")], Preparation(points=1000)
    )
    assert prepared.tested[0].stretch == pytest.approx(np.delete(x, 15))
    assert not any("rupture" in note for note in prepared.notes)


@pytest.mark.parametrize("count", [20, 60, 200])
@pytest.mark.parametrize("mode", list(Mode))
def test_smooth_curves_have_no_outliers(mode: Mode, count: int) -> None:
    """Steep at their beginning, or near their locking stretch."""
    x = np.linspace(1.0, 4.0, count)
    for name, values in (
        ("neo-hookean", {"shear_modulus": 150e3}),
        ("arruda-boyce", {"modulus": 100e3, "locking_stretch": 3.5}),
    ):
        y = families(0.499)[name].stress(values, mode, x)
        smooth = Specimen(name, mode, x, y, "made up")
        assert without_outlying_points(smooth) is smooth
