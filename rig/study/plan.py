"""From a study's file to its points: each one a spec, with a key of all that its answer needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.mechanics.store import content_key
from rig.spec.actuator import ActuatorSpec
from rig.spec.loading import Loaded, read
from rig.spec.material import MaterialSpec
from rig.spec.study import StudyResponse, StudySpec
from rig.spec.workspace import Workspace
from rig.study.design import coded_points
from rig.study.errors import StudyError
from rig.study.factors import Factor, actual
from rig.study.fields import NumericField, numeric_field, with_values


@dataclass(frozen=True)
class Task:
    """All that a worker needs for one point."""

    name: str
    actuator: ActuatorSpec
    material: MaterialSpec
    responses: tuple[StudyResponse, ...]
    runs: Path | None
    """Folder of recorded runs; the point's is called as the point."""


@dataclass(frozen=True)
class Point:
    """One point of the design."""

    name: str
    values: Mapping[str, float]
    """Factor to value in SI, whole where the field takes whole numbers."""
    task: Task | None
    """None of a point that is no spec."""
    key: str
    error: str | None = None
    """Why it is none."""


@dataclass(frozen=True)
class Plan:
    """A study, resolved."""

    spec: StudySpec
    text: str
    """Of its file."""
    actuator: ActuatorSpec
    material: MaterialSpec
    fields: Mapping[str, NumericField]
    """Factor to field."""
    factors: tuple[Factor, ...]
    """With levels in SI, in the order of the file."""
    points: tuple[Point, ...]

    def in_lab_units(self, factor: str, value: float) -> float:
        """An SI value of a factor in its lab unit."""
        return self.fields[factor].to_lab(value)


def make_plan(path: Path, workspace: Workspace) -> Plan:
    """The study in a file; raises SpecError, and StudyError for factors that are not in the spec,
    levels that cannot be, and designs that cannot be made."""
    source = read(path, StudySpec)
    spec = source.spec
    drawing = read(workspace.path("actuator", spec.actuator, beside=path.parent), ActuatorSpec)
    material = workspace.resolve_actuator(drawing).spec
    fields, factors = _factors(path, spec, drawing, material)
    coded = coded_points(spec.design, len(factors))
    runs = None if spec.runs is None else path.parent / spec.runs
    levels = actual(factors, coded)
    width = len(str(len(levels)))
    points = tuple(
        _point(spec, f"{i:0{width}d}", row, fields, drawing.spec, material, runs)
        for i, row in enumerate(levels, 1)
    )
    if all(point.task is None for point in points):
        raise StudyError(f"{path}: no point of the design is a valid spec: {points[0].error}")
    return Plan(spec, source.text, drawing.spec, material, fields, factors, points)


def _factors(
    path: Path, spec: StudySpec, drawing: Loaded[ActuatorSpec], material: MaterialSpec
) -> tuple[dict[str, NumericField], tuple[Factor, ...]]:
    fields, factors = {}, []
    for one in spec.factors:
        try:
            field = numeric_field(one.field, drawing.spec, material)
            factors.append(Factor(one.name, field.parse(one.low), field.parse(one.high)))
        except StudyError as error:
            raise StudyError(f"{path}: factor '{one.name}': {error}") from None
        fields[one.name] = field
    return fields, tuple(factors)


def _point(
    spec: StudySpec,
    name: str,
    row: np.ndarray,
    fields: Mapping[str, NumericField],
    actuator: ActuatorSpec,
    material: MaterialSpec,
    runs: Path | None,
) -> Point:
    values = {
        factor: float(round(value)) if field.whole else float(value)
        for (factor, field), value in zip(fields.items(), row.tolist(), strict=True)
    }

    def of(root: str) -> dict[tuple[str, ...], float]:
        return {
            field.path: int(values[factor]) if field.whole else values[factor]
            for factor, field in fields.items()
            if field.root == root
        }

    try:
        task = Task(
            name,
            with_values(actuator, of("actuator")),
            with_values(material, of("material")),
            spec.responses,
            runs,
        )
    except StudyError as error:
        return Point(name, values, None, "", str(error))
    return Point(name, values, task, _key(task))


def _key(task: Task) -> str:
    """Of everything that an answer depends on, the code that answers included.

    Runs answer for the point's name, models for its spec alone, so that replicates share an answer.
    """
    of_run = any(one.model == "run" for one in task.responses)
    return content_key(
        actuator=task.actuator.model_dump(mode="json"),
        material=task.material.model_dump(mode="json"),
        responses=[
            one.model_dump(mode="json", include={"name", "quantity", "model", "pressure"})
            for one in task.responses
        ],
        run=_stamp(task) if of_run else None,
    )


def _stamp(task: Task) -> str:
    """A run's summary by its content; a run that is not there yet has none."""
    assert task.runs is not None
    path = task.runs / task.name / "summary.json"
    return path.read_text(encoding="utf-8") if path.is_file() else f"{task.name}: not there"
