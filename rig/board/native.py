"""The firmware's core compiled for this machine, as a byte transport in simulated time.

Firmware and bench advance together in C, 1 ms a step; Python sees only the serial line.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rig.board._firmware import ffi, lib
from rig.board.simulated import BUFFER_BYTES, SimulatedBoard, SteppedBench

RESET_POWER_ON, RESET_BROWN_OUT, RESET_WATCHDOG = 1, 3, 4
WATCHDOG_MS, RESET_AFTER_MS = 60, 120
"""When the Mega's watchdog makes a hanging board safe, and when it restarts it."""


class NativeBoard(SimulatedBoard):
    """Native firmware wired to a bench that C code advances."""

    name = "the virtual board"

    def __init__(
        self,
        bench: SteppedBench,
        *,
        firmware_git: int = 0,
        start_s: float = 0.0,
        after_poll: Callable[[], None] | None = None,
    ) -> None:
        super().__init__(start_s, after_poll)
        self._keep = bench  # the C object must outlive the firmware that steps it
        self._step = ffi.cast("rig_bench_fn", bench.step_address)
        self._bench = ffi.cast("void *", bench.state_address)
        self._host: Any = ffi.gc(lib.rig_host_new(firmware_git, RESET_POWER_ON), lib.rig_host_free)
        self._buffer = ffi.new("uint8_t[]", BUFFER_BYTES)

    def write(self, data: bytes) -> None:
        """Bytes from the host to the board."""
        lib.rig_host_receive(self._host, data, len(data))

    def _time_ms(self) -> int:
        return int(lib.rig_host_time_ms(self._host))

    def _run(self, milliseconds: int) -> None:
        lib.rig_host_run(self._host, self._step, self._bench, milliseconds, 0)

    def _take(self) -> bytes:
        count = lib.rig_host_transmit(self._host, self._buffer, BUFFER_BYTES)
        return bytes(ffi.buffer(self._buffer, count))

    def brown_out(self, dead_s: float) -> None:
        """The supply is gone for `dead_s`, then the board starts anew."""
        lib.rig_host_restart(self._host, RESET_BROWN_OUT, 0, round(dead_s * 1000))

    def hang(self) -> None:
        """The main loop stops where it is; the watchdog restarts the board."""
        lib.rig_host_restart(self._host, RESET_WATCHDOG, WATCHDOG_MS, RESET_AFTER_MS)

    def corrupt_parameters(self) -> None:
        """Flip a bit of the non-volatile memory; it is read at the next start."""
        image = ffi.new("uint8_t[]", lib.rig_host_nonvolatile_size())
        lib.rig_host_nonvolatile_store(self._host, image)
        image[len(image) // 2] ^= 1
        lib.rig_host_nonvolatile_load(self._host, image)
