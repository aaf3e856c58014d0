"""The image of the Mega in the emulator: speed, load of the processor, jitter of the step pulses.

Targets: 40 times real time, no tick later than 2 ms, load below 60 % at 10 kHz, jitter below 10 us.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.board.emulated import FREQUENCY, EmulatedBoard, LoadFigures, StepTimes
from rig.board.emulator_build import firmware_image
from rig.board.virtual import VirtualBench
from rig.link.client import RigLink
from rig.spec.workspace import Workspace
from tests.benches import with_beam_specimen

ROOT = Path(__file__).resolve().parents[2]
TICK_CYCLES = 32_000
FLOW_OF_10_KHZ_ML_S = 3.4994
"""10 000 steps a second of the default volume per step."""
JITTER_BINS_US = (0, 1, 2, 3, 5, 7, 10, 20, 1000)


@dataclass(frozen=True)
class Stretch:
    """What was measured while the board did one thing."""

    name: str
    load: LoadFigures
    pulses_per_s: float
    times_real_time: float
    steps: StepTimes


class Measurement:
    """An emulated bench, homed and zeroed, on which stretches are measured."""

    def __init__(self) -> None:
        self.bench = VirtualBench(
            with_beam_specimen(Workspace(ROOT).setup("bellow-bending", "emulated")), 1
        )
        assert isinstance(self.bench.board, EmulatedBoard)
        self.board = self.bench.board
        self.link = RigLink(self.bench.bus)
        self.link.open()
        self.link.command("home")
        self.link.await_state("idle", 30.0)
        self.link.command("zero_pressure")
        self.link.wait(1.5)

    def stretch(self, name: str, duration_s: float, meanwhile: Callable[[], None]) -> Stretch:
        """Measure `duration_s`, with `meanwhile` called each 0.25 s."""
        pulses = self.board.stepper_figures().pulses
        self.board.restart_load_figures()
        self.board.log_steps(1_000_000)
        began_s, began_cpu_s = self.board.now_s, time.process_time()
        while self.board.now_s - began_s < duration_s:
            meanwhile()
            self.link.wait(0.25)
        lasted_s = self.board.now_s - began_s
        cpu_s = time.process_time() - began_cpu_s
        pulses = self.board.stepper_figures().pulses - pulses
        return Stretch(
            name,
            self.board.load_figures(),
            pulses / lasted_s,
            lasted_s / cpu_s,
            self.board.logged_steps(),
        )

    def nothing(self) -> None:
        """Leave the board alone."""

    def jog(self) -> None:
        """Push on at 10 kHz."""
        self.link.command("jog", FLOW_OF_10_KHZ_ML_S)


def stretches() -> list[Stretch]:
    """The states that a characterisation is made of, and steps at 10 kHz."""
    m = Measurement()
    idle = m.stretch("idle", 5.0, m.nothing)
    m.jog()
    m.link.wait(0.25)
    jog = m.stretch("jog at 10 kHz", 2.0, m.jog)
    m.link.command("vent")
    m.link.await_state("idle", 30.0)
    m.link.write_parameter("setpoint_rate_kpa_s", 3.65)
    m.link.command("set_pressure", 10.0)
    m.link.wait(0.5)
    ramp = m.stretch("run, rising", 2.0, m.nothing)
    m.link.wait(4.0)
    held = m.stretch("run, held at 10 kPa", 10.0, m.nothing)
    return [idle, jog, ramp, held]


def deviations_us(steps: StepTimes) -> np.ndarray:
    """Of the intervals between pulses from their median, while it runs steadily."""
    intervals = np.diff(steps.rose)
    return np.abs(intervals - np.median(intervals)) * 1e6


def main() -> None:
    """Print the tables."""
    print(subprocess.run(["avr-size", firmware_image()], capture_output=True, text=True).stdout)
    measured = stretches()
    print("state                  load %   kHz  tick: mean  worst  share of 2 ms %   x real time")
    for s in measured:
        print(
            f"{s.name:<22}{100 * s.load.busy:>7.1f}{s.pulses_per_s / 1e3:>6.2f}"
            f"{s.load.mean_response:>12.0f}{s.load.most_response:>7d}"
            f"{100 * s.load.most_response / TICK_CYCLES:>17.1f}{s.times_real_time:>14.1f}"
        )
    print("\ninterrupt, cycles           count      mean     worst    worst us")
    for i in measured[2].load.interrupts:
        print(
            f"{i.name:<22}{i.count:>11d}{i.cycles / i.count:>10.0f}{i.most:>10d}"
            f"{i.most / FREQUENCY * 1e6:>12.2f}"
        )
    jog = measured[1].steps
    late_us = (jog.rose - jog.due) * 1e6
    off_us = deviations_us(jog)
    print(f"\nsteps at 10 kHz: {len(jog.rose)} pulses; microseconds")
    print(f"  behind the timer: median {np.median(late_us):.2f}, worst {late_us.max():.2f}")
    print(
        f"  interval off its median: 99 % {np.quantile(off_us, 0.99):.2f}, worst {off_us.max():.2f}"
    )
    counts, _ = np.histogram(off_us, JITTER_BINS_US)
    for low, high, count in zip(JITTER_BINS_US, JITTER_BINS_US[1:], counts, strict=False):
        print(f"  {low:>4} to {high:<5}{count:>8d}")
