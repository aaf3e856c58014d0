"""`rig report`: write a run's report again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.app import app


@app.command()
def report(
    run: Annotated[Path, typer.Argument(help="Folder of a run, or its run.mcap.")],
    out: Annotated[
        Path | None, typer.Option(help="Where the report goes; default: the run's folder.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print summary.json.")] = False,
) -> None:
    """Write summary, tables and report of a run again, from its log.

    Reads `run.mcap` alone and takes its points as they were recorded; `rig replay` measures the
    pictures again, too. Writes `summary.json`, `points.csv`, `deformations.csv`, `pressure.csv` and
    `report.html`.

    Example: `rig report logs/bellow-bending-virtual-seed1`
    """
    from rich.console import Console

    from rig.cli._calculation import calculating
    from rig.cli._summary import show_summary
    from rig.record.reader import RunReader
    from rig.report.build import build_report

    reader = RunReader(run)
    folder = out or reader.path.parent
    with calculating(Console(stderr=True)) as job:
        summary = build_report(folder, reader, job=job)
    if as_json:
        typer.echo(summary.to_json(), nl=False)
    else:
        show_summary(Console(), summary, folder)
