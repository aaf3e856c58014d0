"""Long work in a process of its own: the pages and the bench go on meanwhile.

The worker says how far it is, and is asked to stop before it is made to: finite elements keep
what they reached.
"""

from __future__ import annotations

import multiprocessing
import pickle
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event
from typing import Any, Literal

from rig.errors import RigError

Tell = Callable[[str], bool]
"""Says how far the work is; answers False once it shall stop."""
Status = Literal["running", "done", "failed", "cancelled"]

GRACE_S = 10.0
"""After this time a worker that was asked to stop is ended."""


@dataclass(frozen=True)
class _Said:
    kind: Literal["progress", "done", "failed"]
    content: Any


class Calculation:
    """`work(tell, *arguments)` in a new process; ask `poll` for how it goes.

    `work` is a function of a module, and `arguments` and its result can be pickled.
    """

    def __init__(self, work: Callable[..., Any], *arguments: Any) -> None:
        context = multiprocessing.get_context("spawn")
        self._heard, said = context.Pipe(duplex=False)
        self._stop: Event = context.Event()
        self._process = context.Process(
            target=_work, args=(said, self._stop, work, arguments), daemon=True
        )
        self._process.start()
        said.close()  # so that its end is noticed here
        self._polling = threading.Lock()
        self._asked_to_stop_s: float | None = None
        self.status: Status = "running"
        self.progress = "starting"
        self.result: Any = None
        self.error = ""

    def poll(self) -> Status:
        """Take in what the worker said; returns the status. Any thread may ask."""
        with self._polling:
            self._take_in()
        return self.status

    def _take_in(self) -> None:
        while self.status == "running" and self._heard.poll():
            try:
                said: _Said = self._heard.recv()
            except (EOFError, OSError, pickle.UnpicklingError):
                self._end("cancelled" if self._asked_to_stop_s is not None else "failed")
                self.error = self.error or "the calculation ended without a word."
                break
            if said.kind == "progress":
                self.progress = said.content
            elif said.kind == "done":
                self.result = said.content
                self._end("cancelled" if self._asked_to_stop_s is not None else "done")
            else:
                self.error = said.content
                self._end("cancelled" if self._asked_to_stop_s is not None else "failed")
        if (
            self.status == "running"
            and self._asked_to_stop_s is not None
            and time.monotonic() - self._asked_to_stop_s > GRACE_S
        ):
            self._process.terminate()
            self._end("cancelled")

    def cancel(self) -> None:
        """Ask the worker to stop after its current step."""
        if self.status == "running" and self._asked_to_stop_s is None:
            self._asked_to_stop_s = time.monotonic()
            self.progress = "stopping after the current step; what was computed is kept"
            self._stop.set()

    def close(self) -> None:
        """End it now."""
        if self._process.is_alive():
            self._process.terminate()
        self._process.join(GRACE_S)
        self._heard.close()
        if self.status == "running":
            self.status = "cancelled"

    def _end(self, status: Status) -> None:
        self.status = status
        self._process.join(GRACE_S)


def _work(
    said: Connection, stop: Event, work: Callable[..., Any], arguments: tuple[Any, ...]
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server: it stops us itself

    def tell(progress: str) -> bool:
        said.send(_Said("progress", progress))
        return not stop.is_set()

    try:
        said.send(_Said("done", work(tell, *arguments)))
    except RigError as error:
        said.send(_Said("failed", str(error)))
    except Exception as error:
        said.send(
            _Said(
                "failed",
                f"This is a defect in rig, not in your design: {type(error).__name__}: {error}",
            )
        )
