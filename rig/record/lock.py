"""One writer a run folder: a lock that the operating system drops when the process dies."""

from __future__ import annotations

import os
from pathlib import Path

from rig.record.errors import RecordError

try:
    import fcntl
except ImportError:  # Windows has no flock; a second writer is not noticed there
    fcntl = None  # type: ignore[assignment]


class FolderLock:
    """Holds the run folder for one writer until `release` or the end of the process."""

    def __init__(self, folder: Path) -> None:
        self._descriptor: int | None = None
        if fcntl is None:
            return
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(descriptor)
            raise RecordError(
                f"{folder}: another process is writing this run. Wait until it has ended, or end "
                f"it, and then repeat the command."
            ) from None
        self._descriptor = descriptor

    def release(self) -> None:
        """Let go; harmless when repeated."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
