"""Creep laws, softening and peaks on data whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from rig.validate.time_response import cycle_extremes, fit_creep, highest_peak, softening


def test_a_prony_term_is_found_again() -> None:
    time_s = np.geomspace(0.5, 300, 15)
    noise = 0.01 * np.random.default_rng(1).normal(size=15)
    fit = fit_creep(time_s, 80 - 3 * np.exp(-time_s / 12) + noise)
    assert fit is not None
    assert fit.law == "prony"
    for name, true in (("final", 80), ("change", 3), ("time", 12)):
        value, u = fit.parameters[name]
        assert abs(value - true) < 4 * u < 0.1 * true


def test_a_power_law_is_told_from_a_prony_term() -> None:
    time_s = np.geomspace(0.5, 3000, 20)
    fit = fit_creep(time_s, 70 + 2 * time_s**0.15)
    assert fit is not None
    assert fit.law == "power"
    assert fit.parameters["exponent"][0] == pytest.approx(0.15, rel=1e-3)
    assert fit.rms < 1e-4


def test_too_few_looks_give_no_law() -> None:
    assert fit_creep(np.arange(1.0, 6.0), np.arange(5.0)) is None


def test_softening_is_the_slope_over_a_decade() -> None:
    cycles = np.array([1.0, 10.0, 100.0, 1000.0])
    trend = softening(cycles, 50 - 1.5 * np.log10(cycles))
    assert trend is not None
    assert trend.per_decade == pytest.approx(-1.5)
    assert trend.u < 1e-6
    assert softening(cycles[:2], cycles[:2]) is None


def test_extremes_of_each_cycle() -> None:
    time_s = np.linspace(0, 4, 400, endpoint=False)
    value = np.sin(2 * np.pi * time_s) * (1 + np.floor(time_s))
    high, low = cycle_extremes(time_s, value, np.arange(6.0))
    np.testing.assert_allclose(high[:4], [1, 2, 3, 4], rtol=1e-3)
    np.testing.assert_allclose(low[:4], [-1, -2, -3, -4], rtol=1e-3)
    assert np.isnan(high[4])


def test_the_peak_of_a_pull_stands_out_from_noise() -> None:
    time_s = np.arange(0, 20, 0.1)
    force = np.interp(time_s, [0, 5, 12, 12.5, 20], [20, 20, 800, 60, 60])
    force += np.random.default_rng(2).normal(size=force.size)
    peak = highest_peak(time_s, force, 50.0)
    assert peak is not None
    assert peak.value == pytest.approx(800, abs=4)
    assert peak.time_s == pytest.approx(12, abs=0.11)
    assert highest_peak(time_s, np.full_like(time_s, 20.0), 5.0) is None
