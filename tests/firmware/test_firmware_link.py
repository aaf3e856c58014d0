"""The link as the host sees it: identity, periods, counters, and frames that must be ignored."""

from __future__ import annotations

import binascii

import pytest
from board_under_test import (
    ALIVE_COUNT,
    PROTOCOL_VERSION,
    SCHEMA,
    SCHEMA_FILE,
    Board,
    line_of,
    protected,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from rig.board._firmware import ffi, lib

COMMAND_ID = SCHEMA.get_message_by_name("COMMAND").frame_id


def command_line(alive: int, number: int, opcode: int = 6) -> bytes:
    payload = protected("COMMAND", alive, {"opcode": opcode, "number": number, "argument": 0.0})
    return line_of(COMMAND_ID, payload)


def test_the_identity_names_schema_protocol_board_and_commit() -> None:
    board = Board()
    board.send("IDENTITY_REQUEST", number=1)
    board.run(2)
    identity = board.last("IDENTITY")
    assert str(identity["board_kind"]) == "host"
    assert identity["protocol_version"] == PROTOCOL_VERSION
    assert identity["firmware_git"] == 0xABC123
    text = SCHEMA_FILE.read_bytes().replace(b"\r\n", b"\n")
    assert identity["schema_crc"] == binascii.crc_hqx(text, 0xFFFF)


def test_messages_come_at_the_cycle_times_of_the_schema() -> None:
    board = Board()
    board.run(500)
    board.messages.clear()
    board.run(10_000)
    for message in SCHEMA.messages:
        if "RIG" in message.senders and message.cycle_time:
            expected = 10_000 / message.cycle_time
            assert abs(len(board.all(message.name)) - expected) <= 1, message.name


def test_alive_counters_go_up_by_one_for_each_message() -> None:
    board = Board()
    board.run(5000)
    for name in ("HEARTBEAT", "PRESSURE", "CONTROLLER", "LOAD_CELL"):
        counters = [m["alive"] for m in board.all(name)]
        assert counters == [i % ALIVE_COUNT for i in range(len(counters))]


@given(st.integers(0, 63))
@settings(max_examples=64)
def test_a_frame_with_a_flipped_bit_is_dropped_and_counted(bit: int) -> None:
    board = Board()
    board.run(200)
    payload = protected("COMMAND", 0, {"opcode": 6, "number": 9, "argument": 0.0})
    flipped = (int.from_bytes(payload, "little") ^ 1 << bit).to_bytes(8, "little")
    board.type(line_of(COMMAND_ID, flipped))
    board.run(200)
    assert board.last("HEARTBEAT")["command_number"] == 0
    assert board.state == "idle"
    assert board.counters.corrupt == 1


def test_a_repeated_frame_is_dropped_and_counted() -> None:
    board = Board()
    board.run(200)
    board.type(command_line(3, 9) + command_line(3, 10))
    board.run(4)
    assert board.last("HEARTBEAT")["command_number"] == 9
    assert board.counters.repeated == 1


def test_frames_lost_on_the_way_do_not_stop_the_next() -> None:
    board = Board()
    board.run(200)
    board.type(command_line(3, 9) + command_line(7, 10))
    board.run(4)
    assert board.last("HEARTBEAT")["command_number"] == 10


def test_a_new_host_may_start_its_counters_anywhere() -> None:
    board = Board()
    board.run(200)
    board.type(command_line(3, 9))
    board.run(4)
    board.type(b"C\rO\r" + command_line(3, 10))
    board.run(4)
    assert board.last("HEARTBEAT")["command_number"] == 10


def test_a_short_frame_is_dropped() -> None:
    board = Board()
    board.type(line_of(COMMAND_ID, protected("COMMAND", 0, {"opcode": 6, "number": 9})[:7]))
    board.run(200)
    assert board.last("HEARTBEAT")["command_number"] == 0
    assert board.counters.corrupt == 1


def test_frames_for_others_are_ignored() -> None:
    board = Board()
    board.type(line_of(0x123, bytes(8)))
    board.run(10)
    assert board.counters.unknown == 1


def test_uptime_counts_seconds() -> None:
    board = Board()
    board.run(12_500)
    assert board.last("HEARTBEAT")["uptime_s"] == 12


@pytest.mark.parametrize(
    ("cause", "name"), [(0, "unknown"), (1, "power_on"), (2, "external"), (4, "watchdog")]
)
def test_the_reset_cause_is_reported(cause: int, name: str) -> None:
    board = Board(reset_cause=cause)
    board.run(200)
    assert str(board.last("HEARTBEAT")["reset_cause"]) == name


def test_running_until_something_is_sent_stops_in_that_millisecond() -> None:
    board = Board()
    board.run(500)
    idle = lib.rig_test_bench_idle
    ran = lib.rig_host_run(board.host, idle, ffi.NULL, 1000, 1)
    assert 0 < ran <= 20
    assert lib.rig_host_pending(board.host) > 0
    # what was sent before does not stop the next run
    assert lib.rig_host_run(board.host, idle, ffi.NULL, 1000, 1) > 0


def test_the_same_story_gives_the_same_bytes() -> None:
    def story() -> list[tuple[str, dict[str, object]]]:
        return Board(seed=4).at(3.0).messages

    assert story() == story()


def test_a_bench_in_python_sees_every_millisecond() -> None:
    seen: list[tuple[int, int]] = []

    @ffi.def_extern(name="rig_bench_in_python")  # type: ignore[untyped-decorator]
    def step(_bench: object, out: object, pins: object) -> None:
        seen.append((out.steps, out.valve_open))  # type: ignore[attr-defined]
        pins.adc_count = 1  # type: ignore[attr-defined]
        pins.adc[0] = 102  # type: ignore[attr-defined]

    board = Board()
    assert lib.rig_host_run(board.host, lib.rig_bench_in_python, ffi.NULL, 250, 0) == 250
    assert seen == [(0, 1)] * 250


def test_a_counter_beyond_its_range_is_corrupt_even_with_the_right_crc() -> None:
    board = Board()
    board.run(100)
    board.type(line_of(0x200, protected("HOST_HEARTBEAT", 15, {"protocol_version": 1})))
    board.run(2)
    assert board.counters.corrupt == 1


def test_counters_stay_at_their_highest_value() -> None:
    board = Board()
    board.run(100)
    board.type(b"?\r" * 65_540)
    board.run(2)
    assert board.counters.bad_lines == 65_535


def test_a_line_that_is_too_slow_loses_whole_frames_and_counts_them() -> None:
    board = Board()
    board.run(100)
    lib.rig_host_pace_line(board.host, 1)
    board.run(3000)
    assert board.counters.not_sent > 0
    lib.rig_host_pace_line(board.host, 11)
    lost = board.counters.not_sent
    board.messages.clear()
    board.run(3000)  # every line that comes is whole, and its CRC is right
    assert board.counters.not_sent == lost
    assert len(board.all("PRESSURE")) >= 149


def test_a_command_without_a_number_is_no_command() -> None:
    board = Board()
    board.run(200)
    board.send("COMMAND", opcode="home", number=0, argument=0.0)
    board.run(150)
    assert board.last("HEARTBEAT")["command_number"] == 0
    assert board.state == "idle"
