"""The repeats of one pressure with the budget of their mean, line by line."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.experiment.evaluate import component_of
from rig.record.documents import Direction, PointDocument, UncertaintyPart
from rig.report.data import by_level
from rig.validate.budget import READINGS, averaged
from rig.validate.metrics import Repeatability, repeatability
from rig.validate.uncertainty import Component, Estimate, combine

Array = NDArray[np.float64]
REPEATS = "repeats"


@dataclass(frozen=True)
class Level:
    """The repeats of one pressure on one branch, with the parts of its uncertainty."""

    direction: Direction
    target_kpa: float
    points: tuple[PointDocument, ...]
    components: tuple[Component, ...]
    """Of the mean, in its unit."""
    pressure_components: tuple[Component, ...]
    """Of the mean pressure, in kPa."""

    @property
    def values(self) -> Array:
        """Measured values, (repeats,)."""
        return np.array([point.value for point in self.points], dtype=np.float64)

    @property
    def pressures_kpa(self) -> Array:
        """Measured pressures, (repeats,)."""
        return np.array([point.pressure_kpa for point in self.points])

    @property
    def mean(self) -> float:
        """Mean of the repeats."""
        return float(self.values.mean())

    @property
    def estimate(self) -> Estimate:
        """The mean with its combined uncertainty."""
        return combine(self.mean, self.components)

    @property
    def pressure_calibrations(self) -> tuple[Component, ...]:
        """`pressure_components` without the scatter of readings, which the repeats hold."""
        return without_readings(self.pressure_components)

    @property
    def pressure(self) -> Estimate:
        """The mean pressure in kPa with its combined uncertainty."""
        return combine(float(self.pressures_kpa.mean()), self.pressure_components)


def levels_of(points: Sequence[PointDocument]) -> list[Level]:
    """Levels of one experiment, up first; points without a value are left out."""
    groups = by_level(points)
    measured = {
        key: np.array([p.value for p in group], dtype=np.float64) for key, group in groups.items()
    }
    means = {key: float(values.mean()) for key, values in measured.items()}
    repeated = {key: values for key, values in measured.items() if values.size > 1}
    levels = []
    for (direction, target), group in groups.items():
        branch = {kpa: mean for (way, kpa), mean in means.items() if way == direction}
        slope = _slope(branch, target)
        scatter = nearest_scatter(repeated, direction, target)
        pressure = pressure_components(group)
        way: Direction = "up" if direction == "up" else "down"
        levels.append(
            Level(
                way,
                target,
                tuple(group),
                (
                    repeats_component(measured[direction, target], group, scatter),
                    *calibration_components(group),
                    # what moves the pressure moves the value along the curve; readings of the
                    # pressure scatter from repeat to repeat and are in that line
                    *(
                        replace(c, sensitivity=slope * c.sensitivity)
                        for c in without_readings(pressure)
                    ),
                ),
                pressure,
            )
        )
    return levels


def repeats_component(
    values: Array, group: Sequence[PointDocument], scatter: Repeatability | None
) -> Component:
    """Type A: from the repeats; for a single one from the `scatter` of the repeats nearest to it.

    Where nothing was repeated at all only the scatter of the single point's readings is known.
    """
    unit = group[0].unit
    if values.size > 1:
        u = float(values.std(ddof=1)) / math.sqrt(values.size)
        return Component(REPEATS, u, values.size - 1, unit=unit, kind="A")
    if scatter is not None:
        return Component(REPEATS, scatter.sd, scatter.dof, unit=unit, kind="A")
    (point,) = group
    (line,) = (component_of(p) for p in point.value_parts if p.name == READINGS)
    return replace(line, name=f"{READINGS} (nothing was repeated)")


def nearest_scatter(
    repeated: Mapping[tuple[str, float], Array], direction: str, target_kpa: float
) -> Repeatability | None:
    """Repeatability at the repeated pressure nearest to `target_kpa`: scatter depends on it.

    `repeated` is by direction and pressure; the own direction comes first where both repeat.
    """
    if not repeated:
        return None
    nearest = min(repeated, key=lambda key: (abs(key[1] - target_kpa), key[0] != direction))
    return repeatability([repeated[nearest]])


def without_readings(components: Iterable[Component]) -> tuple[Component, ...]:
    """Those that are not the scatter of readings."""
    return tuple(c for c in components if not c.name.startswith(READINGS))


def calibration_components(group: Sequence[PointDocument]) -> tuple[Component, ...]:
    """What is common to the repeats of a level: all parts but the scatter of readings."""
    return tuple(
        averaged(lines)
        for name, lines in _by_name(p.value_parts for p in group)
        if name != READINGS
    )


def pressure_components(group: Sequence[PointDocument]) -> tuple[Component, ...]:
    """Parts of the mean pressure of a level, in kPa; readings of repeats are independent."""
    components = []
    for name, lines in _by_name(p.pressure_parts for p in group):
        line = averaged(lines)
        if name == READINGS:
            line = replace(
                line,
                name=f"{READINGS} of the pressure",
                u=line.u / math.sqrt(len(lines)),
                dof=line.dof * len(lines),
            )
        components.append(line)
    return tuple(components)


def _by_name(
    parts: Iterable[Sequence[UncertaintyPart]],
) -> list[tuple[str, list[Component]]]:
    found: dict[str, list[Component]] = {}
    for lines in parts:
        for line in lines:
            found.setdefault(line.name, []).append(component_of(line))
    return list(found.items())


def _slope(branch: Mapping[float, float], target: float) -> float:
    """Slope of a measured branch at one of its pressures, in its unit per kPa."""
    if len(branch) < 2:
        return 0.0
    kpa = np.array(sorted(branch))
    slopes = np.gradient(np.array([branch[p] for p in kpa]), kpa)
    return float(slopes[np.searchsorted(kpa, target)])
