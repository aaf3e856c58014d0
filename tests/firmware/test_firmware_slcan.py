"""SLCAN: the firmware's parser and formatter, and what it answers on the line."""

from __future__ import annotations

import pytest
from board_under_test import Board, line_of, protected
from hypothesis import given
from hypothesis import strategies as st
from rig.board._firmware import ffi, lib

from rig.link.slcan import OPEN_WITH_TIMESTAMPS

# rig::slcan::Kind
BAD, OPEN, CLOSE, BIT_RATE, STAMPS_OFF, STAMPS_ON, VERSION, SERIAL, STATUS, FRAME, OTHER = range(
    1, 12
)
PYTHON_CAN_OPENING = b"C\rS6\r\rO\rO\r"
IDENTITY_REQUEST = line_of(0x220, protected("IDENTITY_REQUEST", 0, {"number": 1}))


def parse(data: bytes) -> tuple[list[int], tuple[int, bytes]]:
    """Kinds of all lines, and the last data frame."""
    kinds = ffi.new("uint8_t[4096]")
    frame_id, length = ffi.new("uint16_t *"), ffi.new("uint8_t *")
    payload = ffi.new("uint8_t[8]")
    count = lib.rig_test_slcan_parse(data, len(data), kinds, 4096, frame_id, length, payload)
    return list(kinds[0:count]), (frame_id[0], bytes(ffi.buffer(payload))[: length[0]])


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_a_formatted_frame_is_parsed_back(frame_id: int, payload: bytes) -> None:
    buffer = ffi.new("uint8_t[32]")
    length = lib.rig_test_slcan_format(frame_id, payload, len(payload), 0, 0, buffer)
    line = bytes(ffi.buffer(buffer, length))
    assert line == line_of(frame_id, payload)
    assert parse(line) == ([FRAME], (frame_id, payload))
    assert parse(b"t" + line[1:].lower()) == ([FRAME], (frame_id, payload))


def test_a_time_stamp_is_four_digits_of_milliseconds() -> None:
    buffer = ffi.new("uint8_t[32]")
    length = lib.rig_test_slcan_format(0x123, b"\x0f", 1, 1, 59_999, buffer)
    assert bytes(ffi.buffer(buffer, length)) == b"t12310FEA5F\r"


@pytest.mark.parametrize(
    ("line", "kind"),
    [
        (b"O", OPEN),
        (b"C", CLOSE),
        (b"S6", BIT_RATE),
        (b"Z0", STAMPS_OFF),
        (b"Z1", STAMPS_ON),
        (b"V", VERSION),
        (b"N", SERIAL),
        (b"F", STATUS),
        (b"r1238", OTHER),
        (b"T0000012321122", OTHER),
        (b"R000001232", OTHER),
        (b"S9", BAD),
        (b"S!", BAD),
        (b"Z", BAD),
        (b"Z12", BAD),
        (b"t1001!!", BAD),
        (b"t1001::", BAD),
        (b"t1001GG", BAD),
        (b"t1001gg", BAD),
        (b"S", BAD),
        (b"Z2", BAD),
        (b"OO", BAD),
        (b"t12", BAD),
        (b"t1239", BAD),  # nine bytes do not fit a frame
        (b"t12321", BAD),  # too few digits
        (b"t123211223", BAD),  # too many
        (b"t8001FF", BAD),  # eleven bits hold no 0x800
        (b"t12G1FF", BAD),
        (b"t1231F\xff", BAD),
        (b"x", BAD),
    ],
)
def test_lines_are_what_the_lawicel_manual_says(line: bytes, kind: int) -> None:
    assert parse(line + b"\r")[0] == [kind]


@given(st.lists(st.binary(max_size=60), max_size=20))
def test_garbage_never_hides_the_next_good_line(pieces: list[bytes]) -> None:
    garbage = b"".join(pieces)
    kinds, frame = parse(garbage + b"\r" + line_of(0x201, b"\x01\x02"))
    assert kinds[-1] == FRAME
    assert frame == (0x201, b"\x01\x02")


def test_an_endless_line_is_one_bad_line() -> None:
    kinds, _ = parse(b"t" + b"1" * 10_000 + b"\r" + b"V\r")
    assert kinds == [BAD, VERSION]


def test_the_opening_of_python_can_is_accepted_without_a_bell() -> None:
    board = Board(opening=PYTHON_CAN_OPENING)
    board.run(300)
    assert b"\a" not in b"".join(board.other_lines)
    assert board.all("HEARTBEAT")


def test_nothing_is_sent_before_the_channel_is_open() -> None:
    board = Board(opening=b"\r\rS6\r")
    board.run(1000)
    assert board.messages == []
    board.type(b"O\r")
    board.run(200)
    assert board.all("PRESSURE")


@pytest.mark.parametrize("missed", range(len(OPEN_WITH_TIMESTAMPS)))
def test_a_board_that_missed_the_beginning_of_the_opening_is_silent_or_stamps(missed: int) -> None:
    board = Board(opening=OPEN_WITH_TIMESTAMPS[missed:])
    board.heartbeats_on = False
    lib.rig_host_run(board.host, lib.rig_test_bench_step, board._bench, 200, 0)
    count = lib.rig_host_pending(board.host)
    buffer = ffi.new("uint8_t[]", count)
    lib.rig_host_transmit(board.host, buffer, count)
    frames = [x for x in bytes(ffi.buffer(buffer)).split(b"\r") if b"t" in x]
    stamped = len(b"t110") + 1 + 2 * 8 + 4
    assert {len(frame[frame.index(b"t") :]) for frame in frames} <= {stamped}
    if missed < len(OPEN_WITH_TIMESTAMPS) - len(b"O\rZ1\r"):
        assert frames


def test_closing_the_channel_silences_the_board() -> None:
    board = Board()
    board.run(200)
    board.type(b"C\r")
    board.run(100)
    sent = len(board.messages)
    board.run(1000)
    assert len(board.messages) == sent


def test_a_frame_on_a_closed_channel_rings_the_bell_and_does_nothing() -> None:
    board = Board(opening=b"")
    board.heartbeats_on = False
    board.type(IDENTITY_REQUEST)
    board.run(10)
    assert board.other_lines == []  # a bell is no line
    board.type(b"O\r")
    board.run(10)
    assert board.other_lines == [b"\a"]
    assert not board.all("IDENTITY")


def test_version_serial_number_and_status_have_the_lengths_that_hosts_expect() -> None:
    board = Board(opening=b"V\rN\rF\r")
    board.run(10)
    assert [len(line) for line in board.other_lines] == [5, 5, 3]
    assert [line[:1] for line in board.other_lines] == [b"V", b"N", b"F"]


def test_time_stamps_follow_the_boards_clock_modulo_a_minute() -> None:
    board = Board(opening=b"Z1\rO\r")
    stamps = []
    for _ in range(65):
        lib.rig_host_run(board.host, lib.rig_test_bench_idle, ffi.NULL, 1000, 0)
        count = lib.rig_host_pending(board.host)
        buffer = ffi.new("uint8_t[]", count)
        lib.rig_host_transmit(board.host, buffer, count)
        lines = bytes(ffi.buffer(buffer)).split(b"\r")
        stamps.append(int([x for x in lines if x.startswith(b"t110")][-1][-4:], 16))
    assert all(0 <= stamp < 60_000 for stamp in stamps)
    expected = [(1000 * (i + 1)) % 60_000 for i in range(65)]
    assert all((e - s) % 60_000 <= 20 for e, s in zip(expected, stamps, strict=True))


@given(st.binary(max_size=300))
def test_the_board_survives_any_bytes_and_still_answers(data: bytes) -> None:
    board = Board()
    board.type(data + b"\rO\r" + IDENTITY_REQUEST)
    board.run(20)
    assert board.all("IDENTITY")


def test_frames_that_are_not_for_the_rig_are_answered_and_ignored() -> None:
    board = Board()
    board.run(100)
    before = len(board.other_lines)
    board.type(b"T0000012321122\rr1238\rS6\r")
    board.run(2)
    assert board.other_lines[before:] == [b""] * 3
    assert board.counters.bad_lines == 0


def test_time_stamps_are_switched_off_again() -> None:
    board = Board()
    stamped = Board(opening=b"O\rZ1\r")
    stamped.type(b"Z0\r")
    board.run(200)
    stamped.run(200)
    assert stamped.messages == board.messages
