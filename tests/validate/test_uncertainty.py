"""Worked examples of the GUM (JCGM 100:2008) and properties that hold for any numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from rig.validate.errors import ValidateError
from rig.validate.uncertainty import (
    Component,
    Estimate,
    combine,
    coverage_factor,
    effective_dof,
    mean_of_repeats,
)

# GUM Table 1: twenty observations of a temperature in degrees Celsius; 4.4.3 gives the results.
GUM_TEMPERATURES = [
    96.90, 98.18, 98.25, 98.61, 99.03, 99.49, 99.56, 99.74, 99.89, 100.07,
    100.33, 100.42, 100.68, 100.95, 101.11, 101.20, 101.57, 101.84, 102.36, 102.72,
]  # fmt: skip
# GUM H.1, end gauge, nanometres and degrees of freedom.
END_GAUGE = [
    Component("standard", 25.0, 18),
    Component("difference", 9.7, 25.6),
    Component("expansion coefficient", 2.9, 50),
    Component("temperature difference", 16.6, 2),
]


def test_the_mean_of_the_gums_temperatures() -> None:
    mean = mean_of_repeats(GUM_TEMPERATURES)
    assert mean.value == pytest.approx(100.145, abs=5e-4)
    assert mean.u == pytest.approx(0.333, abs=5e-4)
    assert mean.dof == 19


def test_the_gums_end_gauge_has_a_combined_uncertainty_of_32_nm() -> None:
    result = combine(50_000_838.0, END_GAUGE)
    assert round(result.u) == 32
    # with the combined uncertainty rounded to 32 nm, by hand: 32^4 / 60014 = 17.47
    assert effective_dof(END_GAUGE) * (32 / result.u) ** 4 == pytest.approx(17.47, abs=0.005)
    # the 99 % interval of the example is 93 nm
    assert round(coverage_factor(17, 0.99) * 32) == 93


@pytest.mark.parametrize("dof", [1, 2, 4, 10.5, 100, math.inf])
def test_coverage_factors_are_those_of_student(dof: float) -> None:
    assert coverage_factor(dof) == pytest.approx(stats.t.ppf(0.975, dof), rel=1e-9)


def test_exactly_known_components_expand_by_the_normal_distribution() -> None:
    estimate = combine(1.0, [Component("a", 3.0), Component("b", 4.0)])
    assert estimate.u == 5.0
    assert estimate.dof == math.inf
    assert estimate.u95 == pytest.approx(1.959964 * 5, rel=1e-6)


def test_one_repeat_says_nothing_about_its_spread() -> None:
    with pytest.raises(ValidateError, match="at least two repeats"):
        mean_of_repeats([1.0])


def test_no_uncertainty_at_all_stays_none() -> None:
    assert combine(2.0, []) == Estimate(2.0, 0.0, math.inf)
    assert combine(2.0, [Component("a", 0.0, 3)]).u95 == 0.0


def test_the_95_percent_interval_covers_the_truth_in_95_of_100_cases() -> None:
    rng = np.random.default_rng(11)
    covered = 0
    for _ in range(4000):
        mean = mean_of_repeats(rng.normal(3.0, 0.7, size=5))
        covered += abs(mean.value - 3.0) <= mean.u95
    assert covered / 4000 == pytest.approx(0.95, abs=0.01)


@given(st.lists(st.tuples(st.floats(1e-6, 1e6), st.floats(1, 1e4)), min_size=1, max_size=6))
def test_effective_degrees_of_freedom_lie_between_the_least_and_the_sum(
    parts: list[tuple[float, float]],
) -> None:
    components = [Component("c", u, dof) for u, dof in parts]
    effective = effective_dof(components)
    assert effective >= min(dof for _, dof in parts) * (1 - 1e-9)
    assert effective <= sum(dof for _, dof in parts) * (1 + 1e-9)
