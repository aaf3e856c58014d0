"""What a study leaves behind: an answer a point as soon as it is there, one table, one manifest."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig import __version__
from rig.spec.workspace import is_path
from rig.study.errors import StudyError
from rig.study.extras import package
from rig.study.plan import Plan, Point, Space, Task
from rig.study.quantities import UNITS

RESULTS, MANIFEST, ANSWERS = "results.parquet", "manifest.json", "answers"


@dataclass(frozen=True)
class Answer:
    """What is known of a point."""

    values: Mapping[str, float] | None
    """Response to value in its field unit; None of a failure."""
    error: str | None
    seconds: float
    """That it took, when it was computed."""


@dataclass(frozen=True)
class Folder:
    """A study's folder; answers in it are found again by what they depend on."""

    path: Path

    def known(self, key: str) -> Answer | None:
        """The answer of a key, if there is a readable one."""
        try:
            content = json.loads(self._answer(key).read_text(encoding="utf-8"))
            return Answer(content["values"], content["error"], content["seconds"])
        except (OSError, ValueError, KeyError):
            return None

    def keep(self, key: str, answer: Answer) -> None:
        """Write an answer, as a whole or not at all; raises StudyError."""
        content = {"values": answer.values, "error": answer.error, "seconds": answer.seconds}
        write_whole(self._answer(key), json.dumps(content).encode())

    def finish(
        self, plan: Plan, answers: Sequence[tuple[Point, Answer]], how: Mapping[str, Any]
    ) -> None:
        """Write the table and its manifest; raises StudyError."""
        arrow = package("pyarrow", "study")
        parquet = package("pyarrow.parquet", "study")
        table = arrow.table(columns(plan, answers))
        buffer = arrow.BufferOutputStream()
        parquet.write_table(table, buffer)
        data = buffer.getvalue().to_pybytes()
        write_whole(self.path / RESULTS, data)
        manifest = _manifest(plan, answers, how, hashlib.sha256(data).hexdigest())
        write_whole(self.path / MANIFEST, (json.dumps(manifest, indent=2) + "\n").encode())

    def _answer(self, key: str) -> Path:
        return self.path / ANSWERS / f"{key}.json"


def write_whole(path: Path, data: bytes) -> None:
    """Write a file as a whole or not at all; raises StudyError."""
    partial = path.with_name(f"{path.name}.partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with partial.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        raise StudyError(
            f"results cannot be written to {path}: {error.strerror}. Name a folder that you "
            f"may write to, on a disk with room."
        ) from None


def remove_specs(folder: Path, stem: str) -> None:
    """Remove what `write_specs` wrote as STEM-1, STEM-2, ...; raises StudyError."""
    ours = re.compile(rf"{re.escape(stem)}-\d+(-material)?\.yaml")
    try:
        for path in list(folder.glob("*.yaml")):
            if ours.fullmatch(path.name):
                path.unlink()
    except OSError as error:
        raise StudyError(f"{folder}: old specs cannot be removed: {error.strerror}.") from None


def write_specs(folder: Path, name: str, task: Task, space: Space) -> None:
    """A point's actuator as NAME.yaml, and its material beside it.

    The material is left out where it is the workspace's own, called by its name: a path to it need
    not lead there from `folder`. Raises StudyError where they cannot be written.
    """
    actuator = task.actuator.model_dump(mode="json", exclude_none=True)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if task.material != space.material or is_path(task.actuator.material):
            material = task.material.model_dump(mode="json", exclude_none=True)
            _write_yaml(folder / f"{name}-material.yaml", material)
            actuator["material"] = f"./{name}-material.yaml"
        _write_yaml(folder / f"{name}.yaml", {**actuator, "name": f"{task.actuator.name}-{name}"})
    except OSError as error:
        raise StudyError(f"specs cannot be written to {folder}: {error.strerror}.") from None


def _write_yaml(path: Path, data: dict[str, Any]) -> None:
    from ruamel.yaml import YAML

    with path.open("w", encoding="utf-8") as file:
        YAML().dump(data, file)


def columns(plan: Plan, answers: Sequence[tuple[Point, Answer]]) -> dict[str, list[Any]]:
    """The table: point, factors in lab units, responses, error; None where there is no value."""
    found: dict[str, list[Any]] = {"point": [point.name for point, _ in answers]}
    for factor in plan.factors:
        found[factor.name] = [
            plan.in_lab_units(factor.name, point.values[factor.name]) for point, _ in answers
        ]
    for response in plan.spec.responses:
        found[response.name] = [
            None if answer.values is None else answer.values[response.name] for _, answer in answers
        ]
    found["error"] = [answer.error for _, answer in answers]
    found["seconds"] = [answer.seconds for _, answer in answers]
    return found


def _manifest(
    plan: Plan, answers: Sequence[tuple[Point, Answer]], how: Mapping[str, Any], digest: str
) -> dict[str, Any]:
    return {
        "study": plan.spec.name,
        "rig": __version__,
        "study_sha256": hashlib.sha256(plan.text.encode()).hexdigest(),
        "study_text": plan.text,
        "results": RESULTS,
        "results_sha256": digest,
        "factors": [
            {
                "name": factor.name,
                "field": str(plan.fields[factor.name]),
                "unit": plan.fields[factor.name].lab_unit,
                "low": plan.in_lab_units(factor.name, factor.low),
                "high": plan.in_lab_units(factor.name, factor.high),
            }
            for factor in plan.factors
        ],
        "responses": [
            {"name": one.name, "quantity": one.quantity, "unit": UNITS[one.quantity]}
            for one in plan.spec.responses
        ],
        "points": len(answers),
        "failed": {point.name: answer.error for point, answer in answers if answer.error},
        "keys": {point.name: point.key for point, _ in answers},
        **how,
    }
