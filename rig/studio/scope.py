"""What the bench just said, ready to be shown: the last values, and a trace of the pressure."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass

from rig.link import e2e
from rig.link.faults import HINTS
from rig.link.schema import load_schema
from rig.link.slcan import RawFrame

TRACE = 3000
"""Samples that are kept: a minute of telemetry."""
FLAGS = ("homed", "zeroed", "tared", "valve_open", "home_switch", "end_switch", "emergency_stop")

Sample = tuple[int, float, float, float, float]
"""Its number, bench time in s, pressure and set-point in kPa, plunger in mL."""


@dataclass(frozen=True)
class Reading:
    """The board in words and numbers."""

    time_s: float = 0.0
    state: str = "unknown"
    fault: str = "none"
    hint: str = ""
    flags: tuple[str, ...] = ()
    load_cell_counts: float | None = None


class Scope:
    """Fed by the thread of the bench, read by those of the browsers."""

    def __init__(self) -> None:
        schema = load_schema()
        self._schema = schema
        self._states = schema.choices("HEARTBEAT", "state")
        self._faults = schema.choices("HEARTBEAT", "fault_code")
        self._lock = threading.Lock()
        self._frames: deque[RawFrame] = deque(maxlen=TRACE)
        self._trace: deque[Sample] = deque(maxlen=TRACE)
        self._number = 0
        self._reading = Reading()

    def seen(self, frames: list[RawFrame], _now_s: float) -> None:
        """Keep frames; this is all that the link waits for."""
        self._frames.extend(frames)

    def forget(self) -> None:
        """Another bench begins."""
        with self._lock:
            self._frames.clear()
            self._trace.clear()
            self._reading = Reading()

    @property
    def number(self) -> int:
        """Of the newest sample."""
        return self._number

    def reading(self) -> Reading:
        """The last of everything."""
        with self._lock:
            self._take_in()
            return self._reading

    def since(self, number: int) -> list[Sample]:
        """Samples newer than the one with this number, oldest first."""
        with self._lock:
            self._take_in()
            return [sample for sample in self._trace if sample[0] > number]

    def _take_in(self) -> None:
        while self._frames:
            frame = self._frames.popleft()
            if not e2e.is_intact(frame.frame_id, frame.payload):
                continue
            decoded = self._schema.decode(frame.frame_id, frame.payload)
            if decoded is not None:
                self._note(frame.time_s, *decoded)

    def _note(self, time_s: float, name: str, values: dict[str, float | int]) -> None:
        before = self._reading
        if name == "PRESSURE":
            self._number += 1
            self._trace.append(
                (
                    self._number,
                    time_s,
                    float(values["pressure_kpa"]),
                    float(values["setpoint_kpa"]),
                    float(values["plunger_ml"]),
                )
            )
        elif name == "HEARTBEAT":
            fault = self._faults.get(int(values["fault_code"]), "unknown")
            self._reading = Reading(
                time_s=time_s,
                state=self._states.get(int(values["state"]), "unknown"),
                fault=fault,
                hint=HINTS.get(fault, ""),
                flags=tuple(flag.replace("_", " ") for flag in FLAGS if values[flag]),
                load_cell_counts=before.load_cell_counts,
            )
        elif name == "LOAD_CELL":
            self._reading = Reading(
                before.time_s,
                before.state,
                before.fault,
                before.hint,
                before.flags,
                float(values["load_cell_counts"]),
            )
