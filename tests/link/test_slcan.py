"""SLCAN lines: what we send python-can reads, what any board sends we survive."""

from __future__ import annotations

import can
import numpy as np
import pytest
from can.interfaces.slcan import slcanBus
from hypothesis import given
from hypothesis import strategies as st

from rig.link.slcan import MAX_LINE, SlcanParser, encode_frame

frames = st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8))


def line(frame_id: int, payload: bytes, stamp_ms: int | None = None) -> bytes:
    stamp = b"" if stamp_ms is None else b"%04X" % (stamp_ms % 60_000)
    return encode_frame(frame_id, payload)[:-1] + stamp + b"\r"


def test_a_frame_is_written_as_lawicel_does() -> None:
    assert encode_frame(0x110, bytes.fromhex("0001A0FF")) == b"t11040001A0FF\r"


@given(st.lists(frames, max_size=20), st.integers(1, 40))
def test_frames_survive_any_cutting_of_the_stream(
    sent: list[tuple[int, bytes]], piece: int
) -> None:
    stream = b"".join(line(*frame) for frame in sent)
    parser = SlcanParser()
    got = [
        frame
        for start in range(0, len(stream), piece)
        for frame in parser.feed(stream[start : start + piece], 1.0)
    ]
    assert [(f.frame_id, f.payload) for f in got] == sent
    assert parser.malformed == 0


@given(st.binary(max_size=300))
def test_noise_never_raises_and_never_grows_the_buffer(noise: bytes) -> None:
    parser = SlcanParser()
    for _ in range(5):
        parser.feed(noise, 0.0)
        assert len(parser._rest) <= MAX_LINE


@given(st.binary(max_size=40).filter(lambda b: b"\r" not in b), frames)
def test_a_good_frame_after_noise_is_read(noise: bytes, frame: tuple[int, bytes]) -> None:
    parser = SlcanParser()
    got = parser.feed(noise + b"\r" + line(*frame), 0.0)
    assert (got[-1].frame_id, got[-1].payload) == frame


def stamped(parser: SlcanParser, now_s: float, *stamps_ms: int) -> list[float]:
    data = b"".join(line(0x100, b"\0" * 8, stamp) for stamp in stamps_ms)
    return [frame.time_s for frame in parser.feed(data, now_s)]


@pytest.mark.parametrize("board_ahead_ms", [0, 17, 59_999, 123_456])
def test_stamps_become_bench_time_whenever_the_board_was_started(board_ahead_ms: int) -> None:
    parser = SlcanParser()
    for now_ms in range(0, 200_000, 100):
        stamps = [now_ms + board_ahead_ms - late for late in (80, 40, 0)]
        expected = [(now_ms - late) / 1000 for late in (80, 40, 0)]
        assert stamped(parser, now_ms / 1000, *stamps) == pytest.approx(expected, abs=1e-9)


def test_latency_makes_no_frame_late() -> None:
    parser = SlcanParser()
    rng = np.random.default_rng(1)
    for now_ms in range(0, 60_000, 10):
        late = int(rng.integers(0, 30))
        (time_s,) = stamped(parser, (now_ms + late) / 1000, now_ms)
        if now_ms > 5_000:
            assert time_s == pytest.approx(now_ms / 1000, abs=1.5e-3)


def test_a_board_clock_that_drifts_100_ppm_is_followed() -> None:
    parser = SlcanParser()
    for now_ms in range(0, 600_000, 20):
        (time_s,) = stamped(parser, now_ms / 1000, round(now_ms * 0.9999))
        assert time_s == pytest.approx(now_ms / 1000, abs=4e-3)


def test_a_damaged_stamp_moves_neither_its_frame_nor_the_clock() -> None:
    parser = SlcanParser()
    for now_ms in range(0, 2_000, 20):
        stamped(parser, now_ms / 1000, now_ms)
    assert stamped(parser, 2.0, 2_000 + 30_000) == [2.0]
    assert stamped(parser, 2.02, 2_010) == pytest.approx([2.01])


def test_a_board_that_started_anew_is_followed_again() -> None:
    parser = SlcanParser()
    for now_ms in range(0, 30_000, 20):
        stamped(parser, now_ms / 1000, now_ms)
    for now_ms in range(30_000, 31_000, 20):
        last = stamped(parser, now_ms / 1000, now_ms - 30_000)
    assert last == pytest.approx([30.98])
    (late,) = stamped(parser, 31.0, 990)
    assert late == pytest.approx(30.99)


def test_noise_before_a_frame_does_not_lose_it() -> None:
    (frame,) = SlcanParser().feed(b"\xff7\x00" + line(0x100, b"\x01" * 8, None), 0.0)
    assert frame.payload == b"\x01" * 8


def test_truncated_and_non_hexadecimal_lines_count_as_malformed() -> None:
    parser = SlcanParser()
    assert parser.feed(b"t1108001122\rtXYZ0\rt1102GG00\rz\r\r", 0.0) == []
    assert parser.malformed == 3


def test_python_can_reads_what_we_send() -> None:
    bus = slcanBus("loop://", sleep_after_open=0)
    bus.serialPortOrig.reset_input_buffer()
    try:
        bus.serialPortOrig.write(encode_frame(0x201, bytes.fromhex("01020304050607A8")))
        message = bus.recv(1.0)
    finally:
        bus.shutdown()
    assert isinstance(message, can.Message)
    assert message.arbitration_id == 0x201
    assert bytes(message.data) == bytes.fromhex("01020304050607A8")
