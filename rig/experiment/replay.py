"""Recompute a run from its log alone: vision from the recorded images, force from the telemetry.

The same evaluation as in the live run, so an intact log gives the same numbers.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.experiment.deformation import recorded_meter
from rig.experiment.evaluate import CellReading, Visit, deformation_point, force_point
from rig.experiment.measure import read_deformation
from rig.link.schema import load_schema
from rig.record.documents import DeformationReading, PointDocument, PointKey
from rig.record.reader import RunReader


@dataclass(frozen=True)
class Difference:
    """How a recomputed point differs from the recorded one, in the point's unit."""

    key: PointKey
    recorded: float | None
    recomputed: float | None

    @property
    def size(self) -> float:
        """Absolute difference; infinite if only one of the two has a value."""
        if self.recorded is None or self.recomputed is None:
            return 0.0 if self.recorded is self.recomputed else float("inf")
        return abs(self.recomputed - self.recorded)


class ReplayedRun(RunReader):
    """A recorded run whose deformations and points are computed again from images and telemetry."""

    def __init__(self, run: Path) -> None:
        super().__init__(run)
        self._setup = self.setup()

    def recorded_points(self) -> tuple[PointDocument, ...]:
        """The points as they were taken."""
        return super().points()

    def points(self) -> tuple[PointDocument, ...]:
        """The points computed again."""
        return self._points

    def deformation_readings(self) -> tuple[DeformationReading, ...]:
        """The vision results computed again."""
        return self._readings

    def differences(self) -> list[Difference]:
        """Recorded against recomputed, point by point."""
        pairs = zip(self.recorded_points(), self.points(), strict=True)
        return [Difference(old.key, old.value, new.value) for old, new in pairs]

    @cached_property
    def _readings(self) -> tuple[DeformationReading, ...]:
        images = [image for image in self.images() if image.key is not None]
        if not images:
            return ()
        meter = recorded_meter(self._setup, self.rest_image())
        return tuple(
            read_deformation(meter, image.jpeg, image.key, image.frame)
            for image in images
            if image.key is not None
        )

    @cached_property
    def _points(self) -> tuple[PointDocument, ...]:
        return tuple(self._recompute())

    def _recompute(self) -> Iterator[PointDocument]:
        by_key: dict[PointKey, list[DeformationReading]] = defaultdict(list)
        for reading in self._readings:
            by_key[reading.key].append(reading)
        calibrations, unit = self._setup.calibrations, self._setup.actuator.measurand.unit
        pressure = self.telemetry("PRESSURE")
        cell = self.telemetry("LOAD_CELL")
        statuses = load_schema().choices("LOAD_CELL", "load_cell_status")
        for point in self.recorded_points():
            inside = _within(point, pressure["time_s"])
            visit = Visit(
                key=point.key,
                started_s=point.started_s,
                settled_s=point.settled_s,
                measured_from_s=point.measured_from_s,
                measured_to_s=point.measured_to_s,
                indicated_kpa=pressure["pressure_kpa"][inside],
                transducer=calibrations.transducer,
            )
            if point.key.experiment == "deformation":
                yield deformation_point(visit, by_key[point.key], unit)
            else:
                chosen = _within(point, cell["time_s"])
                readings = [
                    CellReading(int(counts), statuses.get(int(status), "unknown"))
                    for counts, status in zip(
                        cell["load_cell_counts"][chosen],
                        cell["load_cell_status"][chosen],
                        strict=True,
                    )
                ]
                yield force_point(visit, readings, calibrations.load_cell)


def _within(point: PointDocument, time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Samples that belong to the measurement: after its start, up to and with its end."""
    # half a millisecond: time stamps are whole milliseconds, stored as nanoseconds
    return np.asarray(
        (time_s > point.measured_from_s + 5e-4) & (time_s <= point.measured_to_s + 5e-4)
    )
