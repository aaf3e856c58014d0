"""`rig replay`: recompute a run from its log alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.app import app


@app.command()
def replay(
    run: Annotated[Path, typer.Argument(help="Folder of a run, or its run.mcap.")],
    out: Annotated[
        Path | None, typer.Option(help="Where the results go; default: RUN/replay.")
    ] = None,
) -> None:
    """Recompute vision, forces, validation and report from the log alone.

    Prints how far the recomputed points differ from those taken; an intact log gives the same
    numbers. Exits 1 if they differ, or if there are none.

    Example:

        rig replay logs/bellow-bending-virtual-seed1
    """
    from rich.console import Console

    from rig.cli._calculation import calculating
    from rig.cli._summary import show_summary
    from rig.experiment.replay import ReplayedRun
    from rig.report.build import build_report

    console = Console()
    replayed = ReplayedRun(run)
    folder = out or replayed.path.parent / "replay"
    with console.status("measuring the recorded images again"):
        differences = replayed.differences()
    with calculating(console) as job:
        summary = build_report(folder, replayed, job=job)
    show_summary(console, summary, folder)
    if replayed.problem is not None:
        console.print(
            f"The log is damaged or unfinished: {replayed.problem}. It holds {len(differences)} "
            f"complete points.",
            soft_wrap=True,
            markup=False,
        )
    if not differences:
        raise typer.Exit(1)
    different = [d for d in differences if d.size > 0]
    if not different:
        console.print(f"All {len(differences)} points are exactly as they were taken.")
        return
    worst = max(different, key=lambda d: d.size)
    console.print(
        f"{len(different)} of {len(differences)} points differ; the worst by {worst.size:.3g} at "
        f"{worst.key.target_kpa:g} kPa of {worst.key.experiment}, repeat {worst.key.repeat}. The "
        "log was taken by another version of rig, or was changed.",
        soft_wrap=True,
    )
    raise typer.Exit(1)
