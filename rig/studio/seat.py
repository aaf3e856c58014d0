"""The one seat at the bench: who sits there moves it, the others watch.

The seat is kept by answering: a session that is not heard of for a while has lost it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from rig.studio.errors import StudioError

PATIENCE_S = 3.0
"""Silence of the controlling browser after which its seat is free and the bench is vented."""


class Seat:
    """Safe to use from several threads; `clock` counts seconds."""

    def __init__(self, clock: Callable[[], float], patience_s: float = PATIENCE_S) -> None:
        self._clock = clock
        self._patience_s = patience_s
        self._lock = threading.Lock()
        self._holder: str | None = None
        self._heard_s = 0.0

    @property
    def holder(self) -> str | None:
        """The session that controls the bench."""
        return self._holder

    def take(self, session: str) -> None:
        """Sit down; raises StudioError while another session sits there."""
        with self._lock:
            if self._holder not in (None, session):
                raise StudioError(
                    "another browser controls the bench: you watch. Ask whoever sits there to "
                    "give control back."
                )
            self._holder, self._heard_s = session, self._clock()

    def heard(self, session: str) -> None:
        """The session is still there."""
        with self._lock:
            if self._holder == session:
                self._heard_s = self._clock()

    def release(self, session: str) -> bool:
        """Stand up; whether the session sat there."""
        with self._lock:
            if self._holder != session:
                return False
            self._holder = None
            return True

    def require(self, session: str) -> None:
        """Raise StudioError unless the session controls the bench."""
        if self._holder != session:
            raise StudioError("you only watch this bench: take control first.")

    def lapsed(self) -> bool:
        """Whether the holder fell silent; True once, the seat is free then."""
        with self._lock:
            if self._holder is None or self._clock() - self._heard_s <= self._patience_s:
                return False
            self._holder = None
            return True
