"""Injects a fault script into a simulated bench, in virtual time, and witnesses what follows.

The line between host and board is where time passes, so it is what watches the clock: it advances
the board in slices, begins and ends faults between them, and spoils bytes if it is told to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.board.disturbance import Disturbance, LineHistory, disturbance_of
from rig.board.simulated import SimulatedBoard
from rig.link.schema import load_schema
from rig.link.slcan import SlcanParser
from rig.plant.parameters import REFERENCE_LEAK_PRESSURE
from rig.plant.plant import Faults, Plant, Switch, Truth
from rig.spec.faults import (
    AnyFault,
    BoardFault,
    ClockAhead,
    EmergencyStop,
    Leak,
    LoadCellBadWords,
    LoadCellReversed,
    LoadCellSilent,
    LoadCellStuck,
    MotorFault,
    SensorDrift,
    SensorFault,
    SensorSpike,
    SwitchFault,
    TubeFault,
)

SLICE_MS = 10
FINE_SLICE_MS = 1
FINE_S = 2.0
"""For so long after a fault the board is watched every millisecond."""
SUPPLY_GONE_S = 0.05
"""How long a brown-out lasts that says nothing else."""
PRESSURISED = 0.5e3
"""Gauge pressure in Pa above which an actuator does not count as vented."""


@dataclass(frozen=True)
class Report:
    """A fault code that the board reported, and the bench time at which it did."""

    time_s: float
    code: str


class Witness:
    """Reads what the board says, whatever the line does to it afterwards."""

    def __init__(self) -> None:
        self._schema = load_schema()
        self._parser = SlcanParser()
        self._states = self._schema.choices("HEARTBEAT", "state")
        self._codes = self._schema.choices("HEARTBEAT", "fault_code")
        self.state = ""
        self.reports: list[Report] = []
        """Each code when it was first reported, and again whenever it changed."""

    def watch(self, data: bytes, now_s: float) -> None:
        """Take note of what the board sent until `now_s`."""
        for frame in self._parser.feed(data, now_s):
            decoded = self._schema.decode(frame.frame_id, frame.payload)
            if decoded is None:
                continue
            name, values = decoded
            if name == "HEARTBEAT":
                self.state = self._states.get(int(values["state"]), "unknown")
                self._note(now_s, int(values["fault_code"]))
            elif name == "FAULT":
                self._note(now_s, int(values["code"]))

    def _note(self, now_s: float, code: int) -> None:
        name = self._codes.get(code, "unknown")
        last = self.reports[-1].code if self.reports else "none"
        if name != last:
            self.reports.append(Report(now_s, name))


@dataclass
class Injection:
    """One fault of the script: when its moment came, when it began and ended; None: not yet."""

    fault: AnyFault
    ready_s: float | None = None
    began_s: float | None = None
    ended_s: float | None = None
    valve_was_open: bool = True
    disturbance: Disturbance | None = None

    @property
    def active(self) -> bool:
        """Whether it has begun and not ended."""
        return self.began_s is not None and self.ended_s is None

    @property
    def next_s(self) -> float | None:
        """Bench time at which it begins or ends; None if that is not known, or over."""
        if self.began_s is None:
            return None if self.ready_s is None else self.ready_s + self.fault.delay
        if self.ended_s is None and self.fault.lasts is not None:
            return self.began_s + self.fault.lasts
        return None


class FaultyLine:
    """A byte transport to `board` that injects `faults` as its time passes.

    `seed` is of the noise on the line.
    """

    def __init__(
        self, board: SimulatedBoard, plant: Plant, faults: Sequence[AnyFault], seed: int
    ) -> None:
        self._board = board
        self._plant = plant
        self._random = np.random.default_rng([seed, 0x11E])
        self._history = LineHistory()
        self._owed_ms = 0.0
        self._waiting = b""  # spoilt bytes of earlier slices
        self.injections = [Injection(fault) for fault in faults]
        self.witness = Witness()
        self.pressurised_s = 0.0
        """Bench time at which anything was last seen above PRESSURISED."""
        self._update()

    @property
    def name(self) -> str:
        """The board's."""
        return self._board.name

    @property
    def now_s(self) -> float:
        """Bench time in seconds."""
        return self._board.now_s

    @property
    def truth(self) -> Truth:
        """What is really so now."""
        return self._plant.truth()

    @property
    def valve_opened_s(self) -> float:
        """Bench time at which the closed valve was last opened."""
        truth = self._plant.truth()
        return truth.valve_opened + self._board.now_s - truth.time

    def write(self, data: bytes) -> None:
        """Bytes from the host, as far as the line lets them pass."""
        self._history.add(self.now_s, data)
        for disturbance in self._disturbances():
            data = disturbance.to_board(data)
        self._board.write(data)

    def read(self, duration_s: float) -> bytes:
        """Let `duration_s` pass; return the bytes that reached the host."""
        self._owed_ms += duration_s * 1000
        left_ms = max(1, round(self._owed_ms))
        self._owed_ms -= left_ms
        received = b""
        while left_ms > 0:
            slice_ms = min(left_ms, self._slice_ms())
            left_ms -= slice_ms
            for disturbance in self._disturbances():
                self._board.write(disturbance.besides(slice_ms / 1000))
            data = self._board.read(slice_ms / 1000)
            self.witness.watch(data, self.now_s)
            for disturbance in self._disturbances():
                data = disturbance.to_host(data, slice_ms / 1000)
            received += data
            self._update()
        return received

    def close(self) -> None:
        """Release the board."""
        self._board.close()

    def _disturbances(self) -> list[Disturbance]:
        return [i.disturbance for i in self.injections if i.active and i.disturbance is not None]

    def _slice_ms(self) -> int:
        now_s = self.now_s
        fresh = any(i.began_s is not None and now_s - i.began_s < FINE_S for i in self.injections)
        slice_ms = FINE_SLICE_MS if fresh else SLICE_MS
        due = [round(1000 * (i.next_s - now_s)) for i in self.injections if i.next_s is not None]
        return max(1, min([slice_ms, *due]))

    def _update(self) -> None:
        """Begin and end what is due."""
        now_s, truth = self.now_s, self._plant.truth()
        if max(truth.gauge_pressure, truth.actuator_pressure) > PRESSURISED:
            self.pressurised_s = now_s
        changed = False
        for injection in self.injections:
            if injection.ready_s is None and self._has_come(injection.fault, now_s, truth):
                injection.ready_s = now_s
            due_s = injection.next_s
            if due_s is None or now_s < due_s - 1e-9:
                continue
            changed = True
            if injection.began_s is None:
                injection.began_s = now_s
                injection.valve_was_open = truth.valve_open
                injection.disturbance = disturbance_of(
                    injection.fault, now_s, self._history, self._random
                )
                self._break_board(injection.fault)
            else:
                injection.ended_s = now_s
        if changed:
            self._plant.set_faults(plant_faults([i.fault for i in self.injections if i.active]))

    def _has_come(self, fault: AnyFault, now_s: float, truth: Truth) -> bool:
        when = fault.when
        return (
            now_s >= when.time - 1e-9
            and (when.state is None or self.witness.state == when.state)
            and (when.above is None or truth.gauge_pressure > when.above)
        )

    def _break_board(self, fault: AnyFault) -> None:
        if isinstance(fault, ClockAhead):
            self._board.read(fault.by)
        elif isinstance(fault, BoardFault):
            if fault.kind == "brown_out":
                self._board.brown_out(fault.lasts or SUPPLY_GONE_S)
            elif fault.kind == "watchdog_reset":
                self._board.hang()
            else:
                self._board.corrupt_parameters()


def plant_faults(faults: Sequence[AnyFault]) -> Faults:
    """The state of a plant that has all these faults; faults of line and board leave no trace."""
    changes: dict[str, float] = {}
    for fault in faults:
        if isinstance(
            fault, SensorFault | TubeFault | EmergencyStop | LoadCellSilent | LoadCellReversed
        ):
            changes[fault.kind] = True
        elif isinstance(fault, SensorSpike):
            changes["spike_voltage"] = fault.voltage
        elif isinstance(fault, SensorDrift):
            changes["drift_rate"] = fault.rate
        elif isinstance(fault, Leak):
            changes["leak_conductance"] = fault.flow / REFERENCE_LEAK_PRESSURE
        elif isinstance(fault, MotorFault):
            changes["lost_steps"] = fault.share
        elif isinstance(fault, LoadCellBadWords):
            changes["bad_words"] = fault.share
        elif isinstance(fault, LoadCellStuck):
            changes |= {"hx711_stuck": True, "hx711_word": fault.word}
        elif isinstance(fault, SwitchFault):
            stuck = Switch.STUCK_OPEN if fault.shows == "open" else Switch.STUCK_CLOSED
            changes[fault.kind.removesuffix("_stuck")] = stuck
    return Faults(**changes)  # type: ignore[arg-type]
