"""From a study's file to its points: each one a spec, with a key of all that its answer needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rig.mechanics.store import content_key
from rig.spec.actuator import ActuatorSpec
from rig.spec.loading import Loaded, read
from rig.spec.material import MaterialSpec
from rig.spec.study import SpaceFillingDesign, StudyFactor, StudyResponse, StudySpec
from rig.spec.workspace import Workspace
from rig.study.design import coded_points
from rig.study.errors import StudyError
from rig.study.factors import Array, Factor, actual, coded
from rig.study.fields import NumericField, numeric_field, value_of, with_values


@dataclass(frozen=True)
class Task:
    """All that a worker needs for one point."""

    name: str
    actuator: ActuatorSpec
    material: MaterialSpec
    responses: tuple[StudyResponse, ...]
    runs: Path | None
    """Folder of recorded runs; the point's is called as the point."""

    @property
    def key(self) -> str:
        """Of spec, material, what is asked, and the source of `rig.mechanics`, which answers.

        Runs answer for the point's name, models for its spec alone, so that replicates share an
        answer.
        """
        of_run = any(one.model == "run" for one in self.responses)
        asked = {"name", "quantity", "model", "pressure"}
        return content_key(
            actuator=self.actuator.model_dump(mode="json"),
            material=self.material.model_dump(mode="json"),
            responses=[one.model_dump(mode="json", include=asked) for one in self.responses],
            run=_stamp(self) if of_run else None,
        )


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
    is_check: bool = False
    """Whether surfaces are judged by it instead of being fitted to it."""


@dataclass(frozen=True)
class Space:
    """An actuator of which some fields vary, and what is asked of it."""

    actuator: ActuatorSpec
    material: MaterialSpec
    fields: Mapping[str, NumericField]
    """Factor to field."""
    factors: tuple[Factor, ...]
    """With levels in SI, in the order of the file."""
    responses: tuple[StudyResponse, ...]
    runs: Path | None = None

    def in_lab_units(self, factor: str, value: float) -> float:
        """An SI value of a factor in its lab unit."""
        return self.fields[factor].to_lab(value)

    @property
    def own(self) -> Array | None:
        """The actuator as it is, coded, (k,); None where that is beyond the levels."""
        specs = {"actuator": self.actuator, "material": self.material}
        values = [value_of(specs[f.root], f.path) for f in self.fields.values()]
        found = coded(self.factors, np.array([values]))[0]
        return found if np.all(np.abs(found) <= 1 + 1e-9) else None

    def point(self, name: str, row: Sequence[float]) -> Point:
        """The point with SI values `row` of the factors; without a task where that is no spec."""
        values = {
            factor: float(round(value)) if field.whole else float(value)
            for (factor, field), value in zip(self.fields.items(), row, strict=True)
        }

        def of(root: str) -> dict[tuple[str, ...], float]:
            return {
                field.path: int(values[factor]) if field.whole else values[factor]
                for factor, field in self.fields.items()
                if field.root == root
            }

        try:
            task = Task(
                name,
                with_values(self.actuator, of("actuator")),
                with_values(self.material, of("material")),
                self.responses,
                self.runs,
            )
        except StudyError as error:
            return Point(name, values, None, "", str(error))
        return Point(name, values, task, task.key)


@dataclass(frozen=True)
class Plan:
    """A study, resolved."""

    spec: StudySpec
    text: str
    """Of its file."""
    space: Space
    points: tuple[Point, ...]

    @property
    def factors(self) -> tuple[Factor, ...]:
        """With levels in SI, in the order of the file."""
        return self.space.factors

    @property
    def fields(self) -> Mapping[str, NumericField]:
        """Factor to field."""
        return self.space.fields

    def in_lab_units(self, factor: str, value: float) -> float:
        """An SI value of a factor in its lab unit."""
        return self.space.in_lab_units(factor, value)


def make_plan(path: Path, workspace: Workspace) -> Plan:
    """The study in a file; raises SpecError, and StudyError for factors that are not in the spec,
    levels that cannot be, and designs that cannot be made."""
    source, space = read_study(path, workspace)
    spec = source.spec
    levels = actual(space.factors, coded_points(spec.design, len(space.factors)))
    width = len(str(len(levels)))
    points = tuple(space.point(f"{i:0{width}d}", row) for i, row in enumerate(levels.tolist(), 1))
    if all(point.task is None for point in points):
        raise StudyError(f"{path}: no point of the design is a valid spec: {points[0].error}")
    return Plan(spec, source.text, space, (*points, *_check_points(space, spec.check_points)))


def _check_points(space: Space, count: int) -> list[Point]:
    if not count:
        return []
    design = SpaceFillingDesign(kind="latin-hypercube", points=count)
    rows = actual(space.factors, coded_points(design, len(space.factors)))
    points = (space.point(f"check-{i}", row) for i, row in enumerate(rows.tolist(), 1))
    return [replace(point, is_check=True) for point in points]


def read_study(path: Path, workspace: Workspace) -> tuple[Loaded[StudySpec], Space]:
    """A study's file and its space, without the points of the design; raises as `make_plan`."""
    source = read(path, StudySpec)
    spec = source.spec
    runs = None if spec.runs is None else path.parent / spec.runs
    space = make_space(path, workspace, spec.actuator, spec.factors, spec.responses, runs)
    return source, space


def make_space(
    path: Path,
    workspace: Workspace,
    actuator: str,
    factors: Sequence[StudyFactor],
    responses: Sequence[StudyResponse],
    runs: Path | None = None,
) -> Space:
    """The space that a file at `path` describes; raises SpecError and StudyError."""
    drawing = read(workspace.path("actuator", actuator, beside=path.parent), ActuatorSpec)
    material = workspace.resolve_actuator(drawing).spec
    fields: dict[str, NumericField] = {}
    levels = []
    for one in factors:
        try:
            field = numeric_field(one.field, drawing.spec, material)
            levels.append(Factor(one.name, field.parse(one.low), field.parse(one.high)))
        except StudyError as error:
            raise StudyError(f"{path}: factor '{one.name}': {error}") from None
        fields[one.name] = field
    return Space(drawing.spec, material, fields, tuple(levels), tuple(responses), runs)


def _stamp(task: Task) -> str:
    """A run's summary by its content; a run that is not there yet has none."""
    assert task.runs is not None
    path = task.runs / task.name / "summary.json"
    return path.read_text(encoding="utf-8") if path.is_file() else f"{task.name}: not there"
