"""The Mega's own image, run cycle by cycle in libsimavr against the virtual bench.

Firmware and bench advance together in C; Python sees the serial line, and what the emulator
measured. Built on first use: see `rig.board.emulator_build`. The shipped image is translated into
code of this machine; any other is interpreted, which is the same to the cycle, and slower.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.board.emulator_build import emulator, firmware_image, translated_image
from rig.board.errors import BoardError
from rig.board.simulated import BUFFER_BYTES, SimulatedBoard, SteppedBench

FREQUENCY = 16e6
"""Clock of the Mega in Hz."""
RESET_BROWN_OUT = 3
PARAMETERS_AT = 16
"""Address of the parameters in the EEPROM; parameter_store.cpp of the firmware."""
PARAMETERS_SIZE = 92
VECTORS: Mapping[int, str] = {
    12: "watchdog",
    17: "step (timer 1 A)",
    18: "tick (timer 1 B)",
    25: "byte received",
    26: "byte to send",
    29: "conversion",
}
"""Interrupts of the ATmega2560 that the firmware uses, by vector number."""


@dataclass(frozen=True)
class StepperFigures:
    """Step pulses, and how often they broke the driver's timing limits; times in seconds."""

    pulses: int
    without_current: int
    short_pulses: int
    short_pauses: int
    early_pulses: int
    late_turns: int
    least_pulse: float
    least_pause: float
    least_setup: float
    least_hold: float


@dataclass(frozen=True)
class Hx711Figures:
    """Read-outs of the load-cell converter; `longest_high` of its clock in seconds."""

    words: int
    missed: int
    power_downs: int
    other_gains: int
    longest_high: float


@dataclass(frozen=True)
class InterruptFigures:
    """One interrupt: how often, and how many cycles it took with entry and return."""

    name: str
    count: int
    cycles: int
    most: int


@dataclass(frozen=True)
class LoadFigures:
    """The processor's load; cycles of 62.5 ns.

    A tick's response runs from its interrupt until it is decided and its pins are written; its own
    cycles are those outside interrupts.
    """

    cycles: int
    slept: int
    ticks: int
    mean_response: float
    most_response: int
    mean_own: float
    most_own: int
    interrupts: tuple[InterruptFigures, ...]

    @property
    def busy(self) -> float:
        """Share of the time that the processor does not sleep."""
        return 1 - self.slept / self.cycles


@dataclass(frozen=True)
class StepTimes:
    """Of logged pulses, seconds: when the timer asked for each, and when the pin rose; (n,)."""

    due: NDArray[np.float64]
    rose: NDArray[np.float64]


class EmulatedBoard(SimulatedBoard):
    """An emulated Mega wired to a bench that C code advances.

    `image` is the ELF to run, by default the firmware's. Raises BoardError if the emulator cannot
    be built or the image not be loaded.
    """

    name = "the emulated board"

    def __init__(
        self,
        bench: SteppedBench,
        *,
        image: Path | None = None,
        start_s: float = 0.0,
        after_poll: Callable[[], None] | None = None,
    ) -> None:
        super().__init__(start_s, after_poll)
        module = emulator()
        self._ffi: Any = module.ffi
        self._lib: Any = module.lib
        self._keep = bench  # the C object must outlive the firmware that steps it
        self._step = self._ffi.cast("rig_bench_fn", bench.step_address)
        self._bench = self._ffi.cast("void *", bench.state_address)
        self._buffer = self._ffi.new("uint8_t[]", BUFFER_BYTES)
        path = image or firmware_image()
        problem = self._ffi.new("char[]", 256)
        board = self._lib.rig_emulator_new(str(path).encode(), problem, 256)
        if board == self._ffi.NULL:
            why = self._ffi.string(problem).decode(errors="replace").strip()
            raise BoardError(f"{path} cannot be run as an image of the Mega: {why}")
        self._board = self._ffi.gc(board, self._lib.rig_emulator_free)
        if image is None:
            self._use(translated_image())

    def _use(self, translation: Path) -> None:
        problem = self._ffi.new("char[]", 256)
        if not self._lib.rig_emulator_use(self._board, str(translation).encode(), problem, 256):
            why = self._ffi.string(problem).decode(errors="replace").strip()
            raise BoardError(f"the translated image {translation} cannot be run: {why}")

    def write(self, data: bytes) -> None:
        """Bytes from the host to the board; they arrive at the pace of 115200 baud."""
        self._lib.rig_emulator_receive(self._board, data, len(data))

    def _time_ms(self) -> int:
        return int(self._lib.rig_emulator_time_ms(self._board))

    def _run(self, milliseconds: int) -> None:
        done = self._lib.rig_emulator_run(self._board, self._step, self._bench, milliseconds)
        if done < milliseconds:
            where = self._lib.rig_emulator_program_counter(self._board)
            raise BoardError(
                f"the emulated processor stopped at address {where:#x}, {self.now_s:.3f} s into "
                "the run; a bug of the firmware, or an instruction that libsimavr does not know."
            )

    def _take(self) -> bytes:
        count = self._lib.rig_emulator_transmit(self._board, self._buffer, BUFFER_BYTES)
        return bytes(self._ffi.buffer(self._buffer, count))

    # --- what may go wrong with a board ----------------------------------------

    def brown_out(self, dead_s: float) -> None:
        """The supply is gone for `dead_s`, then the board starts anew."""
        self._lib.rig_emulator_restart(self._board, RESET_BROWN_OUT, round(dead_s * 1000))

    def hang(self) -> None:
        """The main loop stops where it is; the watchdog restarts the board."""
        self._lib.rig_emulator_hang(self._board)

    def corrupt_parameters(self) -> None:
        """Flip a bit of the stored parameters; they are read at the next start."""
        image = bytearray(self.eeprom)
        image[PARAMETERS_AT + PARAMETERS_SIZE // 2] ^= 1
        self.eeprom = bytes(image)

    @property
    def eeprom(self) -> bytes:
        """The whole EEPROM; may be set, raising ValueError for another size."""
        image = self._ffi.new("uint8_t[]", self._lib.rig_emulator_eeprom_size())
        self._lib.rig_emulator_eeprom_store(self._board, image)
        return bytes(self._ffi.buffer(image))

    @eeprom.setter
    def eeprom(self, image: bytes) -> None:
        size = int(self._lib.rig_emulator_eeprom_size())
        if len(image) != size:
            raise ValueError(f"the EEPROM has {size} bytes, this image {len(image)}")
        self._lib.rig_emulator_eeprom_load(self._board, image)

    def hold_load_cell_line(self, level: bool | None) -> None:
        """Hold the HX711's data line low (always ready) or high (never); None sets it free."""
        held = {None: "RIG_LINE_FREE", False: "RIG_LINE_LOW", True: "RIG_LINE_HIGH"}[level]
        self._lib.rig_emulator_hold_hx711(self._board, getattr(self._lib, held))

    def run_plainly(self) -> None:
        """Let libsimavr run every instruction from now on: the same, slower."""
        self._lib.rig_emulator_run_plainly(self._board)

    # --- what the emulator saw --------------------------------------------------

    def trace(self, file: Path) -> None:
        """Write the board's signals to a VCD file from now on; raises BoardError if it cannot."""
        if not self._lib.rig_emulator_trace(self._board, str(file).encode()):
            raise BoardError(f"the trace {file} cannot be written; does its folder exist?")

    def end_trace(self) -> None:
        """Finish the file that `trace` began."""
        self._lib.rig_emulator_end_trace(self._board)

    def stepper_figures(self) -> StepperFigures:
        """What the stepper driver noticed since power-on."""
        f = self._ffi.new("rig_stepper_figures *")
        self._lib.rig_emulator_stepper(self._board, f)
        counts = (f.pulses, f.without_current)
        violations = (f.short_pulses, f.short_pauses, f.early_pulses, f.late_turns)
        cycles = (f.least_pulse, f.least_pause, f.least_setup, f.least_hold)
        return StepperFigures(*counts, *violations, *(c / FREQUENCY for c in cycles))

    def load_cell_figures(self) -> Hx711Figures:
        """What the HX711 noticed since power-on."""
        f = self._ffi.new("rig_hx711_figures *")
        self._lib.rig_emulator_hx711(self._board, f)
        return Hx711Figures(
            f.words, f.missed, f.power_downs, f.other_gains, f.longest_high / FREQUENCY
        )

    def load_figures(self) -> LoadFigures:
        """The processor's load since power-on, or since `restart_load_figures`."""
        f = self._ffi.new("rig_load_figures *")
        self._lib.rig_emulator_load(self._board, f)
        interrupts = tuple(
            InterruptFigures(VECTORS.get(vector, str(vector)), i.count, i.cycles, i.most)
            for vector, i in enumerate(f.interrupts)
            if i.count
        )
        ticks = max(f.ticks, 1)
        return LoadFigures(
            cycles=f.cycles,
            slept=f.slept,
            ticks=f.ticks,
            mean_response=f.response_cycles / ticks,
            most_response=f.most_response,
            mean_own=f.own_cycles / ticks,
            most_own=f.most_own,
            interrupts=interrupts,
        )

    def restart_load_figures(self) -> None:
        """Begin the load figures anew."""
        self._lib.rig_emulator_restart_load(self._board)

    def log_steps(self, capacity: int) -> None:
        """Keep the times of the next `capacity` step pulses."""
        self._lib.rig_emulator_log_steps(self._board, capacity)

    def logged_steps(self) -> StepTimes:
        """The times of the pulses since `log_steps`."""
        due, rose = self._ffi.new("uint64_t **"), self._ffi.new("uint64_t **")
        count = self._lib.rig_emulator_logged_steps(self._board, due, rose)
        return StepTimes(*(self._seconds(values[0], count) for values in (due, rose)))

    def _seconds(self, cycles: Any, count: int) -> NDArray[np.float64]:
        raw = self._ffi.unpack(cycles, count) if count else []
        return np.array(raw, dtype=np.float64) / FREQUENCY
