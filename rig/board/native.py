"""The firmware's core compiled for this machine, as a byte transport in simulated time.

Firmware and bench advance together in C, 1 ms a step; Python sees only the serial line.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from rig.board._firmware import ffi, lib

RESET_POWER_ON = 1
BUFFER_BYTES = 1 << 16


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


class NativeBoard:
    """Native firmware wired to a bench that C code advances.

    `after_poll` runs after each stretch of simulated time, for the truth file.
    """

    name = "the virtual board"

    def __init__(
        self,
        bench: SteppedBench,
        *,
        firmware_git: int = 0,
        start_s: float = 0.0,
        after_poll: Callable[[], None] | None = None,
    ) -> None:
        self._keep = bench  # the C object must outlive the firmware that steps it
        self._step = ffi.cast("rig_bench_fn", bench.step_address)
        self._bench = ffi.cast("void *", bench.state_address)
        self._host: Any = ffi.gc(lib.rig_host_new(firmware_git, RESET_POWER_ON), lib.rig_host_free)
        self._start_s = start_s
        self._buffer = ffi.new("uint8_t[]", BUFFER_BYTES)
        self._after_poll = after_poll
        self._owed_ms = 0.0

    @property
    def now_s(self) -> float:
        """Bench time in seconds: `start_s` plus the time simulated so far."""
        return self._start_s + float(lib.rig_host_time_ms(self._host)) / 1000

    def write(self, data: bytes) -> None:
        """Bytes from the host to the board."""
        lib.rig_host_receive(self._host, data, len(data))

    def read(self, duration_s: float) -> bytes:
        """Simulate `duration_s`; return the bytes that the board sent."""
        self._owed_ms += duration_s * 1000
        milliseconds = max(1, round(self._owed_ms))
        self._owed_ms -= milliseconds
        lib.rig_host_run(self._host, self._step, self._bench, milliseconds, 0)
        if self._after_poll is not None:
            self._after_poll()
        data = b""
        while count := lib.rig_host_transmit(self._host, self._buffer, BUFFER_BYTES):
            data += bytes(ffi.buffer(self._buffer, count))
        return data

    def close(self) -> None:
        """Nothing to release."""
