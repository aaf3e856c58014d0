"""An actuator inflated with its tip free: equilibria at rungs of pressure, kept in a store.

Rungs are a twelfth of the actuator's pressure limit apart, whatever pressures were asked for, so
that every later question is answered by the same entry; between rungs `Response` interpolates.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe import Model, Point, Solution, State, follow, largest_von_mises
from rig.mechanics.fe.state import PointState, Pose
from rig.mechanics.job import Job
from rig.mechanics.store import Entry

Array = NDArray[np.float64]

RUNGS = 12
"""Rungs up to the actuator's pressure limit."""


class ActuatorModel(Protocol):
    """A family's finite element model, with what turns its state into what labs measure."""

    @property
    def model(self) -> Model:
        """The model itself; its dead loads act at all rungs."""
        ...

    @property
    def mirror(self) -> int | None:
        """Axis across whose plane through the origin the body is mirrored; None if it is whole."""
        ...

    def angle(self, state: State, /) -> float | None:
        """Bending angle in rad; None of a family that does not bend."""
        ...

    def displacement(self, state: State, /) -> float:
        """The family's displacement in m, as `Response.displacement` says."""
        ...

    def volume(self, modelled: float, /) -> float:
        """Volume of the whole cavity in m3 from that of the modelled part."""
        ...


@dataclass(frozen=True)
class FreeCurves:
    """The response at the rungs that were reached, each (k,), SI units."""

    pressure: Array
    angle: Array | None
    displacement: Array
    volume: Array
    max_von_mises: Array
    stopped: str | None
    """Why there are no more rungs; None where all that were asked for were reached."""


@dataclass(frozen=True)
class FreeInflation:
    """One question: an actuator's model, where its answer is kept, what it may be asked."""

    build: Callable[[], ActuatorModel]
    key: str
    limit: float
    """Pressure limit of the actuator in Pa."""

    def curves(self, top: float, job: Job) -> FreeCurves:
        """The response up to the rung at or above `top` in Pa."""
        entry = self._entry(top, job)
        count = int(np.searchsorted(entry["pressure"], self._rungs(top)[-1] * (1 + 1e-9)))
        stopped = str(entry["stopped"]) if count < len(self._rungs(top)) else ""
        return FreeCurves(
            pressure=entry["pressure"][:count],
            angle=entry["angle"][:count] if "angle" in entry else None,
            displacement=entry["displacement"][:count],
            volume=entry["volume"][:count],
            max_von_mises=entry["max_von_mises"][:count],
            stopped=stopped or None,
        )

    def solutions(self, top: float, job: Job) -> tuple[ActuatorModel, tuple[Solution, ...]]:
        """Model and equilibria up to the rung at or above `top` in Pa: all fields."""
        entry = self._entry(top, job)
        return self.build(), _solutions(entry)[: len(self._rungs(top))]

    def _rungs(self, top: float) -> Array:
        step = self.limit / RUNGS
        return np.asarray(step * np.arange(int(np.ceil(top / step - 1e-9)) + 1), dtype=np.float64)

    def _entry(self, top: float, job: Job) -> Entry:
        known = job.store.load(self.key)
        rungs = self._rungs(top)
        if known is not None and (len(known["pressure"]) >= len(rungs) or known["final"]):
            return known
        return self._extended(known, rungs, job)

    def _extended(self, known: Entry | None, rungs: Array, job: Job) -> Entry:
        """The entry with the missing rungs computed, kept even if only some were reached."""
        actuator = self.build()
        before = () if known is None else _solutions(known)
        result = follow(
            actuator.model,
            [Point(p) for p in rungs[len(before) :]],
            start=before[-1].state if before else None,
            progress=job.telling("tip free"),
        )
        entry = _entry_of(actuator, (*before, *result.solutions), result.failure, result.cancelled)
        job.store.save(self.key, entry)
        return entry


def _entry_of(
    actuator: ActuatorModel, solutions: tuple[Solution, ...], failure: str | None, cancelled: bool
) -> Entry:
    states = [s.state for s in solutions]
    angles = [angle for s in states if (angle := actuator.angle(s)) is not None]
    bending = {"angle": np.array(angles)} if len(angles) == len(states) else {}
    return {
        "pressure": np.array([s.pressure for s in solutions]),
        "displacement": np.array([actuator.displacement(s) for s in states]),
        "volume": np.array([actuator.volume(s.volume) for s in solutions]),
        "max_von_mises": np.array([largest_von_mises(actuator.model, s) for s in solutions]),
        "stopped": np.array(failure or ""),
        # trying again would end at the same place, unless it was cancelled
        "final": np.array(failure is not None and not cancelled),
        "x": np.array([s.x for s in states]),
        "modelled_volume": np.array([s.volume for s in solutions]),
        "residual": np.array([s.residual for s in solutions]),
        "dead": np.array([s.dead for s in states]),
        "motion": np.array([s.motion for s in states]),
        "shift": np.array([[p.shift for p in s.poses] for s in states]),
        "rotation": np.array([[p.rotation for p in s.poses] for s in states]),
        **bending,
    } | {
        f"modes_{i}": np.array([s.points[i].pressure for s in states])
        for i in range(len(actuator.model.solids))
    }


def _solutions(entry: Entry) -> tuple[Solution, ...]:
    modes = [entry[f"modes_{i}"] for i in range(sum(name.startswith("modes_") for name in entry))]
    return tuple(
        Solution(
            State(
                x=entry["x"][k],
                points=tuple(PointState(m[k]) for m in modes),
                poses=tuple(
                    Pose(shift, rotation)
                    for shift, rotation in zip(entry["shift"][k], entry["rotation"][k], strict=True)
                ),
                pressure=float(entry["pressure"][k]),
                dead=float(entry["dead"][k]),
                motion=float(entry["motion"][k]),
            ),
            float(entry["modelled_volume"][k]),
            entry["residual"][k],
        )
        for k in range(len(entry["pressure"]))
    )
