"""The SLCAN bus over a line: when it opens the channel, and when it opens it again."""

from __future__ import annotations

import pytest

from rig.link import slcan
from rig.link.bus import SlcanBus

FRAME = slcan.encode_frame(0x110, bytes(8))


class Line:
    """A serial line that gives what it was given to say, and keeps what was written."""

    name = "the line"
    now_s = 0.0

    def __init__(self) -> None:
        self.says = b""
        self.written: list[bytes] = []

    def write(self, data: bytes) -> None:
        self.written.append(data)

    def read(self, duration_s: float) -> bytes:
        return self.says

    def close(self) -> None:
        """Nothing."""


@pytest.mark.parametrize(
    ("says", "opened"),
    [
        (b"", 1),
        (b"\r\r", 1),
        (FRAME, 1),
        (b"\a\a", 2),
        (b"\a" + FRAME, 1),  # open, but a line of ours was spoilt
    ],
)
def test_the_channel_is_opened_again_where_a_bell_rings_and_nothing_else(
    says: bytes, opened: int
) -> None:
    line = Line()
    bus = SlcanBus(line)
    line.says = says
    bus.poll(0.1)
    assert line.written == [slcan.OPEN_WITH_TIMESTAMPS] * opened
