"""Whether 95 % intervals hold the truth in 95 of 100 measurements, no less and no more."""

from __future__ import annotations

import pytest

from .coverage import angle_coverage, force_coverage, pressure_coverage

FEW = range(30)
MANY = range(1000)
LOWEST, HIGHEST = 0.93, 0.97
TIGHT, WIDE = 0.30, 0.75
"""Of the r.m.s. error over U: an interval that holds everything because it is vast is no use."""
LEAST_MEASURED = 0.93
"""Of the pictures: leaving out those that are hard would flatter the interval."""


def test_the_interval_of_a_pressure_holds_the_truth_as_often_as_it_says() -> None:
    found = pressure_coverage(FEW)
    assert found.plausible, found
    assert TIGHT < found.rms_ratio < WIDE, found


def test_the_interval_of_a_force_holds_the_truth_as_often_as_it_says() -> None:
    found = force_coverage(FEW)
    assert found.plausible, found
    assert TIGHT < found.rms_ratio < WIDE, found


@pytest.mark.slow
def test_of_a_thousand_pressures_93_to_97_percent_are_within_their_interval() -> None:
    found = pressure_coverage(MANY)
    print(f"\npressure: {found}")
    assert LOWEST <= found.share <= HIGHEST, found


@pytest.mark.slow
def test_of_a_thousand_forces_93_to_97_percent_are_within_their_interval() -> None:
    found = force_coverage(MANY)
    print(f"\nforce: {found}")
    assert LOWEST <= found.share <= HIGHEST, found


@pytest.mark.slow
def test_the_interval_of_an_angle_holds_the_truth_as_often_as_it_says() -> None:
    seeds = range(150)
    found = angle_coverage(seeds)
    print(f"\nangle: {found}")
    assert len(found.errors) >= LEAST_MEASURED * len(seeds)
    assert found.plausible, found
