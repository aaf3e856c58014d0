"""What both experiments share: visit a pressure, settle, hold, then measure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.experiment.errors import ExperimentError
from rig.experiment.evaluate import CellReading, Visit
from rig.link.client import Message, RigLink
from rig.link.schema import Schema
from rig.record.documents import PointKey
from rig.spec.calibration import TransducerCalibration
from rig.spec.protocol import Settling, SweepProtocol


def pressures_kpa(messages: Sequence[Message]) -> NDArray[np.float64]:
    """Measured pressures of the messages, kPa."""
    return np.array([m.values["pressure_kpa"] for m in messages if m.name == "PRESSURE"])


def cell_readings(messages: Sequence[Message], schema: Schema) -> list[CellReading]:
    """Load-cell conversions of the messages."""
    statuses = schema.choices("LOAD_CELL", "load_cell_status")
    return [
        CellReading(
            int(m.values["load_cell_counts"]),
            statuses.get(int(m.values["load_cell_status"]), "unknown"),
        )
        for m in messages
        if m.name == "LOAD_CELL"
    ]


def go_to(link: RigLink, target_kpa: float) -> float:
    """Send a set-point; returns the bench time of sending.

    From then on the link raises if the board stops regulating by itself.
    """
    started_s = link.now_s
    link.command("set_pressure", target_kpa)
    link.expect_state("run")
    return started_s


def settle(link: RigLink, target_kpa: float, settling: Settling) -> float:
    """Wait until the pressure has stayed within tolerance for the window.

    Returns the bench time at which that window began; raises ExperimentError on timeout.
    """
    tolerance_kpa = settling.tolerance / 1e3
    end_s = link.now_s + settling.timeout
    inside_since_s: float | None = None
    last_kpa = float("nan")
    while link.now_s < end_s:
        for message in link.receive():
            if message.name != "PRESSURE":
                continue
            last_kpa = float(message.values["pressure_kpa"])
            if abs(last_kpa - target_kpa) > tolerance_kpa:
                inside_since_s = None
            elif inside_since_s is None:
                inside_since_s = message.time_s
            if inside_since_s is not None and message.time_s - inside_since_s >= settling.window:
                return inside_since_s
    raise ExperimentError(
        f"the pressure did not settle at {target_kpa:g} kPa within {settling.timeout:g} s: it is "
        f"at {last_kpa:.3f} kPa, tolerance {tolerance_kpa:g} kPa. Look for a leak, tune the "
        "controller, or widen settling.tolerance of the protocol."
    )


def reach_top(link: RigLink, section: SweepProtocol) -> None:
    """Go to the highest pressure of the protocol and settle there."""
    top_kpa = section.pressures.stop / 1e3
    go_to(link, top_kpa)
    settle(link, top_kpa, section.settling)


def approach(link: RigLink, key: PointKey, section: SweepProtocol) -> None:
    """Reach a point of the descending leg as the sweep would: over the top pressure.

    Needed only when a run is taken up again in the middle of that leg.
    """
    if key.direction == "down":
        reach_top(link, section)
        link.wait(section.hold)


@dataclass(frozen=True)
class Arrival:
    """A point that has settled and been held, about to be measured."""

    key: PointKey
    started_s: float
    settled_s: float
    tolerance_kpa: float
    transducer: TransducerCalibration

    def visit(self, from_s: float, messages: Sequence[Message]) -> Visit:
        """The visit measured since `from_s` by the messages received since then.

        Raises ExperimentError if the pressure was not the point's while it was measured.
        """
        pressure = pressures_kpa(messages)
        if len(pressure) == 0:
            raise ExperimentError(
                f"no pressure telemetry came while measuring at {self.key.target_kpa:g} kPa; "
                "check the link."
            )
        mean_kpa = float(pressure.mean())
        if abs(mean_kpa - self.key.target_kpa) > self.tolerance_kpa:
            raise ExperimentError(
                f"the pressure left {self.key.target_kpa:g} kPa while the point was measured: its "
                f"mean was {mean_kpa:.3f} kPa, tolerance {self.tolerance_kpa:g} kPa. The point was "
                "not recorded. Look for a leak or a disturbance, or widen settling.tolerance."
            )
        return Visit(
            self.key,
            self.started_s,
            self.settled_s,
            from_s,
            messages[-1].time_s,
            pressure,
            self.transducer,
        )
