"""Builds what people read of a run, from its log alone: summary, tables, report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rig.experiment.program import TrialPlan
from rig.mechanics.errors import MechanicsError
from rig.mechanics.job import Job
from rig.mechanics.model import predict
from rig.mechanics.response import Response
from rig.mechanics.store import Remembering
from rig.record.reader import RunReader
from rig.record.tables import write_tables
from rig.report.analysis import PRESSURE_NOISE_KPA, summarise
from rig.report.data import RunData, load_run
from rig.report.errors import ReportError
from rig.report.page import render_report
from rig.report.strength import StrengthSection, strength_section
from rig.report.summary import RunSummary
from rig.report.trials import PartData, summarise_trials, trial_data, trial_sections
from rig.spec.published import PublishedReference
from rig.spec.workspace import Workspace, library_root

SUMMARY_FILE = "summary.json"
REPORT_FILE = "report.html"
CURVE_POINTS = 101
FINITE_ELEMENTS = "fe"
GAS_ALARMS = ("leak", "burst")
"""Events of the log that are told on top of the report."""


@dataclass(frozen=True)
class Analysis:
    """A run, what the models say of it, and the summary of both."""

    data: RunData
    predictions: dict[str, Response]
    summary: RunSummary
    trials: list[tuple[TrialPlan, list[PartData]]]


def analyse(reader: RunReader, job: Job | None = None) -> Analysis:
    """Predict and summarise a run; `job` is how long predictions are carried out.

    Raises RecordError or SpecError for a log that does not hold the set-up of a run.
    """
    data = load_run(reader)
    predictions, notes = _predictions(data, job or Job())
    notes += [str(e.data["what"]) for e in reader.events() if e.name in GAS_ALARMS]
    summary = summarise(data, predictions, _published(), notes)
    trials = trial_data(data)
    summary = summary.model_copy(update={"trials": summarise_trials(trials)})
    return Analysis(data, predictions, summary, trials)


def build_report(
    folder: Path, reader: RunReader | None = None, job: Job | None = None
) -> RunSummary:
    """Write summary.json, CSV tables and report.html of a run into `folder`.

    The run is that of `reader`, by default the one recorded in `folder`; nothing but its log is
    read. `job` is how long predictions are carried out. Raises RecordError or SpecError for a log
    that does not hold a run, ReportError if the folder cannot be written.
    """
    reader = reader or RunReader(folder)
    job = job or Job()
    # what was predicted is asked for again for its stresses: without a cache, too
    job = replace(job, store=Remembering(job.store))
    analysis = analyse(reader, job)
    strength = _strength(analysis, job)
    page = render_report(
        analysis.data,
        analysis.summary,
        analysis.predictions,
        strength,
        trial_sections(analysis.trials, analysis.summary.trials),
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_tables(reader, folder)
        write_text(folder / SUMMARY_FILE, analysis.summary.to_json())
        write_text(folder / REPORT_FILE, page)
    except OSError as error:
        raise ReportError(
            f"{folder}: the report cannot be written: {error.strerror}. The log is untouched; "
            f"`rig report` writes the report again."
        ) from error
    return analysis.summary


def write_text(path: Path, text: str) -> None:
    """Replace a file as a whole, so that no reader ever sees half of it."""
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8", newline="\n")
    partial.replace(path)


def _predictions(data: RunData, job: Job) -> tuple[dict[str, Response], list[str]]:
    """The models' responses over the pressures of the run, and why some are missing."""
    actuator, material = data.setup.actuator, data.setup.material
    if data.setup.protocol.deformation is None and data.setup.protocol.blocked_force is None:
        return {}, []
    top = _top(data)
    targets = [1e3 * point.key.target_kpa for point in data.points]
    # a model that ends between two points of a curve still answers at the pressure it ended at
    pressures = np.union1d(np.linspace(0.0, top, CURVE_POINTS), np.minimum(targets, top))
    found: dict[str, Response] = {}
    notes: list[str] = []
    for model in actuator.predictions:
        try:
            found[model] = predict(actuator, material, model, pressures, job)
        except MechanicsError as error:
            notes.append(f"There is no prediction of the model {model}: {error}")
            continue
        told = (*found[model].shortfalls, *found[model].cautions)
        notes += [f"The model {model}: {note}" for note in told]
    return found, notes


def _top(data: RunData) -> float:
    """The highest pressure in Pa that the run asked for or reached, within the actuator's limit.

    Where noise alone lies above what was asked for, a model's end answers for it: another rung of
    finite elements would cost its time for nothing.
    """
    sections = [data.setup.protocol.deformation, data.setup.protocol.blocked_force]
    asked = max((s.pressures.stop for s in sections if s is not None), default=0.0)
    reached = 1e3 * (data.highest_kpa - PRESSURE_NOISE_KPA)
    return min(max(asked, reached), data.setup.actuator.limits.pressure)


def _strength(analysis: Analysis, job: Job) -> StrengthSection | None:
    """Stress and strain where finite elements were among the models that answered."""
    if FINITE_ELEMENTS not in analysis.predictions:
        return None
    setup = analysis.data.setup
    return strength_section(setup.actuator, setup.material, _top(analysis.data), job)


def _published() -> Sequence[PublishedReference]:
    """Figures of papers in the library that ships with rig."""
    return Workspace(library_root(), is_library=True).published()
