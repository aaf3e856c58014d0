"""The plunger's motion: limits of speed, acceleration and travel hold whatever is asked."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig.board._firmware import ffi, lib

TICK_S = 2e-3
STEP_ML = 0.34994e-3
TIMER_TICKS = 4000  # of a tick
SYRINGE_ML = 60.0


class Plunger:
    """A plunger whose every tick is remembered."""

    def __init__(
        self, max_flow: float = 6.0, acceleration: float = 40.0, syringe_ml: float = SYRINGE_ML
    ) -> None:
        self._plunger = ffi.gc(
            lib.rig_test_plunger_new(max_flow, acceleration, syringe_ml),
            lib.rig_test_plunger_free,
        )
        self.steps: list[int] = []
        self.velocity: list[float] = [0.0]
        self.position: list[float] = [0.0]
        self.schedule: list[tuple[int, int, float]] = []

    def velocity_to(self, flow: float, ticks: int) -> Plunger:
        lib.rig_test_plunger_set_velocity(self._plunger, flow)
        return self.run(ticks)

    def move_to(self, target: float, speed: float, ticks: int) -> Plunger:
        lib.rig_test_plunger_move_to(self._plunger, target, speed)
        return self.run(ticks)

    def run(self, ticks: int) -> Plunger:
        first, interval = ffi.new("uint16_t *"), ffi.new("uint32_t *")
        for _ in range(ticks):
            steps = lib.rig_test_plunger_tick(self._plunger, first, interval)
            self.steps.append(steps)
            self.schedule.append((steps, first[0], interval[0] / 256))
            self.velocity.append(lib.rig_test_plunger_velocity_ml_s(self._plunger))
            self.position.append(lib.rig_test_plunger_position_ml(self._plunger))
        return self

    @property
    def arrived(self) -> bool:
        return bool(lib.rig_test_plunger_arrived(self._plunger))


demands = st.lists(
    st.tuples(
        st.booleans(),
        st.floats(-12, 12) | st.sampled_from([0.0, 6.0, -6.0]),
        st.floats(-5, 70),
        st.integers(1, 400),
    ),
    min_size=1,
    max_size=12,
)


@given(demands, st.floats(0.5, 8), st.floats(5, 200), st.floats(2, 60))
@settings(max_examples=150)
def test_no_demand_exceeds_speed_acceleration_or_travel(
    sequence: list[tuple[bool, float, float, int]],
    max_flow: float,
    acceleration: float,
    syringe_ml: float,
) -> None:
    plunger = Plunger(max_flow, acceleration, syringe_ml)
    for follow, flow, target, ticks in sequence:
        if follow:
            plunger.velocity_to(flow, ticks)
        else:
            plunger.move_to(target, abs(flow), ticks)
    velocity, position = np.array(plunger.velocity), np.array(plunger.position)
    assert np.abs(velocity).max() <= max_flow * (1 + 1e-6)
    assert np.abs(np.diff(velocity)).max() <= acceleration * TICK_S * (1 + 1e-4) + 1e-6
    # a quarter of a tick's braking distance and a step of rounding, 60 mL in single precision
    slack = acceleration * TICK_S**2 / 4 + STEP_ML + 1e-5
    assert position.min() >= -slack
    assert position.max() <= syringe_ml + slack
    # the steps given are the position reported
    assert np.abs(np.cumsum(plunger.steps) * STEP_ML - position[1:]).max() <= 2 * STEP_ML


@given(st.floats(0.001, 60), st.floats(0.1, 6), st.floats(5, 200))
@settings(max_examples=60)
def test_a_move_ends_at_its_target_without_overshoot(
    target: float, speed: float, acceleration: float
) -> None:
    plunger = Plunger(6.0, acceleration)
    needed = target / speed + 2 * speed / acceleration + 0.5
    plunger.move_to(target, speed, int(needed / TICK_S))
    assert plunger.arrived
    assert plunger.position[-1] == pytest.approx(target, abs=1.01 * STEP_ML)
    assert max(plunger.position) <= target + acceleration * TICK_S**2 / 4 + STEP_ML
    assert max(plunger.velocity) <= speed * (1 + 1e-6)


def test_a_long_move_is_a_trapezoid_and_takes_the_time_of_one() -> None:
    plunger = Plunger().move_to(12.0, 6.0, 2000)
    velocity = np.array(plunger.velocity)
    moving_s = (velocity > 1e-3).sum() * TICK_S
    assert moving_s == pytest.approx(12.0 / 6.0 + 6.0 / 40.0, abs=0.02)
    assert (velocity > 5.999).sum() * TICK_S == pytest.approx(12.0 / 6.0 - 6.0 / 40.0, abs=0.02)


@given(demands)
@settings(max_examples=50)
def test_steps_lie_inside_their_tick_and_apart_from_each_other(
    sequence: list[tuple[bool, float, float, int]],
) -> None:
    plunger = Plunger(8.0, 200.0)
    for _, flow, _, ticks in sequence:
        plunger.velocity_to(flow, ticks)
    fastest = TIMER_TICKS / 48  # 24 kHz
    for steps, first, interval in plunger.schedule:
        if steps == 0:
            continue
        count = abs(steps)
        assert first + (count - 1) * interval <= TIMER_TICKS
        if count > 1:
            assert interval >= np.floor(fastest)


def test_steps_at_constant_speed_are_evenly_spaced_across_ticks() -> None:
    plunger = Plunger(6.0, 200.0).velocity_to(1.0, 1000)
    times = []
    for tick, (steps, first, interval) in enumerate(plunger.schedule[200:]):
        times += [tick * TIMER_TICKS + first + k * interval // 1 for k in range(abs(steps))]
    spacing = np.diff(times)
    expected = STEP_ML / 1.0 / TICK_S * TIMER_TICKS
    assert spacing.mean() == pytest.approx(expected, rel=1e-4)
    # the timer's resolution, at either end of an interval
    assert np.abs(spacing - expected).max() <= 2


def test_a_reversal_of_less_than_a_step_gives_no_steps() -> None:
    plunger = Plunger(6.0, 40.0).velocity_to(0.01, 2000)
    before = sum(plunger.steps)
    for _ in range(50):  # noise around standstill
        plunger.velocity_to(0.005, 10).velocity_to(-0.005, 10)
    assert abs(sum(plunger.steps) - before) <= 1
