"""`rig compare`: several runs beside each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rich.table import Table

    from rig.report.compare import ComparedExperiment, NamedRun


@app.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(help="Folders of two runs or more.")],
    out: Annotated[Path, typer.Option(help="The page to write.")] = Path("comparison.html"),
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the runs' summaries as JSON, by name.")
    ] = False,
) -> None:
    """Compare runs: curves, errors of the models, repeatability, and whether the runs agree.

    Prints a table for each experiment and writes one page with the curves over each other. The
    first run is the one that the others are held against.

    Example: `rig compare logs/first logs/second --out comparison.html`
    """
    from rich.console import Console
    from rich.markup import escape

    from rig.cli._calculation import calculating
    from rig.report.compare import read_runs, write_comparison

    with calculating(Console(stderr=True)) as job:
        named = read_runs(runs, job)
    experiments = write_comparison(out, named)
    if as_json:
        typer.echo(_as_json(named))
        return
    console = Console()
    for experiment in experiments:
        console.print(_table(experiment))
        for agreement in experiment.agreements:
            verdict = (
                "agrees with"
                if agreement.agrees
                else f"differs at {agreement.beyond} of {agreement.levels} pressures from"
            )
            console.print(
                f"{escape(agreement.run)} {verdict} {escape(agreement.first)}; "
                f"the largest difference for its uncertainty is {agreement.difference:+.3g} "
                f"{experiment.unit} at {agreement.pressure_kpa:g} kPa (En {agreement.en:+.2g}).",
                soft_wrap=True,
            )
    console.print(f"comparison: {escape(str(out))}", soft_wrap=True)


def _table(experiment: ComparedExperiment) -> Table:
    from rich.markup import escape
    from rich.table import Table

    table = Table(
        "run",
        "status",
        "points",
        f"highest pressure ({experiment.unit})",
        *(f"RMSE, {escape(model)} ({experiment.unit})" for model in experiment.models),
        f"repeatability ({experiment.unit})",
        f"hysteresis ({experiment.unit})",
        title=escape(experiment.title),
    )
    for row in experiment.rows:
        cells = (
            row.run,
            row.status,
            row.points,
            row.top,
            *row.errors,
            row.repeatability,
            row.hysteresis,
        )
        table.add_row(*(escape(cell) for cell in cells))
    return table


def _as_json(named: list[NamedRun]) -> str:
    import json

    return json.dumps({run.name: run.summary.model_dump(mode="json") for run in named}, indent=2)
