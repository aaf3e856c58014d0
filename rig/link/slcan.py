"""SLCAN (Lawicel ASCII) framing: CAN frames as text lines over a serial line, parsed in bulk.

A data frame is `tIIILDD..DD` and, with time stamps on (`Z1`), four hexadecimal digits of
milliseconds modulo 60,000; a line ends with a carriage return.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

TIMESTAMP_PERIOD_MS = 60_000
CLOCK_WINDOW_MS = 10_000
EARLIEST_MS, LATEST_MS = -100, 5_000
"""A stamp that puts its frame further off than this is damaged: no checksum protects it."""
MOST_DAMAGED = 10
"""After so many such stamps in a row it is the board's clock that started anew."""
OPEN_WITH_TIMESTAMPS = b"\rC\rS6\rZ1\rO\rZ1\r"
"""Stamps are asked for again at the end: a board that is just starting may miss any beginning."""
CLOSE = b"C\r"
BELL = b"\a"
"""The answer to a line that makes no sense, and to a frame while the channel is closed."""
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


class BoardClock:
    """Maps the board's time stamps to bench time, though the two clocks start and drift apart.

    A frame arrives some latency after its stamp; the quickest frame of the last ten to twenty
    seconds is taken to have had none. A frame whose stamp cannot be has the time of its arrival.
    """

    def __init__(self) -> None:
        self._reference_ms: float | None = None
        self._quickest_ms = 0.0
        self._quickest_before_ms = 0.0
        self._window_ends_ms = 0.0
        self._damaged = 0

    def times_s(self, now_ms: float, stamps_ms: Sequence[int]) -> list[float]:
        """Bench times in seconds of frames that arrive now with these stamps."""
        if not stamps_ms:
            return []
        apart = [now_ms - stamp for stamp in stamps_ms]
        if self._reference_ms is None:
            self._reference_ms = min(apart, key=lambda ms: ms % TIMESTAMP_PERIOD_MS)
            self._window_ends_ms = now_ms + CLOCK_WINDOW_MS
        reference, half = self._reference_ms, TIMESTAMP_PERIOD_MS / 2
        late = [(ms - reference + half) % TIMESTAMP_PERIOD_MS - half for ms in apart]
        quickest = min(self._quickest_ms, self._quickest_before_ms)
        sound = [ms for ms in late if EARLIEST_MS <= ms - quickest <= LATEST_MS]
        if not sound:
            return self._doubt(now_ms, stamps_ms)
        self._damaged = 0
        if now_ms > self._window_ends_ms:
            self._window_ends_ms = now_ms + CLOCK_WINDOW_MS
            self._quickest_before_ms, self._quickest_ms = self._quickest_ms, min(sound)
        self._quickest_ms = min(self._quickest_ms, *sound)
        quickest = min(self._quickest_ms, self._quickest_before_ms)
        return [(now_ms - (ms - quickest if ms in sound else 0.0)) / 1000 for ms in late]

    def _doubt(self, now_ms: float, stamps_ms: Sequence[int]) -> list[float]:
        """Times of frames none of whose stamps can be."""
        self._damaged += len(stamps_ms)
        if self._damaged <= MOST_DAMAGED:
            return [now_ms / 1000] * len(stamps_ms)
        self._reference_ms, self._damaged = None, 0
        self._quickest_ms = self._quickest_before_ms = 0.0
        return self.times_s(now_ms, stamps_ms)


@dataclass
class SlcanParser:
    """Turns received bytes into frames; keeps the incomplete line for the next call.

    Lines that are no data frame (command replies, noise) are skipped; malformed frames count in
    `malformed`.
    """

    malformed: int = 0
    _rest: bytes = b""
    _clock: BoardClock = field(default_factory=BoardClock)

    def forget_clock(self) -> None:
        """Time stamps may start anew: the board may have."""
        self._clock = BoardClock()

    def feed(self, data: bytes, now_s: float) -> list[RawFrame]:
        """Frames completed by `data`, which arrived at bench time `now_s`."""
        lines = (self._rest + data).split(b"\r")
        self._rest = lines.pop()
        if len(self._rest) > MAX_LINE:
            self.malformed += 1
            self._rest = b""
        frames: list[tuple[int, bytes]] = []
        stamps: list[int | None] = []
        for line in lines:
            start = line.rfind(b"t")  # before it: replies to our own commands, bells, noise
            if start < 0:
                continue
            line = line[start:]
            try:
                frame_id = int(line[1:4], 16)
                end = 5 + 2 * int(line[4:5], 16)
                payload = bytes.fromhex(line[5:end].decode("ascii"))
                stamp = line[end:]
                if len(line) < end or len(stamp) not in (0, 4):
                    raise ValueError("length")
                stamps.append(int(stamp, 16) if stamp else None)
            except ValueError:
                self.malformed += 1
                continue
            frames.append((frame_id, payload))
        times = iter(self._clock.times_s(now_s * 1000, [s for s in stamps if s is not None]))
        return [
            RawFrame(now_s if stamp is None else next(times), *frame)
            for frame, stamp in zip(frames, stamps, strict=True)
        ]
