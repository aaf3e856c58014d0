"""A simulated board on a pseudo-terminal, in real time: a serial port without hardware.

Any SLCAN program can open it; here wall time is the point, so it is read at this edge.
"""

from __future__ import annotations

import contextlib
import os
import pty
import select
import time
import tty
from collections.abc import Callable

from rig.board.simulated import SimulatedBoard

SLICE_S = 0.005
"""How often bytes move, in wall time."""


class PtyServer:
    """Serves a board at `port` until told to stop."""

    def __init__(self, board: SimulatedBoard) -> None:
        self._board = board
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.port = os.ttyname(self._slave)

    def serve(self, until: Callable[[], bool]) -> None:
        """Keep the board in step with wall time until `until()` is true."""
        start_s = time.monotonic() - self._board.now_s
        while not until():
            readable, _, _ = select.select([self._master], [], [], SLICE_S)
            if readable:
                self._board.write(self._read())
            behind_s = time.monotonic() - start_s - self._board.now_s
            if behind_s >= 0.001:
                self._write(self._board.read(behind_s))

    def _read(self) -> bytes:
        try:
            return os.read(self._master, 4096)
        except OSError:  # the other end closed the port; it may open it again
            time.sleep(SLICE_S)
            return b""

    def _write(self, data: bytes) -> None:
        # when nobody reads, bytes are lost as on a serial line
        with contextlib.suppress(BlockingIOError):
            os.write(self._master, data)

    def close(self) -> None:
        """Release the pseudo-terminal."""
        os.close(self._master)
        os.close(self._slave)
