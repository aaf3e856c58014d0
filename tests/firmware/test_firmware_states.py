"""The state machine: which command does what, what is refused and why, and only once."""

from __future__ import annotations

import pytest
from board_under_test import STATES, Board
from rig.board._firmware import lib


def test_a_new_board_boots_to_idle_with_the_valve_open_and_the_motor_off() -> None:
    board = Board()
    board.run(60)
    board.run(200)
    assert board.state == "idle"
    heartbeat = board.last("HEARTBEAT")
    assert heartbeat["valve_open"]
    assert not heartbeat["motor_enabled"]
    assert not heartbeat["homed"]
    assert not heartbeat["zeroed"]
    assert not heartbeat["tared"]
    assert board.bench.steps == 0


def test_nothing_is_accepted_before_the_sensors_have_settled() -> None:
    board = Board()
    board.run(2)
    assert board.command("home") == "wrong_state"
    assert board.command("set_pressure", 1.0) == "wrong_state"


@pytest.mark.parametrize("start_ml", [0.0, 0.1, 5.0, 55.0])
def test_homing_finds_the_switch_from_anywhere(start_ml: float) -> None:
    board = Board(plunger_ml=start_ml)
    board.run(200)
    assert board.command("home") == "accepted"
    assert board.state == "homing"
    board.until("idle", 60_000)
    board.run(200)
    assert board.last("HEARTBEAT")["homed"]
    assert board.last("PRESSURE")["plunger_ml"] == pytest.approx(0.0, abs=1e-3)
    assert board.bench.plunger_ml == pytest.approx(0.0, abs=2e-3)


def test_homing_is_done_with_the_valve_open() -> None:
    board = Board(plunger_ml=20.0)
    board.run(200)
    board.command("home")
    board.run(3000)
    assert board.state == "homing"
    assert board.bench.valve_open
    assert abs(board.bench.pressure_kpa) < 0.3


def test_pressure_needs_a_known_home() -> None:
    board = Board()
    board.run(200)
    assert board.command("set_pressure", 1.0) == "not_homed"
    assert board.state == "idle"


def test_pressure_needs_a_known_zero() -> None:
    board = Board()
    board.run(200)
    board.command("home")
    board.until("idle", 60_000)
    assert board.command("set_pressure", 1.0) == "not_zeroed"
    assert board.state == "idle"
    board.command("zero_pressure")
    board.run(1100)
    assert board.command("set_pressure", 1.0) == "accepted"


def test_an_offset_beyond_the_limit_lets_nothing_be_regulated() -> None:
    board = Board(conditions={"offset_kpa": 2.5}).ready()
    assert board.command("set_pressure", 1.0) == "not_zeroed"


@pytest.mark.parametrize("name", ["transducer_offset_v", "adc_reference_v"])
def test_another_transducer_needs_another_zero_and_the_same_does_not(name: str) -> None:
    board = Board(conditions={"offset_kpa": 0.8}).ready()
    value = board.parameter("read", name)["parameter_value"]
    board.write(**{name: value})
    assert board.command("set_pressure", 1.0) == "accepted"
    board.command("vent")
    board.until("idle", 6000)
    board.write(**{name: value + 0.01})
    assert board.command("set_pressure", 1.0) == "not_zeroed"
    board.write(**{name: value})
    board.run(200)
    assert board.last("PRESSURE")["pressure_kpa"] == pytest.approx(0.8, abs=0.03)


def test_run_closes_the_valve_and_regulates() -> None:
    board = Board().at(3.0)
    assert board.state == "run"
    assert STATES[lib.rig_host_state(board.host)] == "run"
    assert not board.bench.valve_open
    assert board.bench.pressure_kpa == pytest.approx(3.0, abs=0.03)
    assert board.last("PRESSURE")["setpoint_kpa"] == pytest.approx(3.0)


def test_hold_keeps_plunger_and_gas() -> None:
    board = Board().at(4.0)
    assert board.command("hold") == "accepted"
    board.run(500)
    steps = board.bench.steps
    board.run(5000)
    assert board.state == "hold"
    assert board.bench.steps == steps
    assert not board.bench.valve_open
    assert board.bench.pressure_kpa == pytest.approx(4.0, abs=0.05)


def test_running_goes_on_from_hold_without_a_jump() -> None:
    board = Board().at(4.0)
    board.command("hold")
    board.run(1000)
    board.command("set_pressure", 5.0)
    _, least, greatest = board.true_pressure(4000)
    assert least > 3.9
    assert greatest < 5.1


def test_vent_opens_the_valve_at_once_and_ends_idle_at_home() -> None:
    board = Board().at(8.0)
    assert board.command("vent") == "accepted"
    assert board.bench.valve_open
    assert board.state == "vent"
    board.run(400)
    assert board.bench.pressure_kpa < 0.5
    assert board.until("idle", 6000) < 6000
    assert board.bench.plunger_ml == pytest.approx(0.0, abs=2e-3)
    assert board.last("HEARTBEAT")["homed"]
    assert board.last("HEARTBEAT")["valve_open"]


def test_position_does_not_drift_over_many_vents() -> None:
    board = Board().ready()
    for _ in range(5):
        board.command("set_pressure", 6.0)
        board.run(5000)
        board.command("vent")
        board.until("idle", 6000)
        assert board.bench.plunger_ml == pytest.approx(0.0, abs=2e-3)
        assert board.last("PRESSURE")["plunger_ml"] == pytest.approx(0.0, abs=1e-3)


def test_vent_without_known_home_searches_for_it() -> None:
    board = Board(plunger_ml=12.0)
    board.run(200)
    assert board.command("vent") == "accepted"
    board.until("idle", 30_000)
    assert board.last("HEARTBEAT")["homed"]


def test_vent_during_homing_goes_on_homing() -> None:
    board = Board(plunger_ml=30.0)
    board.run(200)
    board.command("home")
    board.run(3000)
    assert board.command("vent") == "accepted"
    assert board.state == "vent"
    board.until("idle", 30_000)
    assert board.last("HEARTBEAT")["homed"]
    assert board.bench.plunger_ml == pytest.approx(0.0, abs=2e-3)


def test_vent_while_venting_goes_on_venting() -> None:
    board = Board().at(6.0)
    board.command("vent")
    board.run(100)
    assert board.command("vent") == "accepted"
    assert board.state == "vent"
    assert board.until("idle", 6000) < 6000
    assert board.bench.plunger_ml == pytest.approx(0.0, abs=2e-3)


def test_coarse_steps_come_home_too() -> None:
    board = Board(conditions={"step_ul": 7.0})
    board.write(volume_per_step_ul=7.0)
    board.at(3.0)
    board.command("vent")
    board.until("idle", 6000)
    assert board.fault == "none"
    assert board.bench.plunger_ml == pytest.approx(0.0, abs=0.02)


def test_clearing_where_no_fault_stands_changes_nothing() -> None:
    board = Board().at(3.0)
    assert board.command("clear_fault") == "accepted"
    assert (board.state, board.fault) == ("run", "none")


def test_idle_stops_everything_and_opens_the_valve() -> None:
    board = Board().at(5.0)
    assert board.command("idle") == "accepted"
    board.run(1000)
    steps = board.bench.steps
    board.run(1000)
    assert (board.state, bool(board.bench.valve_open)) == ("idle", True)
    assert board.bench.steps == steps
    assert board.last("HEARTBEAT")["homed"]


def test_idle_stops_a_homing() -> None:
    board = Board(plunger_ml=40.0)
    board.run(200)
    board.command("home")
    board.run(2000)
    assert board.command("idle") == "accepted"
    board.run(500)
    steps = board.bench.steps
    board.run(500)
    assert board.bench.steps == steps
    assert not board.last("HEARTBEAT")["homed"]


@pytest.mark.parametrize("opcode", ["set_pressure", "hold", "home", "jog"])
def test_a_searching_board_is_busy(opcode: str) -> None:
    board = Board(plunger_ml=40.0)
    board.run(200)
    board.command("home")
    assert board.command(opcode, 1.0) == "busy"
    assert board.state == "homing"


@pytest.mark.parametrize(
    ("argument", "result"),
    [
        (-0.001, "out_of_range"),
        (15.0, "out_of_range"),  # the limit itself
        (1e9, "out_of_range"),
        (float("nan"), "not_finite"),
        (float("inf"), "not_finite"),
        (float("-inf"), "not_finite"),
        (0.0, "accepted"),
        (14.999, "accepted"),
    ],
)
def test_setpoints_are_checked(argument: float, result: str) -> None:
    board = Board().ready()
    assert board.command("set_pressure", argument) == result
    assert board.state == ("run" if result == "accepted" else "idle")


def test_unknown_opcodes_are_refused() -> None:
    board = Board()
    board.run(200)
    for opcode in range(10, 16):
        board.send("COMMAND", opcode=opcode, number=opcode, argument=0.0)
        board.run(4)
        assert board.last("HEARTBEAT")["command_number"] == opcode
        assert board.last("HEARTBEAT")["command_result"] == "unknown_opcode"


@pytest.mark.parametrize("opcode", ["home", "jog", "zero_pressure"])
def test_a_bench_under_pressure_is_in_the_wrong_state_for(opcode: str) -> None:
    board = Board().at(2.0)
    assert board.command(opcode, 0.5) == "wrong_state"
    assert board.state == "run"


def test_the_same_number_is_acknowledged_again_and_not_executed_again() -> None:
    board = Board().at(2.0)
    assert board.command("set_pressure", 3.0, number=90) == "accepted"
    assert board.command("set_pressure", 9.0, number=90) == "accepted"
    board.run(5000)
    assert board.last("PRESSURE")["setpoint_kpa"] == pytest.approx(3.0)
    assert board.command("vent", number=90) == "accepted"
    assert board.state == "run"


@pytest.mark.parametrize(
    ("before", "last", "stale"),
    [((), 90, 89), ((), 90, 1), ((120, 240), 3, 255), ((120,), 240, 200)],
)
def test_a_command_that_comes_late_moves_nothing(
    before: tuple[int, ...], last: int, stale: int
) -> None:
    board = Board().at(2.0)
    for number in before:
        assert board.command("none", number=number) == "accepted"
    assert board.command("vent", number=last) == "accepted"
    board.run(20_000)
    assert board.state == "idle"
    board.send("COMMAND", opcode="set_pressure", number=stale, argument=9.0)
    board.run(500)
    assert board.state == "idle"
    assert board.last("HEARTBEAT")["command_number"] == last


def test_a_refusal_is_repeated_for_the_same_number() -> None:
    board = Board()
    board.run(200)
    assert board.command("set_pressure", 1.0, number=7) == "not_homed"
    assert board.command("vent", number=7) == "not_homed"
    assert board.state == "idle"


def test_every_command_is_acknowledged_at_once() -> None:
    board = Board()
    board.run(150)
    before = len(board.all("HEARTBEAT"))
    board.send("COMMAND", opcode="none", number=9, argument=0.0)
    board.run(2)
    assert len(board.all("HEARTBEAT")) == before + 1
    assert board.last("HEARTBEAT")["command_number"] == 9


# --- zero ---------------------------------------------------------------------------------------


def test_zeroing_removes_the_transducers_offset() -> None:
    board = Board()
    board.bench.offset_kpa = 0.8
    board.ready()
    assert board.last("HEARTBEAT")["zeroed"]
    board.messages.clear()
    board.run(2000)
    readings = [m["pressure_kpa"] for m in board.all("PRESSURE")]
    assert sum(readings) / len(readings) == pytest.approx(0.0, abs=0.003)


def test_an_offset_beyond_the_limit_is_not_taken_for_zero() -> None:
    board = Board()
    board.bench.offset_kpa = 2.5
    board.ready()
    assert not board.last("HEARTBEAT")["zeroed"]
    assert board.last("PRESSURE")["pressure_kpa"] == pytest.approx(2.5, abs=0.05)


def test_nothing_starts_while_zero_is_taken() -> None:
    board = Board().ready()
    board.command("zero_pressure")
    assert board.command("set_pressure", 1.0) == "busy"
    assert board.command("jog", 1.0) == "busy"
    board.run(1100)
    assert board.command("set_pressure", 1.0) == "accepted"


def test_a_zeroing_cut_short_changes_nothing() -> None:
    board = Board().ready()
    board.bench.offset_kpa = 0.5
    board.command("zero_pressure")
    board.run(300)
    assert board.command("hold") == "accepted"
    board.run(2000)
    assert not board.last("HEARTBEAT")["zeroed"]
    assert board.last("PRESSURE")["pressure_kpa"] == pytest.approx(0.5, abs=0.03)


# --- jog ----------------------------------------------------------------------------------------


def test_a_jog_stops_by_itself() -> None:
    board = Board().ready()
    assert board.command("jog", 2.0) == "accepted"
    board.run(3000)
    assert board.bench.plunger_ml == pytest.approx(2.0 * 0.5, abs=0.12)
    steps = board.bench.steps
    board.run(1000)
    assert board.bench.steps == steps


def test_a_repeated_jog_goes_on() -> None:
    board = Board().ready()
    for _ in range(10):
        board.command("jog", 2.0)
        board.run(196)
    board.run(1000)
    assert board.bench.plunger_ml == pytest.approx(2.0 * (2.0 + 0.3), abs=0.2)


def test_a_jog_outwards_stops_on_the_home_switch() -> None:
    board = Board(plunger_ml=0.3)
    board.run(200)
    for _ in range(5):
        assert board.command("jog", -2.0) == "accepted"
        board.run(100)
    board.run(1000)
    assert board.bench.plunger_ml == pytest.approx(0.0, abs=2e-3)
    assert board.fault == "none"


def test_a_jog_stays_within_the_travel_of_a_homed_plunger() -> None:
    board = Board()
    board.write(syringe_volume_ml=2.0)
    board.ready()
    for _ in range(20):
        board.command("jog", 5.0)
        board.run(100)
    board.run(1000)
    assert board.bench.plunger_ml == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize(
    ("flow", "result"),
    [(6.1, "out_of_range"), (-6.1, "out_of_range"), (float("nan"), "not_finite")],
)
def test_a_jog_is_checked(flow: float, result: str) -> None:
    board = Board().ready()
    assert board.command("jog", flow) == result
    board.run(500)
    assert board.bench.plunger_ml == pytest.approx(0.0, abs=2e-3)


def test_a_jog_in_hold_keeps_the_valve_closed() -> None:
    board = Board().ready()
    board.command("hold")
    board.command("jog", 4.0)
    board.run(1500)
    assert board.state == "hold"
    assert board.bench.pressure_kpa > 1.5
