"""The answer of one point: quantities of models, or of a recorded run, in field units."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rig.mechanics.job import Job
from rig.mechanics.store import FolderStore
from rig.spec.study import StudyResponse
from rig.study.errors import StudyError
from rig.study.plan import Task
from rig.study.quantities import Asked
from rig.study.summary import read_experiments

_EXPERIMENTS = {"angle": "deformation", "blocked_force": "blocked_force"}


def evaluate(task: Task) -> dict[str, float]:
    """Response to value; raises RigError where a model or a run has none."""
    values: dict[str, float] = {}
    for model in dict.fromkeys(one.model for one in task.responses):
        own = [one for one in task.responses if one.model == model]
        values |= _of_run(task, own) if model == "run" else _of_model(task, model, own)
    return {one.name: values[one.name] for one in task.responses}


def _of_model(task: Task, model: str, responses: list[StudyResponse]) -> dict[str, float]:
    asked = Asked(
        task.actuator,
        task.material,
        model,
        [one.pressure for one in responses],
        Job(FolderStore.of_user()),
        blocked=any(one.quantity == "blocked_force" for one in responses),
    )
    values = {}
    for one in responses:
        value = asked.value(one.quantity, one.pressure)
        if not np.isfinite(value):
            why = "; ".join(asked.response.shortfalls) or "the calculation did not get there"
            raise StudyError(f"{one.name} at {one.pressure / 1e3:g} kPa: {why}")
        values[one.name] = value
    return values


def _of_run(task: Task, responses: list[StudyResponse]) -> dict[str, float]:
    assert task.runs is not None
    run = task.runs / task.name
    experiments = read_experiments(run)
    return {one.name: _measured(run, experiments, one) for one in responses}


def _measured(run: Path, experiments: Mapping[str, Any], one: StudyResponse) -> float:
    """Mean over the branches at the response's pressure."""
    experiment = experiments.get(_EXPERIMENTS[one.quantity], {})
    wanted = one.pressure / 1e3
    found = [
        point["mean"]
        for point in experiment.get("points", [])
        if abs(point["pressure_kpa"] - wanted) < 0.05
    ]
    if not found:
        raise StudyError(f"{run}: {one.quantity} was not measured at {wanted:g} kPa.")
    return float(np.mean(found))
