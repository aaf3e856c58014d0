"""Ctrl-C during a run asks the experiment to stop safely; only insisting forces it."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from rig.experiment.errors import AbortedError

PATIENCE = 3
"""Signals that are taken as a request; venting a real bench takes some seconds."""


class Interruption:
    """Whether somebody asked to stop; ask it with `check` where stopping is safe."""

    def __init__(self, doing: str = "stopping and venting") -> None:
        self._doing = doing
        self._signal: int | None = None
        self._count = 0

    def note(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal; only impatience beyond PATIENCE raises KeyboardInterrupt."""
        del frame
        self._signal = self._signal or number
        self._count += 1
        if self._count > PATIENCE:
            raise KeyboardInterrupt
        left = PATIENCE + 1 - self._count
        hint = f"{self._doing}; {left} more to give up on that"
        # a handler may run inside any print: write to the descriptor, not to the stream
        with contextlib.suppress(OSError):
            os.write(2, f"\nrig: {hint}\n".encode())

    @property
    def requested(self) -> bool:
        """Whether somebody asked to stop."""
        return self._signal is not None

    def check(self) -> None:
        """Raise AbortedError if somebody asked to stop."""
        if self._signal is not None:
            name = signal.Signals(self._signal).name
            raise AbortedError(f"stopped on request ({name}).")


@contextmanager
def catching_signals(doing: str = "stopping and venting") -> Iterator[Interruption]:
    """SIGINT and SIGTERM go to the Interruption inside; `doing` is what the first one is told."""
    interruption = Interruption(doing)
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, interruption.note) for number in numbers]
    try:
        yield interruption
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
