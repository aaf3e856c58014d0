"""The pressure loop: alone, and closed over the gas of the test bench."""

from __future__ import annotations

import numpy as np
import pytest
from board_under_test import Board
from rig.board._firmware import ffi, lib

TICK_S = 2e-3
KP, KI = 2.0, 4.0
DEADBAND_KPA = 0.01
MAX_FLOW = 5.0
# defaults of the firmware
SYSTEM_ML, AMBIENT_KPA, SETPOINT_RATE = 70.0, 101.325, 2.0
MAX_ACCELERATION = 40.0
RAMP_SHARE = 0.8
"""Of the drive's flow and acceleration, which the set-point may ask for."""


class Loop:
    """The controller alone."""

    def __init__(self, *, kp: float = KP, ki: float = KI, feed_forward: float = 0.0) -> None:
        self._loop = ffi.gc(
            lib.rig_test_loop_new(kp, ki, feed_forward, DEADBAND_KPA, MAX_FLOW),
            lib.rig_test_loop_free,
        )

    def target(self, start: float, target: float) -> Loop:
        lib.rig_test_loop_target(self._loop, start, target)
        return self

    def retarget(self, target: float) -> None:
        lib.rig_test_loop_retarget(self._loop, target)

    def tick(self, measured: float, plunger: float = 0.0, blocked: int = 0) -> float:
        return float(lib.rig_test_loop_tick(self._loop, measured, plunger, blocked))

    @property
    def integral(self) -> float:
        return float(lib.rig_test_loop_integral_ml_s(self._loop))

    @property
    def setpoint(self) -> float:
        return float(lib.rig_test_loop_setpoint_kpa(self._loop))

    @property
    def saturated(self) -> bool:
        return bool(lib.rig_test_loop_saturated(self._loop))


def test_at_rest_the_flow_is_proportional_to_the_error_outside_the_deadband() -> None:
    loop = Loop(ki=0.0).target(5.0, 5.0)
    assert loop.tick(5.0 - 0.1) == pytest.approx(KP * (0.1 - DEADBAND_KPA), rel=1e-4)
    assert loop.tick(5.0 + 0.1) == pytest.approx(-KP * (0.1 - DEADBAND_KPA), rel=1e-4)


def test_inside_the_deadband_nothing_moves_and_nothing_is_learnt() -> None:
    loop = Loop().target(5.0, 5.0)
    for _ in range(1000):
        assert loop.tick(5.0 - 0.9 * DEADBAND_KPA) == 0.0
    assert loop.integral == 0.0


def test_a_lasting_error_is_integrated() -> None:
    loop = Loop().target(5.0, 5.0)
    for _ in range(100):
        loop.tick(4.9)
    assert loop.integral == pytest.approx(KI * (0.1 - DEADBAND_KPA) * 100 * TICK_S, rel=1e-3)


def kpa_per_ml(setpoint: float, plunger: float = 0.0) -> float:
    """Boyle's stiffness of the gas in front of the plunger."""
    return (AMBIENT_KPA + setpoint) / (SYSTEM_ML - plunger)


def ramp(loop: Loop, target: float, plunger: float = 0.0) -> np.ndarray:
    """Set-points of every tick until the target is reached, in the firmware's single precision."""
    values = [loop.setpoint]
    while loop.setpoint != np.float32(target):
        loop.tick(target, plunger)
        values.append(loop.setpoint)
        assert len(values) < 10_000
    return np.array(values)


def test_the_setpoint_moves_at_its_rate_and_stops_at_the_target() -> None:
    values = ramp(Loop().target(1.0, 6.0), 6.0)
    rates = np.diff(values) / TICK_S
    assert rates.max() == pytest.approx(SETPOINT_RATE, rel=1e-3)
    assert np.mean(np.abs(rates - SETPOINT_RATE) < 0.01) > 0.9
    assert values.max() == 6.0


@pytest.mark.parametrize(("start", "target"), [(1.0, 6.0), (6.0, 1.0), (2.0, 2.02)])
def test_the_setpoint_asks_no_more_acceleration_than_the_plunger_has(
    start: float, target: float
) -> None:
    rates = np.diff(ramp(Loop().target(start, target), target)) / TICK_S
    flows = rates / kpa_per_ml((start + target) / 2)
    changes = np.abs(np.diff([0.0, *flows, 0.0])) / TICK_S
    assert changes.max() < MAX_ACCELERATION
    assert np.percentile(changes, 95) < 1.05 * RAMP_SHARE * MAX_ACCELERATION
    # and not much less: it takes the time that a trapezoid of speed takes
    swept, top = abs(target - start), SETPOINT_RATE
    acceleration = RAMP_SHARE * MAX_ACCELERATION * kpa_per_ml(start)
    if swept > top**2 / acceleration:
        expected = swept / top + top / acceleration
    else:
        expected = 2 * (swept / acceleration) ** 0.5
    assert rates.size * TICK_S == pytest.approx(expected, abs=0.015)


@pytest.mark.parametrize(("feed_forward", "growth"), [(0.0, 1.0), (1.0, 1.0), (1.5, 1.5)])
def test_the_setpoint_asks_no_more_flow_than_the_plunger_has(
    feed_forward: float, growth: float
) -> None:
    board = Board()
    board.write(max_flow_ml_s=0.5, setpoint_rate_kpa_s=50.0, feed_forward=feed_forward)
    board.ready()
    board.command("set_pressure", 5.0)
    board.run(4000)
    *_, before, now = board.all("PRESSURE")[::50]
    stiffness = kpa_per_ml(now["setpoint_kpa"], now["plunger_ml"])
    rate = now["setpoint_kpa"] - before["setpoint_kpa"]  # in a second
    assert rate == pytest.approx(RAMP_SHARE * 0.5 * stiffness / growth, rel=0.01)


def test_a_target_moved_nearer_is_not_passed() -> None:
    loop = Loop().target(0.0, 8.0)
    for _ in range(500):
        loop.tick(loop.setpoint)
    here = loop.setpoint
    loop.retarget(here + 1e-3)
    for _ in range(500):
        loop.tick(loop.setpoint)
        assert loop.setpoint <= here + 1e-3 + 1e-6
    loop.retarget(here - 1.0)
    values = ramp(loop, here - 1.0)
    assert np.all(np.diff(values) <= 1e-6)


def test_the_feed_forward_is_the_isothermal_flow_demand_of_the_gas() -> None:
    loop = Loop(kp=0.01, ki=0.0, feed_forward=1.0).target(5.0, 6.0)
    plunger = 4.0
    for _ in range(100):  # beyond its acceleration
        before = loop.setpoint
        flow = loop.tick(loop.setpoint, plunger)
    rate = (loop.setpoint - before) / TICK_S
    assert rate == pytest.approx(SETPOINT_RATE, rel=1e-3)
    expected = (SYSTEM_ML - plunger) / (AMBIENT_KPA + loop.setpoint) * rate
    assert flow == pytest.approx(expected, rel=1e-3)
    while loop.setpoint < 6.0:
        loop.tick(6.0, plunger)
    assert loop.tick(6.0, plunger) == 0.0  # at rest the gas demands nothing


def test_nothing_is_learnt_while_the_setpoint_moves() -> None:
    loop = Loop().target(0.0, 10.0)
    for _ in range(1000):
        loop.tick(0.0)
    assert loop.integral == 0.0


def test_a_saturated_loop_does_not_wind_up() -> None:
    loop = Loop().target(5.0, 5.0)
    for _ in range(5000):  # ten seconds, far below: KI alone would reach its bound in half of one
        assert loop.tick(0.0) == MAX_FLOW
        assert loop.saturated
    assert loop.integral == 0.0
    # as soon as the error turns, so does the plunger
    assert loop.tick(5.1) < 0.0


def test_a_plunger_at_the_end_of_its_travel_does_not_wind_the_loop_up() -> None:
    loop = Loop().target(5.0, 5.0)
    for _ in range(5000):
        loop.tick(4.9, blocked=1)
    assert loop.integral == 0.0
    assert loop.saturated
    # but away from the end it may go
    for _ in range(10):
        loop.tick(5.1, blocked=1)
    assert loop.integral < 0.0


# --- closed over the bench ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("blocked", "error", "learns"), [(1, 1, 0), (1, -1, 1), (-1, -1, 0), (-1, 1, 1)]
)
def test_a_blocked_plunger_lets_the_loop_learn_only_what_leads_away(
    blocked: int, error: int, learns: int
) -> None:
    loop = Loop().target(3.0, 3.0)
    loop.tick(3.0 - error, blocked=blocked)
    assert loop.saturated
    assert (loop.integral != 0) == bool(learns)


def test_more_plunger_than_gas_asks_for_no_flow_ahead() -> None:
    fed = Loop(feed_forward=1.0).target(0.0, 5.0)
    assert fed.tick(fed.setpoint + SETPOINT_RATE * TICK_S, plunger=SYSTEM_ML + 5) == 0.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_each_step_of_1_kpa_settles_without_overshoot_and_without_steady_error(seed: int) -> None:
    board = Board(seed).ready()
    for target in range(1, 11):
        assert board.command("set_pressure", float(target)) == "accepted"
        _, _, greatest = board.true_pressure(4000)
        assert greatest - target < 0.05
        mean, least, greatest = board.true_pressure(4000)
        assert abs(mean - target) < 0.01
        assert greatest - least < 0.04
    assert board.fault == "none"


@pytest.mark.parametrize(
    "conditions",
    [
        {"system_ml": 65.0, "compliance_ml_kpa": 0.0},
        {"system_ml": 120.0},
        {"compliance_ml_kpa": 0.6},
        {"heat_exchange_s": 0.05},
        {"heat_exchange_s": 2.0},
        {"tube_lag_s": 0.04},
        {"backlash_ml": 0.05},
        {"leak_ml_s_kpa": 0.005},
        {"noise_lsb": 1.6},
        {"offset_kpa": 1.0},
    ],
    ids=lambda c: "-".join(c),
)
def test_the_loop_holds_on_benches_it_was_not_tuned_for(conditions: dict[str, float]) -> None:
    board = Board(conditions=conditions).ready()
    for target in (1.0, 5.0, 4.0, 10.0):
        board.command("set_pressure", target)
        start = board.bench.pressure_kpa
        _, least, greatest = board.true_pressure(10_000)
        overshoot = greatest - target if target > start else target - least
        assert overshoot < 0.15
        mean, _, _ = board.true_pressure(4000)
        assert abs(mean - target) < 0.02
    assert board.fault == "none"


def test_the_setpoint_is_followed_on_a_long_ramp() -> None:
    board = Board().ready()
    board.command("set_pressure", 10.0)
    board.run(5000)
    ramp = [m for m in board.all("PRESSURE") if 0.5 < m["setpoint_kpa"] < 9.5]
    lag = np.array([m["setpoint_kpa"] - m["pressure_kpa"] for m in ramp])
    assert np.abs(lag).max() < 0.3


def test_a_flow_beyond_the_limit_is_reported_as_saturated() -> None:
    board = Board()
    board.write(max_flow_ml_s=0.5, setpoint_rate_kpa_s=5.0)
    board.ready()
    board.command("set_pressure", 5.0)
    board.run(1500)
    assert board.last("PRESSURE")["saturated"]
    board.run(20_000)
    assert not board.last("PRESSURE")["saturated"]
    assert board.true_pressure(1000)[0] == pytest.approx(5.0, abs=0.02)


def test_regulation_is_quiet_at_rest() -> None:
    board = Board().at(6.0)
    before = board.bench.steps
    board.run(10_000)
    moved_ml = (board.bench.steps - before) * 0.35e-3
    assert abs(moved_ml) < 0.05
    velocities = [m["plunger_velocity_ml_s"] for m in board.all("CONTROLLER")[-90:]]
    assert np.std(velocities) < 0.05


def test_the_measured_pressure_has_thirteen_effective_bits() -> None:
    board = Board()
    board.run(500)
    board.messages.clear()
    board.run(20_000)
    readings = np.array([m["pressure_kpa"] for m in board.all("PRESSURE")])
    full_scale_kpa = 5.0 * 10.0
    assert np.log2(full_scale_kpa / readings.std()) > 13  # effective resolution
