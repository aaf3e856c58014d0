"""Step metrics against closed forms of first- and second-order systems."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.control.errors import ControlError
from rig.control.step import step_metrics

TIME = np.arange(0, 20, 0.001)


def first_order(start: float, target: float, time_constant: float) -> np.ndarray:
    return target + (start - target) * np.exp(-TIME / time_constant)


def second_order(target: float, damping: float, frequency: float) -> np.ndarray:
    root = math.sqrt(1 - damping**2)
    damped = frequency * root
    decay = np.exp(-damping * frequency * TIME)
    return target * (1 - decay * (np.cos(damped * TIME) + damping / root * np.sin(damped * TIME)))


@pytest.mark.parametrize(("start", "target"), [(0.0, 5.0), (5.0, 0.0), (2.0, 3.0)])
def test_a_first_order_lag_settles_after_its_logarithm(start: float, target: float) -> None:
    metrics = step_metrics(TIME, first_order(start, target, 0.8), target, 0.05, 15.0)
    assert metrics.settling_time_s == pytest.approx(
        0.8 * math.log(abs(target - start) / 0.05), abs=1e-5
    )
    assert metrics.rise_time_s == pytest.approx(0.8 * math.log(9), abs=1e-5)
    assert metrics.overshoot == pytest.approx(0.0, abs=1e-9)
    assert metrics.steady_error == pytest.approx(0.0, abs=1e-6)
    assert metrics.initial == start


@pytest.mark.parametrize("damping", [0.2, 0.4, 0.7])
def test_a_second_order_system_overshoots_by_its_damping(damping: float) -> None:
    metrics = step_metrics(TIME, second_order(4.0, damping, 5.0), 4.0, 0.05, 18.0)
    share = math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
    assert metrics.overshoot_percent == pytest.approx(100 * share, rel=1e-4)
    assert metrics.overshoot == pytest.approx(4 * share, rel=1e-4)


def test_overshoot_of_a_downward_step_is_below_the_target() -> None:
    metrics = step_metrics(TIME, 6.0 - second_order(4.0, 0.3, 5.0), 2.0, 0.05, 18.0)
    upward = step_metrics(TIME, second_order(4.0, 0.3, 5.0), 4.0, 0.05, 18.0)
    assert metrics.overshoot == pytest.approx(upward.overshoot, rel=1e-9)
    assert metrics.settling_time_s == pytest.approx(upward.settling_time_s)


def test_noise_and_steady_error_are_those_of_the_steady_part() -> None:
    rng = np.random.default_rng(2)
    trace = first_order(0.0, 5.0, 0.3) + 0.02 + rng.normal(0, 0.01, TIME.size)
    metrics = step_metrics(TIME, trace, 5.0, 0.1, 10.0)
    assert metrics.noise == pytest.approx(0.01, rel=0.05)
    assert metrics.steady_error == pytest.approx(0.02, abs=0.001)


def test_a_trace_that_leaves_the_band_at_its_end_has_not_settled() -> None:
    metrics = step_metrics(TIME, first_order(0, 5, 20.0), 5.0, 0.05, 19.0)
    assert metrics.settling_time_s is None
    assert metrics.rise_time_s is None


def test_a_step_within_the_tolerance_is_settled_from_the_start() -> None:
    metrics = step_metrics(TIME, np.full(TIME.size, 5.01), 5.0, 0.05, 10.0)
    assert metrics.settling_time_s == 0.0
    assert metrics.rise_time_s is None
    assert metrics.overshoot_percent is None


@pytest.mark.parametrize(
    ("time_s", "steady_from_s"),
    [([0.0], 0.0), ([0.0, 0.0, 1.0], 0.0), ([0.0, 1.0, 2.0], 1.5), ([], 0.0)],
)
def test_traces_that_say_nothing_are_refused(time_s: list[float], steady_from_s: float) -> None:
    times = np.array(time_s)
    with pytest.raises(ControlError):
        step_metrics(times, np.zeros(times.size), 1.0, 0.05, steady_from_s)


@given(
    start=st.floats(-40, 40),
    target=st.floats(-40, 40),
    shift=st.floats(-100, 100),
    time_constant=st.floats(0.05, 1.0),
)
def test_metrics_do_not_depend_on_where_zero_is(
    start: float, target: float, shift: float, time_constant: float
) -> None:
    trace = first_order(start, target, time_constant)
    here = step_metrics(TIME, trace, target, 0.05, 15.0)
    there = step_metrics(TIME, trace + shift, target + shift, 0.05, 15.0)
    assert there.overshoot == pytest.approx(here.overshoot, abs=1e-6)
    assert there.noise == pytest.approx(here.noise, abs=1e-6)
    if here.settling_time_s:
        assert there.settling_time_s == pytest.approx(here.settling_time_s, abs=2e-3)
