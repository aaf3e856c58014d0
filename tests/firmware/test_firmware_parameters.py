"""Parameters: ranges, when they may change, and how they survive a restart."""

from __future__ import annotations

import struct

import pytest
from board_under_test import PARAMETERS, Board
from hypothesis import given, settings
from hypothesis import strategies as st
from rig.board._firmware import ffi, lib

COUNT = lib.rig_host_parameter_count()
INDICES = range(COUNT)
NAMES = {index: name for name, index in PARAMETERS.items()}
INDEX = st.sampled_from(list(INDICES))


def default(index: int) -> float:
    return float(lib.rig_host_parameter_default(index))


def low(index: int) -> float:
    return float(lib.rig_host_parameter_min(index))


def high(index: int) -> float:
    return float(lib.rig_host_parameter_max(index))


def stored(board: Board) -> bytes:
    image = ffi.new("uint8_t[]", lib.rig_host_nonvolatile_size())
    lib.rig_host_nonvolatile_store(board.host, image)
    return bytes(ffi.buffer(image))


@pytest.fixture
def board() -> Board:
    board = Board()
    board.run(200)
    return board


def test_the_firmware_has_the_parameters_of_the_schema() -> None:
    assert sorted(PARAMETERS.values()) == list(INDICES)


@pytest.mark.parametrize("index", INDICES, ids=lambda i: NAMES[i])
def test_the_default_is_within_its_range(index: int) -> None:
    assert low(index) <= default(index) <= high(index)


def test_the_setpoint_limit_fits_the_signal_that_reports_it() -> None:
    assert high(PARAMETERS["pressure_limit_kpa"]) < 55.535
    assert high(PARAMETERS["syringe_volume_ml"]) < 64.535
    assert high(PARAMETERS["max_flow_ml_s"]) < 32.767


@pytest.mark.parametrize("index", INDICES, ids=lambda i: NAMES[i])
def test_a_new_board_has_the_defaults(board: Board, index: int) -> None:
    answer = board.parameter("read", index)
    assert str(answer["parameter_result"]) == "accepted"
    assert answer["parameter_value"] == default(index)


@pytest.mark.parametrize("index", INDICES, ids=lambda i: NAMES[i])
def test_the_ends_of_the_range_are_accepted_and_what_lies_beyond_is_not(
    board: Board, index: int
) -> None:
    for value in (low(index), high(index)):
        answer = board.parameter("write", index, value)
        assert str(answer["parameter_result"]) == "accepted"
        assert answer["parameter_value"] == value
    span = high(index) - low(index)
    for value in (low(index) - 0.01 * span, high(index) + 0.01 * span):
        answer = board.parameter("write", index, value)
        assert str(answer["parameter_result"]) == "out_of_range"
        assert answer["parameter_value"] == high(index)  # the value still in force


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_a_value_that_is_no_number_is_refused(board: Board, value: float) -> None:
    answer = board.parameter("write", "deadband_kpa", value)
    assert str(answer["parameter_result"]) == "not_finite"
    assert answer["parameter_value"] == default(PARAMETERS["deadband_kpa"])


@pytest.mark.parametrize("index", [COUNT, 100, 255])
@pytest.mark.parametrize("operation", ["read", "write"])
def test_unknown_parameters_are_named_so(board: Board, index: int, operation: str) -> None:
    assert board.parameter(operation, index, 1.0)["parameter_result"] == "unknown_parameter"


@pytest.mark.parametrize("index", INDICES, ids=lambda i: NAMES[i])
def test_geometry_and_sensors_do_not_change_under_pressure_but_gains_may(index: int) -> None:
    board = Board().at(2.0, settle_ms=2000)
    answer = board.parameter("write", index, default(index))
    live = bool(lib.rig_host_parameter_live(index))
    assert str(answer["parameter_result"]) == ("accepted" if live else "wrong_state")


def test_geometry_does_not_change_while_the_plunger_is_jogged(board: Board) -> None:
    board.command("jog", 1.0)
    assert board.state == "idle"
    answer = board.parameter("write", "syringe_volume_ml", 50.0)
    assert str(answer["parameter_result"]) == "wrong_state"
    board.run(1500)
    board.write(syringe_volume_ml=50.0)


def test_an_unknown_operation_changes_nothing(board: Board) -> None:
    for operation in range(3, 16):
        answer = board.parameter(operation, "deadband_kpa", 0.5)
        assert str(answer["parameter_result"]) == "unknown_parameter"
    assert board.parameter("read", "deadband_kpa")["parameter_value"] == pytest.approx(0.008)


def test_a_new_step_size_makes_the_home_unknown() -> None:
    board = Board().ready()
    board.write(volume_per_step_ul=0.5)
    board.run(200)
    assert not board.last("HEARTBEAT")["homed"]


def test_a_parameter_takes_effect_at_once(board: Board) -> None:
    board.run(500)
    before = board.last("PRESSURE")["pressure_kpa"]
    board.write(transducer_offset_v=0.4)
    board.run(100)
    assert board.last("PRESSURE")["pressure_kpa"] - before == pytest.approx(1.0, abs=0.05)


def test_parameters_last_only_if_saved(board: Board) -> None:
    board.write(deadband_kpa=0.02)
    restarted = Board(nonvolatile=stored(board))
    restarted.run(200)
    assert restarted.parameter("read", "deadband_kpa")["parameter_value"] == pytest.approx(0.008)
    assert str(board.parameter("save", 0)["parameter_result"]) == "accepted"
    restarted = Board(nonvolatile=stored(board))
    restarted.run(200)
    assert restarted.fault == "none"
    assert restarted.parameter("read", "deadband_kpa")["parameter_value"] == pytest.approx(0.02)


def test_erased_memory_is_no_fault() -> None:
    board = Board(nonvolatile=b"\xff" * lib.rig_host_nonvolatile_size())
    board.run(300)
    assert (board.state, board.fault) == ("idle", "none")


@given(st.integers(0, 8 * lib.rig_host_nonvolatile_size() - 1))
@settings(max_examples=60)
def test_a_single_flipped_bit_in_memory_is_found_and_defaults_hold(bit: int) -> None:
    board = Board()
    board.write(deadband_kpa=0.02)
    board.parameter("save", 0)
    image = int.from_bytes(stored(board), "little") ^ 1 << bit
    flipped = image.to_bytes(lib.rig_host_nonvolatile_size(), "little")
    restarted = Board(nonvolatile=flipped)
    restarted.run(300)
    assert restarted.fault == "parameters_corrupt"
    assert restarted.parameter("read", "deadband_kpa")["parameter_value"] == pytest.approx(0.008)


def sealed(version: int, values: list[float]) -> bytes:
    body = bytes((version, len(values))) + struct.pack(f"<{len(values)}f", *values)
    return body + struct.pack("<H", lib.rig_test_crc16(body, len(body)))


def test_an_image_of_another_version_is_not_used() -> None:
    values = [default(i) for i in INDICES]
    good, other = Board(nonvolatile=sealed(1, values)), Board(nonvolatile=sealed(2, values))
    good.run(300)
    other.run(300)
    assert (good.fault, other.fault) == ("none", "parameters_corrupt")


def test_an_image_of_another_number_of_parameters_is_not_used() -> None:
    values = [default(i) for i in INDICES]
    body = bytes((1, len(values) - 1)) + struct.pack(f"<{len(values)}f", *values)
    image = body + struct.pack("<H", lib.rig_test_crc16(body, len(body)))
    board = Board(nonvolatile=image)
    board.run(300)
    assert board.fault == "parameters_corrupt"


def test_an_image_with_a_value_out_of_range_is_not_used() -> None:
    values = [default(i) for i in INDICES]
    values[PARAMETERS["pressure_limit_kpa"]] = 500.0
    board = Board(nonvolatile=sealed(1, values))
    board.run(300)
    assert board.fault == "parameters_corrupt"


@given(INDEX, st.floats(width=32))
@settings(max_examples=100)
def test_no_write_ever_leaves_a_value_outside_its_range(index: int, value: float) -> None:
    board = Board()
    board.run(110)
    board.parameter("write", index, value)
    held = board.parameter("read", index)["parameter_value"]
    assert low(index) <= held <= high(index)
    assert held == lib.rig_host_parameter(board.host, index)
