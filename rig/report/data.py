"""Everything the report needs of a run, read once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.record.documents import ExperimentName, PointDocument, PointKey
from rig.record.reader import RunReader
from rig.spec.protocol import SweepProtocol
from rig.spec.workspace import Setup

Array = NDArray[np.float64]
EXPERIMENTS: tuple[ExperimentName, ...] = ("deformation", "blocked_force")


@dataclass(frozen=True)
class Trace:
    """Pressure over bench time; all arrays (n,), ascending in time."""

    time_s: Array
    pressure_kpa: Array
    setpoint_kpa: Array

    def between(self, from_s: float, to_s: float) -> Trace:
        """The part from `from_s` to `to_s`, both included."""
        # Half a microsecond: times went through whole nanoseconds.
        first = int(np.searchsorted(self.time_s, from_s - 5e-7))
        last = int(np.searchsorted(self.time_s, to_s + 5e-7))
        part = slice(first, last)
        return Trace(self.time_s[part], self.pressure_kpa[part], self.setpoint_kpa[part])


@dataclass(frozen=True)
class RunData:
    """A run's documents, set-up and pressure."""

    reader: RunReader
    setup: Setup
    points: tuple[PointDocument, ...]
    trace: Trace

    def points_of(self, experiment: ExperimentName) -> list[PointDocument]:
        """Points of one experiment in the order of measurement."""
        return [point for point in self.points if point.key.experiment == experiment]

    def section(self, experiment: ExperimentName) -> SweepProtocol | None:
        """The protocol's section of an experiment; None if it has none."""
        protocol = self.setup.protocol
        return protocol.deformation if experiment == "deformation" else protocol.blocked_force

    def quantity(self, experiment: ExperimentName) -> str:
        """What an experiment measures, in prose."""
        measurand = self.setup.actuator.measurand
        return measurand.quantity if experiment == "deformation" else "blocked force"

    def unit(self, experiment: ExperimentName) -> str:
        """Unit of what it measures."""
        return self.setup.actuator.measurand.unit if experiment == "deformation" else "g"

    @cached_property
    def highest_kpa(self) -> float:
        """Highest pressure that any measured point asked for or reached."""
        reached = [max(p.pressure_kpa, p.key.target_kpa) for p in self.points]
        return max(reached, default=0.0)


def load_run(reader: RunReader) -> RunData:
    """Read what the report needs.

    Raises RecordError for a damaged log and SpecError for attachments that are missing or broken.
    """
    return RunData(
        reader=reader,
        setup=reader.setup(),
        points=reader.points(),
        trace=_trace(reader.telemetry("PRESSURE")),
    )


def _trace(telemetry: dict[str, NDArray[Any]]) -> Trace:
    time_s = telemetry["time_s"]
    order = np.argsort(time_s, kind="stable")
    _, first = np.unique(time_s[order], return_index=True)
    chosen = order[first]
    none = np.full(time_s.size, np.nan)
    return Trace(
        time_s[chosen],
        telemetry.get("pressure_kpa", none)[chosen],
        telemetry.get("setpoint_kpa", none)[chosen],
    )


def planned_points(section: SweepProtocol) -> int:
    """Number of points that a protocol asks for in one experiment."""
    levels = len(section.pressures.values())
    return section.repeats * levels + section.descending_repeats * (levels - 1)


def by_level(points: Iterable[PointDocument]) -> dict[tuple[str, float], list[PointDocument]]:
    """Points with a value by direction and target pressure: up first, ascending."""
    groups: dict[tuple[str, float], list[PointDocument]] = {}
    for point in points:
        if point.value is not None:
            groups.setdefault((point.key.direction, point.key.target_kpa), []).append(point)
    return dict(sorted(groups.items(), key=lambda item: (item[0][0] != "up", item[0][1])))


def describe(key: PointKey) -> str:
    """A point in words."""
    return f"{key.target_kpa:g} kPa, repeat {key.repeat}, {key.direction}"
