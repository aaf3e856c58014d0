"""Levels that a recorded run measured: what models are updated with and held against."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.table import GRAM_FORCE
from rig.spec.workspace import Setup
from rig.study.errors import StudyError
from rig.study.factors import Array
from rig.study.summary import read_experiments


@dataclass(frozen=True)
class Measured:
    """A run's levels; arrays (n,) and (m,), SI."""

    angle_pressure: Array
    angle: Array
    angle_u: Array
    """Standard uncertainties."""
    force_pressure: Array
    force: Array
    force_u: Array

    @property
    def count(self) -> int:
        """Levels in all."""
        return self.angle.size + self.force.size

    def only(self, angles: NDArray[np.bool_], forces: NDArray[np.bool_]) -> Measured:
        """The levels that masks (n,) and (m,) keep."""
        return replace(
            self,
            angle_pressure=self.angle_pressure[angles],
            angle=self.angle[angles],
            angle_u=self.angle_u[angles],
            force_pressure=self.force_pressure[forces],
            force=self.force[forces],
            force_u=self.force_u[forces],
        )


def read_measured(run: Path) -> Measured:
    """Levels of a run's summary, both branches; raises StudyError where there are none."""
    experiments = read_experiments(run)
    angle = _levels(experiments.get("deformation"), float(np.radians(1.0)))
    force = _levels(experiments.get("blocked_force"), GRAM_FORCE)
    if angle[0].size + force[0].size == 0:
        raise StudyError(f"{run}: the run measured neither angle nor blocked force.")
    return Measured(*angle, *force)


def _levels(experiment: Mapping[str, Any] | None, factor: float) -> tuple[Array, Array, Array]:
    """Pressures in Pa, means and standard uncertainties in SI."""
    points = [] if experiment is None else experiment["points"]
    rows = [
        (1e3 * p["measured_pressure_kpa"], factor * p["mean"], factor * p["u95"] / 2)
        for p in points
    ]
    table = np.array(rows, dtype=np.float64).reshape(len(rows), 3)
    return table[:, 0], table[:, 1], table[:, 2]


def without_pressures(run: Measured, held_out: Array) -> tuple[Measured, Measured]:
    """The run without levels within 0.2 kPa of the pressures in Pa, and those levels alone.

    Raises StudyError for pressures at which the run has no level.
    """

    def near(pressure: Array) -> NDArray[np.bool_]:
        """Levels (rows) against pressures to hold out (columns)."""
        return np.asarray(np.abs(pressure[:, None] - held_out[None, :]) < 200.0)

    of_angle, of_force = near(run.angle_pressure), near(run.force_pressure)
    missed = held_out[~(of_angle.any(axis=0) | of_force.any(axis=0))]
    if missed.size:
        raise StudyError(
            f"no level of the run lies at {', '.join(f'{p / 1e3:g}' for p in missed)} kPa, which "
            f"you want to hold out."
        )
    angles, forces = np.any(of_angle, axis=1), np.any(of_force, axis=1)
    return run.only(~angles, ~forces), run.only(angles, forces)


def require_same_actuator(one: Setup, other: Setup) -> None:
    """Raise StudyError where two runs are of actuators of different geometry or material."""
    for what, own, others in (
        ("geometry", one.actuator.geometry, other.actuator.geometry),
        ("material", one.material, other.material),
    ):
        if own != others:
            raise StudyError(
                f"the run to be foretold is of another {what} ({other.actuator.name} of "
                f"{other.material.name}, not {one.actuator.name} of {one.material.name}); expected "
                f"a run of the same actuator."
            )
