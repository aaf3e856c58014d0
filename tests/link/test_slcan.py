"""SLCAN lines: what we send python-can reads, what any board sends we survive."""

from __future__ import annotations

import can
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


@pytest.mark.parametrize(
    ("now_s", "stamp_ms", "expected_s"),
    [
        (10.0, 9_980, 9.98),
        (60.0, 59_990, 59.99),
        (60.01, 5, 60.005),
        (3600.002, 59_999, 3599.999),
        (10.0, 10_020, 10.02),  # the board's clock a little ahead
    ],
)
def test_time_stamps_are_unwrapped_to_the_last_minute(
    now_s: float, stamp_ms: int, expected_s: float
) -> None:
    (frame,) = SlcanParser().feed(line(0x100, b"\0" * 8, stamp_ms), now_s)
    assert frame.time_s == pytest.approx(expected_s, abs=1e-9)


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
