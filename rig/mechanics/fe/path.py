"""Following a loading path: reported points, steps that adapt, and a result that tells all.

Steps go straight from one reported point to the next; a step that fails is cut in half, one that
succeeds easily lets the next grow. A path that cannot be finished keeps what it has reached.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.control import Control, PressureControl, Situation
from rig.mechanics.fe.coordinates import blend
from rig.mechanics.fe.linear import LinearSolver, default_solver
from rig.mechanics.fe.model import Assembly, Model
from rig.mechanics.fe.newton import Clock, Iteration, Options, Outcome, Target, solve_step
from rig.mechanics.fe.state import State
from rig.mechanics.fe.threads import one_blas_thread

Array = NDArray[np.float64]

_EASY = 5
"""Iterations up to which a step was easy enough to try a longer one."""
_KNOTS = 4
"""Converged states that a step is extrapolated from."""


@dataclass(frozen=True)
class Point:
    """A point of the path to report: the controlled quantity, the factors of the other loads."""

    control: float
    dead: float = 1.0
    motion: float = 1.0


@dataclass(frozen=True)
class StepRecord:
    """One attempted step, successful or not."""

    point: int
    """Index of the reported point it went towards."""
    fraction: float
    """How far between the last reported point and this one it wanted to get, up to 1."""
    pressure: float
    """Pressure at its end in Pa."""
    converged: bool
    mixed_points: bool
    iterations: tuple[Iteration, ...]
    assembly_seconds: float
    solve_seconds: float
    reason: str

    @property
    def solves(self) -> int:
        """Linear systems solved."""
        return len(self.iterations) - 1


@dataclass(frozen=True)
class Solution:
    """Equilibrium at a reported point."""

    state: State
    volume: float
    """Volume of the cavity in m3; 0 without one."""
    residual: Array
    """Forces in N at all degrees of freedom; at supports these are the reactions."""

    @property
    def pressure(self) -> float:
        """Pressure of the cavity in Pa."""
        return self.state.pressure


@dataclass(frozen=True)
class Progress:
    """What a watcher is told after every step."""

    point: int
    points: int
    fraction: float
    pressure: float
    converged: bool
    solves: int


@dataclass(frozen=True)
class Result:
    """All reported points that were reached, in order, and how."""

    solutions: tuple[Solution, ...]
    history: tuple[StepRecord, ...]
    failure: str | None
    """Where and why the path ended early; None when it was finished."""
    seconds: float
    cancelled: bool = False
    """Whether the watcher ended it."""
    solver: str = ""
    """Name of the linear solver: PARDISO only where it is installed."""

    @property
    def solves(self) -> int:
        """Linear systems solved, those of failed steps included."""
        return sum(step.solves for step in self.history)

    @property
    def assembly_seconds(self) -> float:
        """Time spent on element kernels and assembly."""
        return sum(step.assembly_seconds for step in self.history)

    @property
    def solve_seconds(self) -> float:
        """Time spent on linear systems."""
        return sum(step.solve_seconds for step in self.history)


def follow(
    model: Model,
    points: Sequence[Point],
    control: Control | None = None,
    *,
    options: Options | None = None,
    solver: LinearSolver | None = None,
    start: State | None = None,
    progress: Callable[[Progress], bool] | None = None,
    clock: Clock = time.perf_counter,
) -> Result:
    """Equilibrium at every point in turn, from rest or from `start`.

    `progress` is called after every step and cancels by answering False. Not reaching a point is
    no exception: the result says where and why, and keeps the points before it.
    """
    run = _Run(
        model,
        control or PressureControl(),
        options or Options(),
        solver or default_solver(model.symmetric, model.discretisation.pressure_nodes > 0),
        clock,
    )
    begin = clock()
    state = start or model.start()
    solutions: list[Solution] = []
    failure = None
    with one_blas_thread():
        for index, point in enumerate(points):
            told = _teller(progress, index, len(points))
            arrived = run.go(state, point, index, told)
            if isinstance(arrived, str):
                failure = arrived
                break
            state = arrived.state
            solutions.append(Solution(state, arrived.assembly.volume, arrived.assembly.residual))
    return Result(
        solutions=tuple(solutions),
        history=tuple(run.history),
        failure=failure,
        seconds=clock() - begin,
        cancelled=run.cancelled,
        solver=run.solver.name,
    )


class _Run:
    def __init__(
        self,
        model: Model,
        control: Control,
        options: Options,
        solver: LinearSolver,
        clock: Clock,
    ) -> None:
        self.model = model
        self.control = control
        self.options = options
        self.solver = solver
        self.clock = clock
        self.history: list[StepRecord] = []
        self.cancelled = False
        self._here: State | None = None
        self._latest: Outcome | None = None
        self._past: list[tuple[float, State]] = []
        self._kind = ""
        self._step = 1.0

    def go(
        self, state: State, point: Point, index: int, told: Callable[[StepRecord], bool]
    ) -> Outcome | str:
        """Steps from `state` to `point`; what went wrong, in words, if it cannot be reached."""
        situation = Situation(self.model, state, self._assembly_at(state))
        first = Target(self.control.value(situation), state.dead, state.motion)
        parameter = self._parameter(first, point)
        done, mixed, cuts = 0.0, self.options.mixed_points, 0
        self._here = self.model.settled(state)
        if not self._past:
            if self._kind != "mixed":
                self._step = min(self._step, self.options.first_step)
            self._remember(parameter(0.0), self._here)
        while True:
            started = self.clock()
            fraction = min(1.0, done + self._step)
            if 1.0 - fraction < 1e-9:
                fraction = 1.0
            target = _between(first, point, fraction)
            begin, assembly = self._predicted(target, parameter(fraction), mixed)
            preparing = self.clock() - started
            outcome = solve_step(
                self.model,
                begin,
                target,
                self.control,
                self.solver,
                replace(self.options, mixed_points=mixed),
                self.clock,
                assembly,
            )
            record = StepRecord(
                point=index,
                fraction=fraction,
                pressure=outcome.state.pressure,
                converged=outcome.converged,
                mixed_points=mixed,
                iterations=outcome.iterations,
                assembly_seconds=preparing + outcome.assembly_seconds,
                solve_seconds=outcome.solve_seconds,
                reason=outcome.reason,
            )
            self.history.append(record)
            if not told(record):
                self.cancelled = True
                return self._words(outcome, point, fraction, "it was cancelled")
            if outcome.converged:
                self._here = self.model.settled(outcome.state)
                self._remember(parameter(fraction), self._here)
                self._latest = replace(outcome, state=self._here)
                if record.solves <= _EASY:
                    self._step = min(1.0, 2 * self._step)
                if fraction == 1.0:
                    return self._latest
                done, mixed, cuts = fraction, self.options.mixed_points, 0
                continue
            cuts += 1
            # now and then plain Newton with a line search gets where mixed points do not
            again = cuts % 2 == 0 or not self.options.alternate
            mixed = self.options.mixed_points and again
            if mixed == self.options.mixed_points:
                self._step = (fraction - done) / 2
            if self._step < self.options.least_step:
                return self._words(outcome, point, fraction, outcome.reason)

    def _assembly_at(self, state: State) -> Assembly:
        latest = self._latest
        if latest is not None and latest.state is state:
            return latest.assembly
        return self.model.assemble(state, tangent=False)

    def _remember(self, parameter: float, state: State) -> None:
        self._past = [*self._past[1 - _KNOTS :], (parameter, state)]

    def _predicted(
        self, target: Target, parameter: float, mixed: bool
    ) -> tuple[State, Assembly | None]:
        """Where to start from, and the assembly there if it was needed to find out."""
        guess = self._extrapolated(target, parameter)
        if guess is not None:
            begin = self._with_points(guess, mixed)
            found = self.model.assemble(begin)
            if np.all(np.isfinite(found.residual)) and found.least_volume_ratio > 0:
                return begin, found
        assert self._here is not None
        return self._with_points(self._here, mixed), None

    def _extrapolated(self, target: Target, parameter: float) -> State | None:
        """Where the last states point to; None where they do not point there."""
        if not self.options.extrapolate or len(self._past) < 2:
            return None
        knots = np.array([p for p, _ in self._past])
        if np.any(np.diff(knots) == 0) or (parameter - knots[-1]) * (knots[-1] - knots[-2]) <= 0:
            return None
        weights = _lagrange(knots, parameter)
        states = [s for _, s in self._past]
        x, poses = self.model.blended(states, weights, target.motion)
        pressure = float(np.dot(weights, [s.pressure for s in states]))
        if isinstance(self.control, PressureControl):
            pressure = target.control
        points = tuple(
            # what has flowed is no matter of extrapolation
            replace(parts[-1], pressure=blend(weights, [p.pressure for p in parts]))
            for parts in zip(*(s.points for s in states), strict=True)
        )
        memories = states[-1].memories
        return State(x, points, poses, memories, pressure, target.dead, target.motion)

    def _with_points(self, state: State, mixed: bool) -> State:
        """The state with strain and stress at its points independent, if they shall be."""
        if not mixed:
            return state
        return replace(
            state,
            points=tuple(
                solid.free_points(state.x, p)
                for solid, p in zip(self.model.solids, state.points, strict=True)
            ),
        )

    def _parameter(self, first: Target, point: Point) -> Callable[[float], float]:
        """What extrapolation is done along, forgetting the past where the path has a kink."""
        by_control = point.dead == first.dead and point.motion == first.motion
        by_motion = point.dead == first.dead and point.control == first.control
        kind = "control" if by_control else "motion" if by_motion else "mixed"
        if kind != self._kind or kind == "mixed":
            self._past = []
        self._kind = kind
        low, high = {
            "control": (first.control, point.control),
            "motion": (first.motion, point.motion),
            "mixed": (0.0, 1.0),
        }[kind]
        return lambda fraction: low + fraction * (high - low)

    def _words(self, outcome: Outcome, point: Point, fraction: float, why: str) -> str:
        d = self.model.discretisation
        last = self._here or self.model.start()
        where = ", ".join(f"{1e3 * c:.4g}" for c in d.nodes[outcome.worst_node])
        residual = outcome.iterations[-1].residual
        return (
            f"the path stopped at {last.pressure / 1e3:.4g} kPa on the way to {self.control.name} "
            f"{point.control:.6g} {self.control.unit}: {why}. The last attempt, at "
            f"{100 * fraction:.3g} % of the way from the last reported point, left a residual of "
            f"{residual:.2g} (needed {self.options.tolerance:.1g}), largest at ({where}) mm."
        )


def _teller(
    progress: Callable[[Progress], bool] | None, index: int, points: int
) -> Callable[[StepRecord], bool]:
    if progress is None:
        return lambda _: True
    return lambda step: progress(
        Progress(index, points, step.fraction, step.pressure, step.converged, step.solves)
    )


def _lagrange(knots: Array, at: float) -> Array:
    """Weights of the values at the knots in the polynomial through them, at another place."""
    return np.array(
        [
            np.prod([(at - other) / (knot - other) for other in np.delete(knots, i)])
            for i, knot in enumerate(knots)
        ]
    )


def _between(first: Target, point: Point, fraction: float) -> Target:
    return Target(
        first.control + fraction * (point.control - first.control),
        first.dead + fraction * (point.dead - first.dead),
        first.motion + fraction * (point.motion - first.motion),
    )
