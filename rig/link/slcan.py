"""SLCAN (Lawicel ASCII) framing: CAN frames as text lines over a serial line, parsed in bulk.

A data frame is `tIIILDD..DD` and, with time stamps on (`Z1`), four hexadecimal digits of
milliseconds modulo 60,000; a line ends with a carriage return.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

TIMESTAMP_PERIOD_MS = 60_000
OPEN_WITH_TIMESTAMPS = b"\rC\rS6\rZ1\rO\r"
CLOSE = b"C\r"
MAX_LINE = 64
"""No SLCAN line is longer; what follows without a carriage return is noise."""


class RawFrame(NamedTuple):
    """A CAN frame with the bench time of its reception in seconds."""

    time_s: float
    frame_id: int
    payload: bytes


def encode_frame(frame_id: int, payload: bytes) -> bytes:
    """The SLCAN line of a standard data frame."""
    return b"t%03X%X%s\r" % (frame_id, len(payload), payload.hex().upper().encode())


@dataclass
class SlcanParser:
    """Turns received bytes into frames; keeps the incomplete line for the next call.

    Lines that are no data frame (command replies, noise) are skipped; malformed frames count in
    `malformed`.
    """

    malformed: int = 0
    _rest: bytes = b""

    def feed(self, data: bytes, now_s: float) -> list[RawFrame]:
        """Frames completed by `data`; time stamps are unwrapped to the last minute before now."""
        lines = (self._rest + data).split(b"\r")
        self._rest = lines.pop()
        if len(self._rest) > MAX_LINE:
            self.malformed += 1
            self._rest = b""
        frames: list[RawFrame] = []
        now_ms = round(now_s * 1000)
        for line in lines:
            line = line.lstrip(b"\a\nzZ")  # replies to our own commands, bells
            if line[:1] != b"t":
                continue
            try:
                frame_id = int(line[1:4], 16)
                end = 5 + 2 * int(line[4:5], 16)
                payload = bytes.fromhex(line[5:end].decode("ascii"))
                stamp = line[end:]
                if len(line) < end or len(stamp) not in (0, 4):
                    raise ValueError("length")
                if stamp:
                    age_ms = (now_ms - int(stamp, 16)) % TIMESTAMP_PERIOD_MS
                    # a board clock slightly ahead of ours wraps to almost a minute ago
                    if age_ms > TIMESTAMP_PERIOD_MS - 1000:
                        age_ms -= TIMESTAMP_PERIOD_MS
                    time_s = (now_ms - age_ms) / 1000
                else:
                    time_s = now_s
            except ValueError:
                self.malformed += 1
                continue
            frames.append(RawFrame(time_s, frame_id, payload))
        return frames
