"""How a long prediction is carried out: where results are kept, and who watches and may stop it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Event, Lock
from typing import TYPE_CHECKING

from rig.mechanics.store import NoStore, Store

if TYPE_CHECKING:
    from rig.mechanics.fe import Progress

Watch = Callable[[str, "Progress"], bool]
"""Told what is computed and how far it got; answers False to stop it."""


@dataclass(frozen=True)
class Job:
    """Keeps nothing and goes unwatched unless told otherwise."""

    store: Store = field(default_factory=NoStore)
    watch: Watch | None = None

    def telling(self, what: str) -> Callable[[Progress], bool] | None:
        """What a path reports its progress to."""
        watch = self.watch
        return None if watch is None else lambda progress: watch(what, progress)


class SharedWatch:
    """The watch of several calculations at once: they tell it in turn, and it can stop them."""

    def __init__(self, watch: Watch | None) -> None:
        """In front of another watch, if there is one."""
        self._watch = watch
        self._stopped = Event()
        self._turn = Lock()

    def __call__(self, what: str, progress: Progress) -> bool:
        """What the other watch answers, or False after `stop`."""
        with self._turn:
            if self._stopped.is_set():
                return False
            return self._watch is None or self._watch(what, progress)

    def stop(self) -> None:
        """Let every calculation end after its current step."""
        self._stopped.set()
