"""A study from its plan to its answers: known ones are taken, the others computed and kept."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from rig.study.errors import StudyError
from rig.study.evaluate import evaluate
from rig.study.executor import Executor
from rig.study.extras import package
from rig.study.plan import Plan, Point, Task
from rig.study.results import Answer, Folder

AFTERWARDS = ("pyarrow", "statsmodels")
"""Packages that table and surfaces take."""


@dataclass(frozen=True)
class Standing:
    """How far a study got."""

    done: int
    total: int
    """Distinct points that have to be computed."""
    left_s: float | None
    """Estimate of the time that is left; None before the first point."""


@dataclass(frozen=True)
class Study:
    """A finished study; failed points are among the answers, with why."""

    plan: Plan
    answers: tuple[tuple[Point, Answer], ...]
    computed: int
    """Points that were computed now, not known before; replicates once."""

    @property
    def fitted(self) -> tuple[tuple[Point, Mapping[str, float]], ...]:
        """Points with values that surfaces are fitted to."""
        return self._sound(is_check=False)

    @property
    def checked(self) -> tuple[tuple[Point, Mapping[str, float]], ...]:
        """Points with values that surfaces are judged by."""
        return self._sound(is_check=True)

    def _sound(self, *, is_check: bool) -> tuple[tuple[Point, Mapping[str, float]], ...]:
        return tuple(
            (p, a.values)
            for p, a in self.answers
            if a.values is not None and p.is_check is is_check
        )

    @property
    def failed(self) -> tuple[tuple[Point, Answer], ...]:
        """Points without values."""
        return tuple((p, a) for p, a in self.answers if a.values is None)


def run_study(
    plan: Plan,
    folder: Folder,
    executor: Executor,
    watch: Callable[[Standing], bool] = lambda _: True,
    function: Callable[[Task], Mapping[str, float]] = evaluate,
    how: Mapping[str, Any] | None = None,
) -> Study | None:
    """Answer all points of `plan`, and write table and manifest (with `how` it was computed).

    Every answer is kept as soon as it is there, failures too, except those of workers that died.
    `watch` is told of each, and answers False to stop: the result is None then, and the next call
    goes on. Raises StudyError where results cannot be written,
    and before anything is computed where the extra `study` is not installed.
    """
    for needed in AFTERWARDS:  # to be missed now, not after a night of computing
        package(needed, "study")
    known: dict[str, Answer] = {}
    wanted: dict[str, Task] = {}
    for point in plan.points:
        if point.task is None or point.key in known or point.key in wanted:
            continue
        found = folder.known(point.key)
        if found is not None:
            known[point.key] = found
        else:
            wanted[point.key] = point.task
    keys = list(wanted)
    began = time.monotonic()
    if not watch(Standing(0, len(keys), None)):
        return None
    outcomes = executor.map(function, list(wanted.values())) if keys else iter(())
    for done, outcome in enumerate(outcomes, 1):
        answer = Answer(outcome.value, outcome.error, outcome.seconds)
        key = keys[outcome.index]
        known[key] = answer
        if outcome.lasting:
            folder.keep(key, answer)
        left = (time.monotonic() - began) / done * (len(keys) - done)
        if not watch(Standing(done, len(keys), left)):
            outcomes.close()  # type: ignore[attr-defined]
            return None
    answers = _answers(plan, known)
    folder.finish(plan, answers, how or {})
    return Study(plan, answers, len(keys))


def known_study(plan: Plan, folder: Folder) -> Study:
    """The finished study in `folder`; raises StudyError where answers are missing."""
    known = {
        point.key: found
        for point in plan.points
        if point.task is not None and (found := folder.known(point.key)) is not None
    }
    if any(point.task is not None and point.key not in known for point in plan.points):
        raise StudyError(
            f"the study '{plan.spec.name}' is not finished in {folder.path}; run `rig study` first."
        )
    return Study(plan, _answers(plan, known), 0)


def _answers(plan: Plan, known: Mapping[str, Answer]) -> tuple[tuple[Point, Answer], ...]:
    """In the order of the points; those that are no spec fail with why."""
    return tuple(
        (point, known[point.key] if point.task is not None else Answer(None, point.error, 0.0))
        for point in plan.points
    )
