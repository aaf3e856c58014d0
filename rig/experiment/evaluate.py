"""From readings to a point: means, standard deviations and uncertainty budgets.

Pure, and used alike while a run is taken and when it is replayed from its log, so that both give
the same numbers. Uncertainty after the GUM (JCGM 100:2008, 4.2, 4.3, 5.1): type A from readings,
type B from calibrations, combined by root sum of squares; the lines are those of
`rig.validate.budget`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from rig.record.documents import DeformationReading, PointDocument, PointKey, UncertaintyPart
from rig.spec.calibration import LoadCellCalibration, TransducerCalibration
from rig.spec.measurand import DeformationUnit
from rig.validate.budget import (
    averaged,
    force_components,
    pressure_components,
    readings,
    tare_component,
)
from rig.validate.uncertainty import Component, combine

HAMPEL_LIMIT = 6.0
"""A load-cell reading this many robust standard deviations off the median is a bad word."""
TARE_WORDS = 20
"""Words that the firmware takes the mean of for its tare (rig::Tare::kWords)."""


@dataclass(frozen=True)
class Visit:
    """When a point was visited, and the pressure that the board gave while it was measured (kPa).

    The board knows the straight line of the `transducer` only.
    """

    key: PointKey
    started_s: float
    settled_s: float | None
    measured_from_s: float
    measured_to_s: float
    indicated_kpa: NDArray[np.float64]
    transducer: TransducerCalibration

    @property
    def pressure_kpa(self) -> float:
        """Mean pressure, corrected as the transducer's calibration says."""
        return self.transducer.corrected(float(self.indicated_kpa.mean()) * 1e3) / 1e3

    @property
    def pressure_components(self) -> tuple[Component, ...]:
        """What makes `pressure_kpa` uncertain, in kPa."""
        spread = _spread(self.indicated_kpa)
        return (
            readings(spread, len(self.indicated_kpa), "kPa"),
            *pressure_components(self.transducer, self.pressure_kpa),
        )


@dataclass(frozen=True)
class CellReading:
    """One conversion of the load cell, tare removed, with its status word of the schema."""

    counts: int
    status: str


def deformation_point(
    visit: Visit, frames: Sequence[DeformationReading], unit: DeformationUnit
) -> PointDocument:
    """The bending angle or elongation of a point from the vision results of its frames.

    What vision is unsure of in a frame is common to all frames of a still scene (ruler, lens,
    shading, edges), so it is not reduced by averaging.
    """
    accepted = [r for r in frames if r.accepted and r.value is not None]
    rejected = tuple(r.reason for r in frames if not r.accepted)
    values = np.array([r.value for r in accepted], dtype=np.float64)
    if len(values) == 0:
        return _document(visit, unit, None, values, (), rejected)
    budgets = zip(*([component_of(part) for part in r.parts] for r in accepted), strict=True)
    parts = (
        readings(_spread(values), len(values), unit),
        *(averaged(alike) for alike in budgets),
    )
    return _document(visit, unit, float(values.mean()), values, parts, rejected)


def force_point(
    visit: Visit, words: Sequence[CellReading], calibration: LoadCellCalibration
) -> PointDocument:
    """The tip force of a point in grams-force from the load cell's conversions."""
    rejected = [r.status for r in words if r.status != "ok"]
    counts = np.array([r.counts for r in words if r.status == "ok"], dtype=np.float64)
    if len(counts) == 0:
        return _document(visit, "g", None, counts, (), tuple(rejected))
    median = float(np.median(counts))
    scale = 1.4826 * float(np.median(np.abs(counts - median)))
    outlying = np.abs(counts - median) > HAMPEL_LIMIT * max(scale, 1.0)
    rejected += ["outlier"] * int(outlying.sum())
    grams = counts[~outlying] / calibration.counts_per_gram
    value = calibration.grams(float(counts[~outlying].mean()))
    spread = _spread(grams)
    parts = (
        readings(spread, len(grams), "g"),
        tare_component(spread, len(grams), TARE_WORDS),
        *force_components(calibration, value),
    )
    return _document(visit, "g", value, grams, parts, tuple(rejected))


def _spread(values: NDArray[np.float64]) -> float:
    return float(values.std(ddof=1)) if len(values) > 1 else 0.0


def _document(
    visit: Visit,
    unit: str,
    value: float | None,
    used: NDArray[np.float64],
    parts: Sequence[Component],
    rejected: tuple[str, ...],
) -> PointDocument:
    return PointDocument.model_validate(
        {
            "key": visit.key,
            "started_s": visit.started_s,
            "settled_s": visit.settled_s,
            "measured_from_s": visit.measured_from_s,
            "measured_to_s": visit.measured_to_s,
            "pressure_kpa": visit.pressure_kpa,
            "pressure_sd_kpa": _spread(visit.indicated_kpa),
            "pressure_u_kpa": combine(0.0, visit.pressure_components).u,
            "pressure_parts": budget_lines(visit.pressure_components),
            "value": value,
            "value_sd": _spread(used),
            "value_u": combine(0.0, parts).u,
            "value_parts": budget_lines(parts),
            "unit": unit,
            "readings": len(used),
            "rejected": rejected,
        }
    )


def budget_lines(parts: Sequence[Component]) -> tuple[UncertaintyPart, ...]:
    """Components as the documents keep them: JSON knows no infinity."""
    return tuple(
        UncertaintyPart.model_validate(asdict(p) | {"dof": p.dof if math.isfinite(p.dof) else None})
        for p in parts
    )


def component_of(part: UncertaintyPart) -> Component:
    """A line of a budget as it was recorded."""
    values = part.model_dump()
    return Component(**values | {"dof": math.inf if part.dof is None else part.dof})
