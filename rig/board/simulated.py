"""What the native and the emulated board share: a byte transport in simulated time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

BUFFER_BYTES = 1 << 16
STRETCH_MS = 20
"""At most so much is simulated between two looks of a witness."""


class SteppedBench(Protocol):
    """A bench in C: a function that advances it by 1 ms (a rig_bench_fn), and its object."""

    @property
    def step_address(self) -> int:
        """Address of the function."""
        ...

    @property
    def state_address(self) -> int:
        """Address of the object to hand to it."""
        ...


class SimulatedBoard(ABC):
    """A board wired to a bench; both advance together while somebody reads.

    `after_poll` runs after each stretch of simulated time, for the truth file.
    """

    name: str

    def __init__(self, start_s: float, after_poll: Callable[[], None] | None) -> None:
        self._start_s = start_s
        self._after_poll = after_poll
        self._owed_ms = 0.0
        self.witness: Callable[[], None] | None = None
        """Is called at least every `STRETCH_MS` of simulated time."""

    @property
    def now_s(self) -> float:
        """Bench time in seconds: `start_s` plus the time simulated so far."""
        return self._start_s + self._time_ms() / 1000

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Bytes from the host to the board."""

    def read(self, duration_s: float) -> bytes:
        """Simulate `duration_s`; return the bytes that the board sent."""
        self._owed_ms += duration_s * 1000
        milliseconds = max(1, round(self._owed_ms))
        self._owed_ms -= milliseconds
        self._run_witnessed(milliseconds)
        if self._after_poll is not None:
            self._after_poll()
        data = b""
        while part := self._take():
            data += part
        return data

    def _run_witnessed(self, milliseconds: int) -> None:
        if self.witness is None:
            self._run(milliseconds)
            return
        while milliseconds > 0:
            stretch = min(milliseconds, STRETCH_MS)
            self._run(stretch)
            milliseconds -= stretch
            self.witness()

    @abstractmethod
    def brown_out(self, dead_s: float) -> None:
        """The supply is gone for `dead_s`, then the board starts anew."""

    @abstractmethod
    def hang(self) -> None:
        """The main loop stops where it is; the watchdog restarts the board."""

    @abstractmethod
    def corrupt_parameters(self) -> None:
        """Flip a bit of the stored parameters; they are read at the next start."""

    def close(self) -> None:  # noqa: B027 (nothing to release is the rule)
        """Nothing to release."""

    @abstractmethod
    def _time_ms(self) -> int:
        """Milliseconds simulated so far."""

    @abstractmethod
    def _run(self, milliseconds: int) -> None:
        """Advance board and bench."""

    @abstractmethod
    def _take(self) -> bytes:
        """Some of the bytes that the board sent; none left: empty."""
