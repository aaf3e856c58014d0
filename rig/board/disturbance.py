"""What goes wrong on a serial line: each disturbance changes the bytes that pass in one slice.

Bytes to the board come in whole SLCAN lines, as the host writes them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np

from rig.link import e2e, slcan
from rig.link.schema import load_schema
from rig.spec.faults import AnyFault, BitErrors, Flood, Garbage, LineFault, Replay

HISTORY_LINES = 100_000


class Disturbance:
    """A sound line; subclasses spoil it."""

    def to_board(self, data: bytes) -> bytes:
        """What arrives at the board of what the host wrote."""
        return data

    def to_host(self, data: bytes, duration_s: float) -> bytes:
        """What arrives at the host in `duration_s` of what the board sent."""
        del duration_s
        return data

    def besides(self, duration_s: float) -> bytes:
        """What arrives at the board in `duration_s` though the host did not write it."""
        del duration_s
        return b""


class HostSilent(Disturbance):
    """The host hangs: nothing of what it should say is said."""

    def to_board(self, data: bytes) -> bytes:
        """Nothing."""
        del data
        return b""


class CablePulled(Disturbance):
    """Half of what is under way still arrives, in both directions; then nothing."""

    def __init__(self) -> None:
        self._last = {"to_board", "to_host"}

    def to_board(self, data: bytes) -> bytes:
        """Half of the first frame."""
        return self._cut("to_board", data)

    def to_host(self, data: bytes, duration_s: float) -> bytes:
        """Half of the first bytes."""
        del duration_s
        return self._cut("to_host", data)

    def _cut(self, direction: str, data: bytes) -> bytes:
        if not data or direction not in self._last:
            return b""
        self._last.remove(direction)
        return data[: len(data) // 2]


class RandomBytes(Disturbance):
    """Noise among the sound bytes."""

    def __init__(self, rate: float, random: np.random.Generator) -> None:
        self._rate = rate
        self._random = random

    def to_host(self, data: bytes, duration_s: float) -> bytes:
        """With noise at the given rate, somewhere in the middle."""
        cut = int(self._random.integers(len(data) + 1))
        return data[:cut] + self.besides(duration_s) + data[cut:]

    def besides(self, duration_s: float) -> bytes:
        """Noise at the given rate."""
        return self._random.bytes(int(self._random.poisson(self._rate * duration_s)))


class FlippedBits(Disturbance):
    """Single bit errors."""

    def __init__(self, share: float, random: np.random.Generator) -> None:
        self._share = share
        self._random = random

    def to_board(self, data: bytes) -> bytes:
        """With errors."""
        return self._spoil(data)

    def to_host(self, data: bytes, duration_s: float) -> bytes:
        """With errors."""
        del duration_s
        return self._spoil(data)

    def _spoil(self, data: bytes) -> bytes:
        values = np.frombuffer(data, np.uint8).copy()
        hit = self._random.random(len(values)) < self._share
        bits = self._random.integers(8, size=len(values))
        values[hit] ^= (1 << bits[hit]).astype(np.uint8)
        return values.tobytes()


class Reordered(Disturbance):
    """Each frame to the board arrives after the one that was written after it."""

    def __init__(self) -> None:
        self._held = b""

    def to_board(self, data: bytes) -> bytes:
        """The new one, then the one held back."""
        if not self._held:
            self._held = data
            return b""
        out, self._held = data + self._held, b""
        return out


class Replayed(Disturbance):
    """Everything of a stretch of time, once more and all at once."""

    def __init__(self, lines: bytes) -> None:
        self._lines = lines

    def besides(self, duration_s: float) -> bytes:
        """The recorded lines, once."""
        del duration_s
        out, self._lines = self._lines, b""
        return out


class Flooded(Disturbance):
    """Sound requests, faster than anybody needs answers."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._owed = 0.0
        self._sent = 0

    def besides(self, duration_s: float) -> bytes:
        """Requests for the identity, each with its checksum and count."""
        self._owed += self._rate * duration_s
        count, lines = int(self._owed), b""
        self._owed -= count
        for _ in range(count):
            frame_id, payload = load_schema().encode("IDENTITY_REQUEST", {"number": 1})
            lines += slcan.encode_frame(frame_id, e2e.protect(frame_id, payload, self._sent))
            self._sent += 1
        return lines


class LineHistory:
    """What the host wrote, and when."""

    def __init__(self) -> None:
        self._lines: deque[tuple[float, bytes]] = deque(maxlen=HISTORY_LINES)

    def add(self, time_s: float, data: bytes) -> None:
        """Note a write."""
        self._lines.append((time_s, data))

    def between(self, from_s: float, to_s: float) -> bytes:
        """All that was written in a stretch of bench time."""
        return b"".join(data for when, data in self._lines if from_s <= when < to_s)


def disturbance_of(
    fault: AnyFault, now_s: float, history: LineHistory, random: np.random.Generator
) -> Disturbance | None:
    """The disturbance that a fault of the line is; None for a fault of something else."""
    if isinstance(fault, LineFault):
        kinds: dict[str, Callable[[], Disturbance]] = {
            "host_silent": HostSilent,
            "cable_pulled": CablePulled,
            "frames_reordered": Reordered,
        }
        return kinds[fault.kind]()
    if isinstance(fault, Garbage):
        return RandomBytes(fault.rate, random)
    if isinstance(fault, BitErrors):
        return FlippedBits(fault.share, random)
    if isinstance(fault, Replay):
        from_s = now_s - fault.history
        to_s = now_s if fault.length is None else from_s + fault.length
        return Replayed(history.between(from_s, to_s))
    if isinstance(fault, Flood):
        return Flooded(fault.rate)
    return None
