"""Model against experiment: closed forms, Monte Carlo, and properties."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from rig.validate.errors import ValidateError
from rig.validate.metrics import (
    ComparisonErrors,
    bias,
    en_number,
    hysteresis,
    maximum_error,
    normalised,
    repeatability,
    rmse,
    same_variance,
    validation_statement,
)
from rig.validate.uncertainty import Estimate

LEVELS = 11
FINITE = st.floats(-1e3, 1e3)


def errors_of(error: list[float] | np.ndarray, u: float = 0.1, common: float = 0.0):
    values = np.asarray(error, dtype=float)
    return ComparisonErrors(
        error=values,
        u_random=np.full(values.size, u),
        dof=np.full(values.size, 4.0),
        u_common={"calibration": np.full(values.size, common)},
    )


def test_a_constant_error_is_bias_rmse_and_maximum_alike() -> None:
    errors = errors_of([2.0] * LEVELS, u=0.3)
    for estimate in (bias(errors), rmse(errors)):
        assert estimate.value == pytest.approx(2.0)
        assert estimate.u == pytest.approx(0.3 / math.sqrt(LEVELS))
        assert estimate.dof == pytest.approx(4 * LEVELS)
    _, largest = maximum_error(errors)
    assert largest.value == 2.0
    assert largest.u == pytest.approx(0.3)


def test_an_error_of_calibration_does_not_average_out() -> None:
    errors = errors_of([2.0] * LEVELS, u=0.0, common=0.3)
    assert bias(errors).u == pytest.approx(0.3)
    assert rmse(errors).u == pytest.approx(0.3)
    assert rmse(errors).dof == math.inf


def test_rmse_of_known_numbers() -> None:
    assert rmse(errors_of([3.0, -4.0], u=0.0)).value == pytest.approx(math.sqrt(12.5))
    assert bias(errors_of([3.0, -4.0], u=0.0)).value == -0.5
    level, largest = maximum_error(errors_of([3.0, -4.0], u=0.0))
    assert (level, largest.value) == (1, 4.0)


def test_the_uncertainty_of_rmse_agrees_with_monte_carlo() -> None:
    rng = np.random.default_rng(5)
    error = np.linspace(-1.0, 6.0, LEVELS)
    gain = 0.02 * np.arange(LEVELS)
    errors = ComparisonErrors(error, np.full(LEVELS, 0.2), np.full(LEVELS, np.inf), {"gain": gain})
    draws = 40_000
    disturbed = (
        error + rng.normal(0, 0.2, size=(draws, LEVELS)) + rng.normal(size=(draws, 1)) * gain
    )
    simulated = np.sqrt(np.mean(disturbed**2, axis=1))
    assert rmse(errors).u == pytest.approx(simulated.std(ddof=1), rel=0.02)
    assert bias(errors).u == pytest.approx(disturbed.mean(axis=1).std(ddof=1), rel=0.02)


def test_an_rmse_within_its_noise_is_no_more_certain_than_the_noise() -> None:
    rng = np.random.default_rng(6)
    errors = errors_of(rng.normal(0, 0.05, LEVELS), u=0.1)
    estimate = rmse(errors)
    assert estimate.u == pytest.approx(0.1)
    assert rmse(errors_of([0.0] * 3, u=0.0)) == Estimate(0.0, 0.0, 4.0)


def test_normalised_by_the_measured_range() -> None:
    percent = normalised(Estimate(9.0, 0.5, 10), 90.0)
    assert (percent.value, percent.u, percent.dof) == (10.0, pytest.approx(0.5 / 0.9), 10)
    with pytest.raises(ValidateError, match="no range"):
        normalised(Estimate(9.0, 0.5), 0.0)


def test_the_validation_statement_counts_levels_that_differ_beyond_doubt() -> None:
    statement = validation_statement(errors_of([0.0, 0.19, -0.21, 5.0], u=0.1))
    assert (statement.levels, statement.beyond) == (4, 2)
    assert statement.largest_ratio == pytest.approx(25.0)
    assert not statement.agrees
    assert validation_statement(errors_of([0.0, 0.19], u=0.1)).agrees


def test_without_any_uncertainty_only_no_error_agrees() -> None:
    assert validation_statement(errors_of([0.0, 0.0], u=0.0)).agrees
    assert validation_statement(errors_of([0.0, 1e-9], u=0.0)).beyond == 1


@pytest.mark.parametrize(
    "bad",
    [
        {"error": np.empty(0), "u_random": np.empty(0), "dof": np.empty(0)},
        {"error": np.ones(2), "u_random": np.ones(3), "dof": np.ones(2)},
        {"error": np.array([1.0, np.nan]), "u_random": np.ones(2), "dof": np.ones(2)},
    ],
)
def test_errors_that_cannot_be_compared_are_refused(bad: dict[str, np.ndarray]) -> None:
    with pytest.raises(ValidateError):
        ComparisonErrors(**bad)


@given(arrays(float, st.integers(1, 30), elements=FINITE))
def test_bias_rmse_and_maximum_are_ordered(error: np.ndarray) -> None:
    errors = errors_of(error)
    slack = 1e-9 * (1 + np.abs(error).max())
    assert abs(bias(errors).value) <= rmse(errors).value + slack
    assert rmse(errors).value <= maximum_error(errors)[1].value + slack


@given(arrays(float, st.integers(1, 30), elements=FINITE), st.floats(0, 10), st.floats(0, 10))
@example(np.array([1.0]), 0.0, 6.7e-280)  # its square is zero
def test_rmse_is_never_more_uncertain_than_its_worst_level(
    error: np.ndarray, u: float, common: float
) -> None:
    errors = errors_of(error, u, common)
    assert rmse(errors).u <= errors.u_validation.max() * (1 + 1e-9)


def test_results_agree_when_they_differ_by_less_than_their_joint_uncertainty() -> None:
    first, second = Estimate(10.0, 0.3), Estimate(11.0, 0.4)
    assert en_number(first, second) == pytest.approx(1.0 / (1.959964 * 0.5), rel=1e-6)
    assert en_number(second, first) == -en_number(first, second)
    assert en_number(Estimate(1.0, 0.0), Estimate(1.0, 0.0)) == 0.0
    assert en_number(Estimate(1.0, 0.0), Estimate(0.5, 0.0)) == -math.inf


def test_repeatability_pools_levels_by_their_degrees_of_freedom() -> None:
    result = repeatability([np.array([1.0, 3.0]), np.array([0.0, 1.0, 2.0]), np.array([7.0])])
    assert result is not None
    assert result.dof == 3
    assert result.sd == pytest.approx(math.sqrt((2.0 + 2.0) / 3))
    assert result.limit == pytest.approx(2.8 * result.sd)
    low, high = stats.chi2.ppf([0.975, 0.025], 3)
    assert result.low == pytest.approx(math.sqrt(4.0 / low))
    assert result.high == pytest.approx(math.sqrt(4.0 / high))


def test_single_results_have_no_repeatability() -> None:
    assert repeatability([np.array([1.0]), np.array([2.0])]) is None
    assert repeatability([]) is None


def test_repeatability_recovers_the_scatter_of_the_repeats() -> None:
    rng = np.random.default_rng(8)
    result = repeatability([rng.normal(10 * i, 0.4, 5) for i in range(200)])
    assert result is not None
    assert result.low < 0.4 < result.high
    assert result.sd == pytest.approx(0.4, rel=0.05)


def test_hysteresis_is_the_widest_gap_between_the_branches() -> None:
    up = np.array([0.0, 10.0, 20.0, 40.0])
    down = np.array([1.0, 13.0, 22.0, np.nan])
    result = hysteresis(up, down)
    assert result is not None
    assert (result.level, result.difference) == (1, 3.0)
    assert result.percent_of_span == pytest.approx(7.5)


def test_hysteresis_needs_both_branches() -> None:
    assert hysteresis(np.arange(3.0), np.full(3, np.nan)) is None
    assert hysteresis(np.zeros(3), np.ones(3)) is None


def test_one_group_that_scatters_more_is_found_by_cochrans_test() -> None:
    # ISO 5725-2, Table 4: critical value at 5 % for 6 groups of 3 is 0.616
    def groups(largest: float) -> list[np.ndarray]:
        others = (1 - largest) / 5
        return [np.sqrt(v) * np.array([-1.0, 0.0, 1.0]) for v in [largest, *[others] * 5]]

    assert same_variance(groups(0.610))
    assert not same_variance(groups(0.622))


def test_groups_without_scatter_or_alone_agree() -> None:
    assert same_variance([np.zeros(3), np.zeros(3)])
    assert same_variance([np.array([1.0, 2.0])])
    assert same_variance([np.array([1.0]), np.array([2.0])])


def test_what_the_models_inputs_leave_open_counts_for_validation_alone() -> None:
    plain = errors_of([1.0] * LEVELS, u=0.1)
    open_ = replace(plain, u_input={"modulus": np.full(LEVELS, 0.8)})
    assert rmse(open_) == rmse(plain)
    assert bias(open_) == bias(plain)
    assert open_.u_validation == pytest.approx(np.hypot(0.1, 0.8))
    assert not validation_statement(plain).agrees
    assert validation_statement(open_).agrees
