"""What a person sees of a long calculation: its progress, and that Ctrl-C keeps what it reached."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console

from rig.cli._interruption import catching_signals
from rig.mechanics.job import Job
from rig.mechanics.store import FolderStore

if TYPE_CHECKING:
    from rig.mechanics.fe import Progress

_QUIET_S = 10.0
"""Between lines on what is no terminal."""


@contextmanager
def calculating(console: Console) -> Iterator[Job]:
    """A job that keeps its results in the user's cache and shows its progress on `console`.

    A signal stops it after the current step; what was reached is kept for the next time. Raises
    KeyboardInterrupt at the end if there was one, unless something else is raised anyway.
    """
    with catching_signals("stopping; what was computed is kept") as interruption:
        status = console.status("")
        said = time.monotonic()

        def watch(what: str, progress: Progress) -> bool:
            nonlocal said
            text = (
                f"finite elements, {what}: {progress.pressure / 1e3:.2f} kPa, "
                f"{progress.point + 1} of {progress.points} points"
            )
            status.start()
            status.update(text)
            if not console.is_terminal and time.monotonic() - said > _QUIET_S:
                said = time.monotonic()
                console.print(text, soft_wrap=True)
            return not interruption.requested

        try:
            yield Job(FolderStore.of_user(), watch)
        finally:
            status.stop()
        if interruption.requested:
            raise KeyboardInterrupt
