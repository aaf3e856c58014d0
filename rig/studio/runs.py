"""The recorded runs of a workspace as a list to look through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from rig.record.channels import LOG_FILE
from rig.record.documents import ExperimentName
from rig.report.build import REPORT_FILE, SUMMARY_FILE
from rig.report.summary import RunSummary
from rig.report.words import model_name, significant
from rig.studio.curves import Array

NO_SUMMARY = "no report yet"
DOWNLOADS = (LOG_FILE, SUMMARY_FILE, REPORT_FILE)
"""Files of a run that are offered first; its tables follow."""


@dataclass(frozen=True)
class RunRow:
    """One run in words."""

    name: str
    """Of its folder in logs/."""
    status: str
    actuator: str = ""
    bench: str = ""
    protocol: str = ""
    seed: str = ""
    measured: str = ""
    errors: str = ""
    """Root mean square errors of the models."""
    has_report: bool = False
    files: tuple[str, ...] = ()

    @property
    def searched(self) -> str:
        """What a filter looks at."""
        return " ".join(
            (self.name, self.status, self.actuator, self.bench, self.protocol)
        ).casefold()


def list_runs(logs: Path) -> tuple[RunRow, ...]:
    """Every folder of `logs` with a log in it, the latest written first."""
    folders = [p for p in logs.iterdir() if (p / LOG_FILE).is_file()] if logs.is_dir() else []
    folders.sort(key=lambda p: ((p / LOG_FILE).stat().st_mtime, p.name), reverse=True)
    return tuple(_row(folder) for folder in folders)


def matching(rows: Sequence[RunRow], wanted: str) -> tuple[RunRow, ...]:
    """Rows in which every word of `wanted` occurs."""
    words = wanted.casefold().split()
    return tuple(row for row in rows if all(word in row.searched for word in words))


def summary_of(folder: Path) -> RunSummary | None:
    """What the last report found out; None if there is none that can be read."""
    try:
        text = (folder / SUMMARY_FILE).read_text(encoding="utf-8")
        return RunSummary.model_validate_json(text)
    except (OSError, ValidationError, UnicodeDecodeError):
        return None


@dataclass(frozen=True)
class Levels:
    """Means of an experiment, or what a model says there, against pressure; (n,) each."""

    label: str
    pressure_kpa: Array
    value: Array
    is_model: bool


def levels_of(summary: RunSummary, experiment: ExperimentName, run: str) -> tuple[Levels, ...]:
    """The ascending branch as it was measured, then each model; nothing if it was not measured."""
    found = summary.experiments.get(experiment)
    up = [level for level in found.points if level.direction == "up"] if found else []
    if found is None or not up:
        return ()
    measured = Levels(
        f"{run}, measured",
        np.array([level.measured_pressure_kpa for level in up]),
        np.array([level.mean for level in up]),
        is_model=False,
    )
    models = (
        Levels(
            f"{run}, {model_name(name)}",
            np.array([error.pressure_kpa for error in model.errors]),
            np.array([error.predicted for error in model.errors]),
            is_model=True,
        )
        for name, model in found.models.items()
    )
    return (measured, *models)


def short_names(names: Sequence[str]) -> list[str]:
    """Names of runs without the words that they all begin with."""
    split = [name.split("-") for name in names]
    most = min(map(len, split)) - 1  # at least a word is left of each
    shared = takewhile(lambda words: len(set(words)) == 1, zip(*split, strict=False))
    first = min(len(list(shared)), most)
    return ["-".join(words[first:]) for words in split]


def _row(folder: Path) -> RunRow:
    files = _files(folder)
    has_report = (folder / REPORT_FILE).is_file()
    summary = summary_of(folder)
    if summary is None:
        return RunRow(folder.name, NO_SUMMARY, has_report=has_report, files=files)
    return RunRow(
        name=folder.name,
        status=summary.status,
        actuator=summary.actuator,
        bench=summary.bench,
        protocol=summary.protocol,
        seed=str(summary.seed),
        measured=", ".join(
            f"{name.replace('_', ' ')} {e.measured} of {e.planned}"
            for name, e in summary.experiments.items()
        ),
        errors="; ".join(
            f"{model_name(model)}: {significant(m.rmse.value, 2)} {m.rmse.unit}"
            for e in summary.experiments.values()
            for model, m in e.models.items()
        ),
        has_report=has_report,
        files=files,
    )


def _files(folder: Path) -> tuple[str, ...]:
    first = [name for name in DOWNLOADS if (folder / name).is_file()]
    tables = sorted(p.name for p in folder.glob("*.csv"))
    return (*first, *tables)
