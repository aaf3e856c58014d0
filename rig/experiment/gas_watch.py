"""Looks over the link's shoulder: a leak found while a run is taken is warned of in its log."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rig.control.gas import ActuatorVolume, GasLine
from rig.control.gas_monitor import GasAlarm, GasMonitor
from rig.experiment.setup import RunRequest
from rig.link.client import Message
from rig.link.slcan import RawFrame
from rig.record.documents import GasDocument

SAMPLE_MESSAGES = 10
"""Pressure messages, 20 ms apart, to a sample: their noise averages out, and samples are white."""
LEAST_SAMPLES = 25
"""A closing shorter than this (5 s) tells too little to be put on record."""
MOST_TRAVEL = 200e-6
"""m3 of strokes, there and back, over which the errors of the model do not yet add up: after
hundreds of cycles the estimated volume was 8 mL off, seventeen times its uncertainty."""
LEAK_PRESSURE = 10e3
"""Pa gauge at which leaks are told, as in bench specs."""
USUAL_CAVITY = 13e-6
"""m3 of the bending bellow, for which the filter's errors by stroke were found; a larger cavity is
off a straight line by as much more."""
LINE_U = 0.1
CAVITY_U = 0.03
SYRINGE_U = 0.003
"""Standard uncertainties of dead volume, cavity and syringe relative to the drawing (guesses)."""

Sample = tuple[float, float, float]
"""Bench time in s, plunger in m3, gauge pressure in Pa."""


@dataclass
class GasWatch:
    """A tap on the link that follows the gas whenever the valve is closed.

    `warn` hears of a leak or burst at its bench time, `note` of what each closing showed.
    """

    make_monitor: Callable[[], GasMonitor]
    warn: Callable[[float, GasAlarm], None]
    note: Callable[[GasDocument], None]
    _monitor: GasMonitor = field(init=False)
    _closed: bool = False
    _pending: list[Sample] = field(default_factory=list)
    _last: Sample | None = None
    _began_s: float = 0.0
    _travel: float = 0.0
    _nis: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.renew()

    def renew(self) -> None:
        """Something else is at the tube's end: forget what was learned of its volume."""
        self._monitor = self.make_monitor()

    def __call__(self, frames: Sequence[RawFrame], messages: Sequence[Message]) -> None:
        """Take a batch."""
        del frames
        for message in messages:
            if message.name == "PRESSURE" and message.values["plausible"]:
                self._pending.append(
                    (
                        message.time_s,
                        message.values["plunger_ml"] * 1e-6,
                        message.values["pressure_kpa"] * 1e3,
                    )
                )
            elif message.name == "HEARTBEAT":
                self._heartbeat(bool(message.values["valve_open"]))

    def _heartbeat(self, valve_open: bool) -> None:
        """Only a heartbeat tells of the valve: what came since the last one waits for it."""
        if valve_open:
            self._end()
            self._pending.clear()
            return
        while len(self._pending) >= SAMPLE_MESSAGES:
            rows = np.array(self._pending[:SAMPLE_MESSAGES])
            del self._pending[:SAMPLE_MESSAGES]
            time_s, plunger, pressure = (float(v) for v in rows.mean(axis=0))
            self._take((time_s, plunger, pressure))

    def _take(self, sample: Sample) -> None:
        time_s, plunger, pressure = sample
        if self._last is None:
            self._monitor.close(plunger, pressure)
            self._began_s = time_s
            self._travel = 0.0
            self._nis.clear()
        else:
            innovation, alarm = self._monitor.step(time_s - self._last[0], plunger, pressure)
            self._nis.append(innovation.nis)
            self._travel += abs(plunger - self._last[1])
            if alarm is not None:
                self.warn(time_s, alarm)
        self._last = sample

    def _end(self) -> None:
        """The valve has opened."""
        if self._last is None:
            return
        estimate = self._monitor.estimate
        enough = len(self._nis) >= LEAST_SAMPLES and self._travel <= MOST_TRAVEL
        if enough and estimate.leak is not None:
            self.note(
                GasDocument(
                    from_s=self._began_s,
                    to_s=self._last[0],
                    gas_ml=estimate.quantity * 1e6,
                    gas_u_ml=estimate.u_quantity * 1e6,
                    actuator_ml=estimate.actuator_volume * 1e6,
                    actuator_u_ml=estimate.u_actuator_volume * 1e6,
                    leak_ml_s=flow_ml_s(estimate.leak.conductance),
                    leak_u_ml_s=flow_ml_s(estimate.leak.u),
                    nis=float(np.mean(self._nis)),
                )
            )
        alarm = self._monitor.open()
        if alarm is not None:
            self.warn(self._last[0], alarm)
        self._last = None


def flow_ml_s(conductance: float) -> float:
    """mL/s that a leak of `conductance` in m3/(s Pa) loses at `LEAK_PRESSURE`."""
    return conductance * LEAK_PRESSURE * 1e6


def describe_alarm(time_s: float, alarm: GasAlarm) -> str:
    """An alarm at bench time `time_s` in words."""
    what = "The actuator or its tube has burst" if alarm.kind == "burst" else "There is a leak"
    leak = alarm.estimate.leak
    size = (
        "the valve opened before its size was known"
        if leak is None or leak.u > leak.conductance
        else f"{flow_ml_s(leak.conductance):.2g} ± {flow_ml_s(2 * leak.u):.1g} mL/s at "
        f"{LEAK_PRESSURE / 1e3:g} kPa (95 %)"
    )
    return (
        f"{what}: {size}, since about {time_s - alarm.since_s:.0f} s of bench time. What the "
        "plunger makes good does not change the pressure, but look at the actuator, the tube and "
        "the valve."
    )


def gas_line(request: RunRequest) -> GasLine:
    """The line from plunger to actuator as its drawings tell."""
    bench = request.setup.bench
    return GasLine(
        ambient_pressure=bench.ambient.pressure,
        line_volume=bench.syringe.volume + _dead_volume(request) + bench.tubing.volume,
        backlash=bench.lead_screw.backlash * math.pi / 4 * bench.syringe.inner_diameter**2,
        stroke_error=GasLine.stroke_error * max(1.0, request.cavity_volume / USUAL_CAVITY),
    )


def gas_monitor(request: RunRequest, line: GasLine | None = None) -> GasMonitor:
    """A monitor of the `line` (default: as drawn) with little knowledge of the actuator yet."""
    u_volume = math.hypot(
        LINE_U * _dead_volume(request),
        CAVITY_U * request.cavity_volume,
        SYRINGE_U * request.setup.bench.syringe.volume,
    )
    return GasMonitor(
        line or gas_line(request),
        ActuatorVolume.of_cavity(request.cavity_volume, u_volume),
        max_flow=request.board_parameters()["max_flow_ml_s"] * 1e-6,
    )


def _dead_volume(request: RunRequest) -> float:
    drive = request.setup.calibrations.syringe
    return request.setup.bench.syringe.dead_volume if drive is None else drive.dead_volume
