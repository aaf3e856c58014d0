"""Several runs beside each other: curves, errors of models, and whether the runs agree."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.mechanics.job import Job
from rig.record.documents import ExperimentName
from rig.record.reader import RunReader
from rig.report.build import analyse, write_text
from rig.report.charts import Chart, Residuals, comparison_chart, residual_chart
from rig.report.data import EXPERIMENTS
from rig.report.errors import ReportError
from rig.report.figures import branch_of
from rig.report.page import environment
from rig.report.summary import ExperimentSummary, LevelSummary, RunSummary
from rig.report.words import number, significant, uncertain
from rig.validate.metrics import en_number
from rig.validate.uncertainty import Estimate, coverage_factor


@dataclass(frozen=True)
class NamedRun:
    """A run and what it is called in the comparison."""

    name: str
    summary: RunSummary


@dataclass(frozen=True)
class Agreement:
    """The largest difference of a run from the first one, against their uncertainties."""

    run: str
    first: str
    difference: float
    pressure_kpa: float
    en: float
    """Difference over its expanded uncertainty; beyond 1 they do not agree."""
    levels: int
    beyond: int

    @property
    def agrees(self) -> bool:
        """At every common pressure the runs are equal within their uncertainties."""
        return self.beyond == 0


def read_runs(folders: Sequence[Path], job: Job | None = None) -> list[NamedRun]:
    """Analyse each run from its log; `job` is how long predictions are carried out.

    Raises ReportError for fewer than two runs, and what `analyse` raises for each.
    """
    if len(folders) < 2:
        raise ReportError("a comparison needs at least two runs. Name more run folders.")
    names = _names(folders)
    return [
        NamedRun(name, analyse(RunReader(folder), job).summary)
        for name, folder in zip(names, folders, strict=True)
    ]


def _names(folders: Sequence[Path]) -> list[str]:
    """Folder names; numbered where two are the same."""
    plain = [(f.parent if f.is_file() else f).resolve().name for f in folders]
    return [
        name if plain.count(name) == 1 else f"{name} ({index})"
        for index, name in enumerate(plain, start=1)
    ]


def agreements(runs: Sequence[NamedRun], experiment: ExperimentName) -> list[Agreement]:
    """Each later run against the first, at the ascending pressures that both have."""
    first, *others = runs
    found = []
    for other in others:
        here = _levels(first.summary.experiments.get(experiment))
        there = _levels(other.summary.experiments.get(experiment))
        common = sorted(here.keys() & there.keys())
        if not common:
            continue
        ens = {kpa: en_number(_estimate(here[kpa]), _estimate(there[kpa])) for kpa in common}
        worst = max(common, key=lambda kpa: abs(ens[kpa]))
        found.append(
            Agreement(
                run=other.name,
                first=first.name,
                difference=there[worst].mean - here[worst].mean,
                pressure_kpa=worst,
                en=ens[worst],
                levels=len(common),
                beyond=sum(abs(en) > 1 for en in ens.values()),
            )
        )
    return found


def _levels(experiment: ExperimentSummary | None) -> dict[float, LevelSummary]:
    levels = experiment.points if experiment is not None else ()
    return {level.pressure_kpa: level for level in levels if level.direction == "up"}


def _estimate(level: LevelSummary) -> Estimate:
    return Estimate(level.mean, level.u95 / coverage_factor(float("inf")))


@dataclass(frozen=True)
class Row:
    """One run in one experiment, in words."""

    run: str
    status: str
    seed: int
    points: str
    top: str
    errors: tuple[str, ...]
    repeatability: str
    hysteresis: str


@dataclass(frozen=True)
class ComparedExperiment:
    """One experiment of all runs."""

    title: str
    unit: str
    models: tuple[str, ...]
    rows: tuple[Row, ...]
    chart: Chart
    differences: Chart | None
    agreements: tuple[Agreement, ...]


def compare(runs: Sequence[NamedRun]) -> list[ComparedExperiment]:
    """Lay runs beside each other, experiment by experiment; those nobody measured are left out.

    Bending angles and elongations are apart: one is no error of the other. Raises ReportError if no
    experiment was measured in any run.
    """
    found = []
    for name in EXPERIMENTS:
        alike: dict[str, list[tuple[NamedRun, ExperimentSummary]]] = {}
        for run in runs:
            experiment = run.summary.experiments.get(name)
            if experiment is not None and experiment.points:
                alike.setdefault(experiment.unit, []).append((run, experiment))
        for having in alike.values():
            agreed = agreements([run for run, _ in having], name)
            found.append(_compared(name, having, agreed))
    if not found:
        raise ReportError("none of these runs has a measured point: there is nothing to compare.")
    return found


def _compared(
    name: ExperimentName,
    having: Sequence[tuple[NamedRun, ExperimentSummary]],
    agreed: Sequence[Agreement],
) -> ComparedExperiment:
    models = tuple(sorted({model for _, experiment in having for model in experiment.models}))
    first = having[0][1]
    names = ", ".join(run.name for run, _ in having)
    chart = comparison_chart(
        f"{name}-{first.unit}-comparison",
        f"{first.quantity} ({first.unit})",
        [branch_of(experiment, "up", run.name) for run, experiment in having],
        f"{first.quantity.capitalize()} against pressure of the runs {names}.",
    )
    differences = [d for d in (_differences(having[0], other) for other in having[1:]) if d]
    return ComparedExperiment(
        title=first.quantity.capitalize(),
        unit=first.unit,
        models=models,
        rows=tuple(_row(run, experiment, models) for run, experiment in having),
        chart=chart,
        differences=residual_chart(
            f"{name}-{first.unit}-differences",
            f"difference from the first run ({first.unit})",
            differences,
            f"Difference of the {first.quantity} from the run {having[0][0].name}, with the "
            f"expanded uncertainty of the difference.",
            legend=True,
        )
        if differences
        else None,
        agreements=tuple(agreed),
    )


def _differences(
    first: tuple[NamedRun, ExperimentSummary], other: tuple[NamedRun, ExperimentSummary]
) -> Residuals | None:
    here, there = _levels(first[1]), _levels(other[1])
    common = sorted(here.keys() & there.keys())
    if not common:
        return None
    return Residuals(
        other[0].name,
        np.array(common),
        np.array([there[kpa].mean - here[kpa].mean for kpa in common]),
        np.array([math.hypot(here[kpa].u95, there[kpa].u95) for kpa in common]),
    )


def _row(run: NamedRun, experiment: ExperimentSummary, models: Sequence[str]) -> Row:
    up = [level for level in experiment.points if level.direction == "up"]
    top = max(up, key=lambda level: level.pressure_kpa) if up else None
    found = experiment.models
    repeatability, hysteresis = experiment.repeatability, experiment.hysteresis
    nothing = number(None, 0)
    return Row(
        run=run.name,
        status=run.summary.status,
        seed=run.summary.seed,
        points=f"{experiment.measured} of {experiment.planned}",
        top=f"{uncertain(top.mean, top.u95)} at {top.pressure_kpa:g} kPa"
        if top
        else number(None, 0),
        errors=tuple(
            uncertain(found[m].rmse.value, found[m].rmse.u95) if m in found else nothing
            for m in models
        ),
        repeatability=significant(repeatability.sd, 2) if repeatability else nothing,
        hysteresis=significant(hysteresis.difference, 2) if hysteresis else nothing,
    )


def write_comparison(path: Path, runs: Sequence[NamedRun]) -> list[ComparedExperiment]:
    """Write one offline HTML page; returns what it shows.

    Raises ReportError if nothing can be compared or the file cannot be written.
    """
    experiments = compare(runs)
    page = environment().get_template("compare.html.j2").render(runs=runs, experiments=experiments)
    try:
        write_text(path, page)
    except OSError as error:
        raise ReportError(
            f"{path}: the comparison cannot be written: {error.strerror}. Choose another file "
            f"with --out."
        ) from error
    return experiments
