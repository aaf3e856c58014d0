"""From readings to a point: means, standard deviations and combined standard uncertainty.

Pure, and used alike while a run is taken and when it is replayed from its log, so that both give
the same numbers. Uncertainty after the GUM (JCGM 100:2008, 4.2, 4.3, 5.1): type A from readings,
type B from calibrations, combined by root sum of squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.record.documents import AngleReading, PointDocument, PointKey
from rig.spec.calibration import LoadCellCalibration

HAMPEL_LIMIT = 6.0
"""A load-cell reading this many robust standard deviations off the median is a bad word."""


@dataclass(frozen=True)
class Visit:
    """When a point was visited, and the pressure while it was measured (kPa)."""

    key: PointKey
    started_s: float
    settled_s: float | None
    measured_from_s: float
    measured_to_s: float
    pressure_kpa: NDArray[np.float64]


@dataclass(frozen=True)
class CellReading:
    """One conversion of the load cell, tare removed, with its status word of the schema."""

    counts: int
    status: str


def angle_point(visit: Visit, readings: Sequence[AngleReading]) -> PointDocument:
    """The bending angle of a point in degrees from the vision results of its frames.

    The uncertainty that vision states for a frame holds the camera's calibration and parts common
    to all frames of a still scene (shading, edges), so it is not reduced by averaging.
    """
    accepted = [r for r in readings if r.accepted and r.angle_deg is not None]
    angles = np.array([r.angle_deg for r in accepted], dtype=np.float64)
    value, spread, u = None, 0.0, 0.0
    if len(angles):
        value = float(angles.mean())
        spread = float(angles.std(ddof=1)) if len(angles) > 1 else 0.0
        vision_u = float(np.mean([r.u_deg for r in accepted]))
        u = float(np.sqrt(spread**2 / len(angles) + vision_u**2))
    rejected = tuple(r.reason for r in readings if not r.accepted)
    return _document(visit, "deg", value, spread, u, len(angles), rejected)


def force_point(
    visit: Visit, readings: Sequence[CellReading], calibration: LoadCellCalibration
) -> PointDocument:
    """The tip force of a point in grams-force from the load cell's conversions."""
    rejected = [r.status for r in readings if r.status != "ok"]
    counts = np.array([r.counts for r in readings if r.status == "ok"], dtype=np.float64)
    if len(counts):
        median = float(np.median(counts))
        scale = 1.4826 * float(np.median(np.abs(counts - median)))
        outlying = np.abs(counts - median) > HAMPEL_LIMIT * max(scale, 1.0)
        rejected += ["outlier"] * int(outlying.sum())
        counts = counts[~outlying]
    value, spread, u = None, 0.0, 0.0
    if len(counts):
        grams = counts / calibration.counts_per_gram
        value = float(grams.mean())
        spread = float(grams.std(ddof=1)) if len(grams) > 1 else 0.0
        u = float(
            np.sqrt(
                spread**2 / len(grams)
                + (calibration.counts_per_gram_u * value) ** 2
                + (calibration.creep_u * 1e3) ** 2
            )
        )
    return _document(visit, "g", value, spread, u, len(counts), tuple(rejected))


def _document(
    visit: Visit,
    unit: str,
    value: float | None,
    spread: float,
    u: float,
    readings: int,
    rejected: tuple[str, ...],
) -> PointDocument:
    pressure = visit.pressure_kpa
    return PointDocument.model_validate(
        {
            "key": visit.key,
            "started_s": visit.started_s,
            "settled_s": visit.settled_s,
            "measured_from_s": visit.measured_from_s,
            "measured_to_s": visit.measured_to_s,
            "pressure_kpa": float(pressure.mean()),
            "pressure_sd_kpa": float(pressure.std(ddof=1)) if len(pressure) > 1 else 0.0,
            "value": value,
            "value_sd": spread,
            "value_u": u,
            "unit": unit,
            "readings": readings,
            "rejected": rejected,
        }
    )
