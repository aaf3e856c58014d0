"""Compares what a run measured with what was really so, from the separate truth file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.board.truth import TruthSample
from rig.record.documents import PointDocument


@dataclass(frozen=True)
class Errors:
    """Measured minus true at each point; pressures in kPa, values in deg or g."""

    pressure_kpa: NDArray[np.float64]
    value: NDArray[np.float64]
    u: NDArray[np.float64]
    regulation_kpa: NDArray[np.float64]
    """True pressure minus set-point."""

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.value**2)))


def errors(
    points: Sequence[PointDocument], truth: Sequence[TruthSample], experiment: str
) -> Errors:
    """Errors of an experiment's points against the truth averaged over each measurement."""
    time_s = np.array([t.time_s for t in truth])
    names = {"deformation": "deformation", "blocked_force": "force_g"}
    true_value = np.array([getattr(t, names[experiment]) for t in truth])
    true_pressure = np.array([t.pressure_kpa for t in truth])
    rows = []
    for point in points:
        if point.key.experiment != experiment:
            continue
        assert point.value is not None
        inside = (time_s > point.measured_from_s) & (time_s <= point.measured_to_s + 1e-3)
        assert inside.any()
        rows.append(
            (
                point.pressure_kpa - true_pressure[inside].mean(),
                point.value - true_value[inside].mean(),
                point.value_u,
                true_pressure[inside].mean() - point.key.target_kpa,
            )
        )
    table = np.array(rows)
    return Errors(table[:, 0], table[:, 1], table[:, 2], table[:, 3])
