"""Ctrl-C during a run: the first asks the experiment to stop safely, the second forces it."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from rig.experiment.errors import AbortedError


class Interruption:
    """Whether somebody asked to stop; ask it with `check` where stopping is safe."""

    def __init__(self) -> None:
        self._signal: int | None = None

    def note(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal; raises KeyboardInterrupt when it comes a second time."""
        del frame
        if self._signal is not None:
            raise KeyboardInterrupt
        self._signal = number

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
def catching_signals() -> Iterator[Interruption]:
    """SIGINT and SIGTERM go to the Interruption inside."""
    interruption = Interruption()
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, interruption.note) for number in numbers]
    try:
        yield interruption
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
