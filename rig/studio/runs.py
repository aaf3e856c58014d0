"""The recorded runs of a workspace as a list to look through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from rig.record.channels import LOG_FILE
from rig.report.build import REPORT_FILE, SUMMARY_FILE
from rig.report.summary import RunSummary
from rig.report.words import model_name, significant

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


def _row(folder: Path) -> RunRow:
    files = _files(folder)
    has_report = (folder / REPORT_FILE).is_file()
    try:
        text = (folder / SUMMARY_FILE).read_text(encoding="utf-8")
        summary = RunSummary.model_validate_json(text)
    except (OSError, ValidationError, UnicodeDecodeError):
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
