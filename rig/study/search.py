"""Searches for the best spec: COBYLA with basin hopping, NSGA-II (pymoo), optuna's estimators.

All see the unit cube between the factors' bounds and one memory of what was evaluated. A point that
is no spec, or that its model does not reach, counts as breaking a limit; a limit's violation is
relative to its size.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rig.spec.optimisation import (
    BayesianSearch,
    CobylaSearch,
    NsgaSearch,
    OptimisationSpec,
    WantedResponse,
)
from rig.study.design import power_of_two
from rig.study.evaluate import evaluate
from rig.study.executor import timed
from rig.study.extras import package
from rig.study.factors import Array, actual
from rig.study.plan import Point, Space, Task
from rig.study.results import Answer, Folder

_BEYOND = 0.25
"""Of a factor's range: so far beyond each bound values are drawn, which then count as the bound.
Optima often lie on bounds, which a value drawn between them never meets."""
_LOST = 1.0
"""Violation of a point without an answer: as bad as a limit missed by its own size."""


@dataclass(frozen=True)
class Evaluation:
    """One point that was asked for."""

    point: Point
    answer: Answer
    objectives: Array
    """To be small, (m,); infinite without an answer."""
    violation: Array
    """Of each limit, relative, above 0 where it is broken, (c,)."""

    @property
    def feasible(self) -> bool:
        """Whether there is an answer within all limits."""
        return self.answer.values is not None and bool(np.all(self.violation <= 1e-9))


@dataclass
class Memory:
    """Every evaluation in order; the same point is computed once."""

    space: Space
    responses: tuple[WantedResponse, ...]
    folder: Folder | None = None
    function: Callable[[Task], Mapping[str, float]] = evaluate
    watch: Callable[[int], bool] = lambda _: True
    """Told the number of evaluations; answers False to stop."""
    evaluations: list[Evaluation] = field(default_factory=list)
    computed: int = 0
    _known: dict[str, Answer] = field(default_factory=dict)

    def at(self, unit: Array) -> Evaluation:
        """The evaluation at a point of the unit cube, (k,); raises StoppedError on request."""
        row = actual(self.space.factors, 2 * np.clip(unit, 0, 1)[None] - 1)[0]
        point = self.space.point(f"{len(self.evaluations) + 1}", row.tolist())
        answer = self._answer(point)
        found = Evaluation(
            point, answer, _objectives(self.responses, answer), _violation(self.responses, answer)
        )
        self.evaluations.append(found)
        if not self.watch(len(self.evaluations)):
            raise StoppedError
        return found

    def at_default(self) -> Answer:
        """The answer of the actuator as it is, which need not lie between the bounds."""
        task = Task("default", self.space.actuator, self.space.material, self.responses, None)
        return self._answer(Point("default", {}, task, task.key))

    def _answer(self, point: Point) -> Answer:
        if point.task is None:
            return Answer(None, point.error, 0.0)
        known = self._known.get(point.key)
        if known is None and self.folder is not None:
            known = self.folder.known(point.key)
        if known is None:
            value, error, seconds, defect = timed(self.function, point.task)
            known = Answer(value, error, seconds)
            self.computed += 1
            if self.folder is not None and not defect:
                self.folder.keep(point.key, known)
        self._known[point.key] = known
        return known


class StoppedError(Exception):
    """Somebody asked to stop; what was evaluated stays in the memory."""


def _objectives(responses: tuple[WantedResponse, ...], answer: Answer) -> Array:
    wanted = [one for one in responses if one.is_objective]
    if answer.values is None:
        return np.full(len(wanted), np.inf)
    values = []
    for one in wanted:
        value = answer.values[one.name]
        if one.target is not None:
            values.append(abs(value - one.target))
        else:
            values.append(-value if one.goal == "maximise" else value)
    return np.array(values)


def _violation(responses: tuple[WantedResponse, ...], answer: Answer) -> Array:
    """One for each limit, and one for the answer itself."""
    found = [-_LOST if answer.values is not None else _LOST]
    for one in responses:
        for limit, sign in ((one.at_most, 1.0), (one.at_least, -1.0)):
            if limit is not None:
                size = max(abs(limit), 1e-9)
                value = None if answer.values is None else answer.values[one.name]
                found.append(_LOST if value is None else sign * (value - limit) / size)
    return np.array(found)


@dataclass(frozen=True)
class Found:
    """What a search came to."""

    best: tuple[Evaluation, ...]
    """The best feasible evaluation of one objective, the Pareto front of several; maybe none."""
    memory: Memory


def search(spec: OptimisationSpec, memory: Memory) -> Found:
    """Search as the file says; stopping on request gives what was found so far."""
    how = spec.search
    try:
        match how:
            case CobylaSearch():
                _cobyla(how, memory)
            case NsgaSearch():
                _nsga(how, memory)
            case BayesianSearch():
                _bayesian(how, memory)
    except StoppedError:
        pass  # all that was evaluated is in the memory
    return Found(front(memory.evaluations), memory)


def front(evaluations: list[Evaluation]) -> tuple[Evaluation, ...]:
    """Feasible evaluations that no other one dominates, without repeats, by the first objective."""
    feasible = {tuple(one.objectives): one for one in evaluations if one.feasible}
    kept = [
        one
        for values, one in feasible.items()
        if not any(
            all(a <= b for a, b in zip(other, values, strict=True)) and other != values
            for other in feasible
        )
    ]
    return tuple(sorted(kept, key=lambda one: float(one.objectives[0])))


def _cobyla(how: CobylaSearch, memory: Memory) -> None:
    """scipy's COBYLA inside its basin hopping, from points of a Sobol sequence."""
    from scipy.optimize import basinhopping
    from scipy.stats import qmc

    k = len(memory.space.factors)
    last: dict[bytes, Evaluation] = {}

    def at(x: Array) -> Evaluation:
        key = np.asarray(x).tobytes()
        if key not in last:
            last.clear()  # COBYLA asks for objective and limits of one point in turn
            last[key] = memory.at(x)
        return last[key]

    scale = 1.0

    def value(x: Array) -> float:
        found = float(at(x).objectives[0]) / scale
        return found if np.isfinite(found) else 10.0

    limits = {"type": "ineq", "fun": lambda x: -at(x).violation}
    bounds = [{"type": "ineq", "fun": lambda x: np.concatenate([x, 1 - x])}]
    rng = np.random.default_rng(how.seed)
    starts = qmc.Sobol(k, rng=rng).random(power_of_two(how.starts))
    own = memory.space.own
    if own is not None:
        starts[0] = (own + 1) / 2
    for start in starts[: how.starts]:
        first = float(at(start).objectives[0])
        scale = max(abs(first), 1e-9) if np.isfinite(first) else scale
        basinhopping(
            value,
            start,
            niter=how.hops,
            stepsize=0.3,
            rng=rng,
            accept_test=lambda x_new, **_: bool(at(x_new).feasible),
            minimizer_kwargs={
                "method": "COBYLA",
                "constraints": [limits, *bounds],
                "options": {"maxiter": how.evaluations, "rhobeg": 0.2, "tol": 1e-4},
            },
        )


def _nsga(how: NsgaSearch, memory: Memory) -> None:
    problems = package("pymoo.core.problem", "search")
    algorithm = package("pymoo.algorithms.moo.nsga2", "search").NSGA2(pop_size=how.population)
    minimize = package("pymoo.optimize", "search").minimize
    lost = Answer(None, None, 0.0)
    objectives = _objectives(memory.responses, lost).size
    limits = _violation(memory.responses, lost).size

    class _Problem(problems.ElementwiseProblem):  # type: ignore[misc, name-defined]
        def __init__(self) -> None:
            k = len(memory.space.factors)
            super().__init__(n_var=k, n_obj=objectives, n_ieq_constr=limits, xl=0.0, xu=1.0)

        def _evaluate(self, x: Array, out: dict[str, Any], *_: Any, **__: Any) -> None:
            found = memory.at(x)
            out["F"] = np.where(np.isfinite(found.objectives), found.objectives, 1e30)
            out["G"] = found.violation

    minimize(_Problem(), algorithm, ("n_gen", how.generations), seed=how.seed)


def _bayesian(how: BayesianSearch, memory: Memory) -> None:
    optuna = package("optuna", "search")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    names = [one.name for one in memory.space.factors]

    def objective(trial: Any) -> float:
        unit = np.array([trial.suggest_float(name, -_BEYOND, 1 + _BEYOND) for name in names])
        found = memory.at(unit)
        for number, violation in enumerate(found.violation.tolist()):
            trial.set_constraint(str(number), violation)
        if not np.isfinite(found.objectives[0]):
            raise optuna.TrialPruned
        return float(found.objectives[0])

    sampler = optuna.samplers.TPESampler(
        seed=how.seed,
        n_startup_trials=max(5, how.evaluations // 4),
        multivariate=True,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        study = optuna.create_study(sampler=sampler)
        own = memory.space.own
        if own is not None:
            unit = np.clip((own + 1) / 2, 0, 1).tolist()
            study.enqueue_trial(dict(zip(names, unit, strict=True)))
        study.optimize(objective, n_trials=how.evaluations)
