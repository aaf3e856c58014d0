"""The outcome of a run on the terminal."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from rig.report.summary import RunSummary


def show_summary(console: Console, summary: RunSummary, folder: Path) -> None:
    """Print each model's error beside the published one, and where the report is."""
    table = Table("experiment", "points", "model", "RMSE", "bias", "largest error")
    for name, experiment in summary.experiments.items():
        points = f"{experiment.measured} of {experiment.planned}"
        unit = experiment.unit
        if not experiment.models:
            table.add_row(escape(name), points, "-", "-", "-", "-")
        for model, result in experiment.models.items():
            table.add_row(
                escape(name),
                points,
                escape(model),
                f"{result.rmse.value:.3g} ± {result.rmse.u95:.2g} {unit}",
                f"{result.bias.value:+.3g} {unit}",
                f"{result.max_error.value:.3g} {unit} at {result.max_error.pressure_kpa:g} kPa",
            )
    if summary.experiments:
        console.print(table)
    if summary.trials:
        console.print(_trials(summary))
    outcome = f"status: {summary.status}; report: {folder / 'report.html'}"
    console.print(escape(outcome), soft_wrap=True)


def _trials(summary: RunSummary) -> Table:
    table = Table("trial", "parts", "figure", "value")
    for name, trial in summary.trials.items():
        parts = f"{trial.measured} of {trial.planned}"
        for figure in trial.figures:
            u = "" if figure.u is None else f" ± {2 * figure.u:.2g}"
            value = f"{figure.value:.4g}{u} {figure.unit}".rstrip()
            table.add_row(escape(name), parts, escape(figure.name), value)
            name, parts = "", ""
    return table
