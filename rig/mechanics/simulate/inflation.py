"""An actuator inflated: equilibria at rungs of pressure, kept in a store.

Rungs are a twelfth of the actuator's pressure limit apart, whatever pressures were asked for, so
that every later question is answered by the same entry; between rungs `Response` interpolates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe import Model, Options, Point, Solution, State, follow
from rig.mechanics.fe.extremes import PEAKS, Extremes, Peak, summarise
from rig.mechanics.fe.state import PointState, Pose
from rig.mechanics.job import Job
from rig.mechanics.store import Entry

Array = NDArray[np.float64]

RUNGS = 12
"""Rungs up to the actuator's pressure limit."""

_MEASURE, _MODES, _HISTORY, _MEMORY = "measure ", "modes ", "history ", "memory "
"""How names of arrays in an entry begin, of what is measured, of each solid's points and of each
interface."""


class ActuatorModel(Protocol):
    """An actuator in one experiment as a finite element model."""

    @property
    def model(self) -> Model:
        """The model itself; its dead loads act at all rungs."""
        ...

    @property
    def mirror(self) -> int | None:
        """Axis across whose plane through the origin the body is mirrored; None if it is whole."""
        ...

    def measures(self, solution: Solution, /) -> Mapping[str, float]:
        """What labs measure, SI units, by names that are the same for all solutions; those of
        `rig.mechanics.response.Response` where it has them."""
        ...


@dataclass(frozen=True)
class Curves:
    """The response at the k rungs that were reached."""

    pressure: Array
    """In Pa, (k,)."""
    measured: Mapping[str, Array]
    """What the model measures, each (k,)."""
    extremes: tuple[Extremes, ...]
    """Largest stresses and strains."""
    stopped: str | None
    """Why there are no more rungs; None where all that were asked for were reached."""
    cancelled: bool
    """Whether that was because somebody stopped it."""


@dataclass(frozen=True)
class Inflation:
    """One question: an actuator's model, where its answer is kept, what it may be asked."""

    name: str
    """What a watcher reads."""
    build: Callable[[], ActuatorModel]
    key: str
    limit: float
    """Pressure limit of the actuator in Pa."""
    options: Options = field(default_factory=Options)
    """Of Newton's method."""

    def curves(self, top: float, job: Job) -> Curves:
        """The response up to the rung at or above `top` in Pa."""
        entry = self._entry(top, job)
        count = int(np.searchsorted(entry["pressure"], self._rungs(top)[-1] * (1 + 1e-9)))
        stopped = str(entry["stopped"]) if count < len(self._rungs(top)) else ""
        return Curves(
            pressure=entry["pressure"][:count],
            measured={
                name.removeprefix(_MEASURE): values[:count]
                for name, values in entry.items()
                if name.startswith(_MEASURE)
            },
            extremes=_extremes(entry)[:count],
            stopped=stopped or None,
            cancelled=bool(stopped) and not entry["final"],
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
            options=self.options,
            start=before[-1].state if before else None,
            progress=job.telling(self.name),
        )
        entry = _entry_of(actuator, (*before, *result.solutions), result.failure, result.cancelled)
        job.store.save(self.key, entry)
        return entry


def _entry_of(
    actuator: ActuatorModel, solutions: tuple[Solution, ...], failure: str | None, cancelled: bool
) -> Entry:
    states = [s.state for s in solutions]
    # the first solid is of the actuator's material, whose strength they are compared with
    found = [summarise(actuator.model, s, solids=1) for s in solutions]
    measured = [actuator.measures(s) for s in solutions]
    peaks = [[getattr(extremes, name) for name in PEAKS] for extremes in found]
    return {
        "pressure": np.array([s.pressure for s in solutions]),
        "peak_value": np.array([[p.value for p in row] for row in peaks]),
        "peak_place": np.array([[p.place for p in row] for row in peaks]),
        "peak_solid": np.array([[p.solid for p in row] for row in peaks]),
        "peak_at_notch": np.array([[p.at_notch for p in row] for row in peaks]),
        "peak_bulk": np.array([[p.bulk for p in row] for row in peaks]),
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
        "turn": np.array([[p.angles for p in s.poses] for s in states]),
        **{
            f"{_MEASURE}{name}": np.array([row[name] for row in measured])
            for name in (measured[0] if measured else ())
        },
        **{
            f"{_MODES}{i}": np.array([s.points[i].pressure for s in states])
            for i in range(len(actuator.model.solids))
        },
        **{
            f"{_HISTORY}{i}": np.array([s.points[i].history for s in states])
            for i, point in enumerate(actuator.model.start().points)
            if point.history is not None
        },
        **{
            f"{_MEMORY}{i}": np.array([s.memories[i] for s in states])
            for i in range(len(actuator.model.interfaces))
        },
    }


def _extremes(entry: Entry) -> tuple[Extremes, ...]:
    return tuple(
        Extremes(
            pressure=float(pressure),
            **{
                name: Peak(
                    value=float(entry["peak_value"][k, i]),
                    place=entry["peak_place"][k, i],
                    solid=int(entry["peak_solid"][k, i]),
                    at_notch=bool(entry["peak_at_notch"][k, i]),
                    bulk=float(entry["peak_bulk"][k, i]),
                )
                for i, name in enumerate(PEAKS)
            },
        )
        for k, pressure in enumerate(entry["pressure"])
    )


def _solutions(entry: Entry) -> tuple[Solution, ...]:
    solids = [name.removeprefix(_MODES) for name in sorted(entry) if name.startswith(_MODES)]
    memories = [name for name in sorted(entry) if name.startswith(_MEMORY)]
    return tuple(
        Solution(
            State(
                x=entry["x"][k],
                points=tuple(
                    PointState(
                        entry[f"{_MODES}{i}"][k],
                        history=entry[f"{_HISTORY}{i}"][k] if f"{_HISTORY}{i}" in entry else None,
                    )
                    for i in solids
                ),
                poses=tuple(
                    Pose(*placed)
                    for placed in zip(
                        *(entry[name][k] for name in ("shift", "rotation", "turn")), strict=True
                    )
                ),
                memories=tuple(entry[name][k] for name in memories),
                pressure=float(entry["pressure"][k]),
                dead=float(entry["dead"][k]),
                motion=float(entry["motion"][k]),
            ),
            float(entry["modelled_volume"][k]),
            entry["residual"][k],
        )
        for k in range(len(entry["pressure"]))
    )
