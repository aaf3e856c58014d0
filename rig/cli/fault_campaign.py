"""`rig fault-campaign`: break a simulated bench in every way, and judge how rig takes it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rich.table import Table

    from rig.campaign.judge import Verdict


@app.command()
def fault_campaign(
    bench: Annotated[
        str, typer.Option(help="`virtual`, `emulated`, or a file of a simulated bench.")
    ] = "virtual",
    actuator: Annotated[str, typer.Option(help="Actuator: a name or a file.")] = "bellow-bending",
    only: Annotated[
        list[str] | None, typer.Option(help="Scenario of models/faults, or a file; repeatable.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the tables; default: logs/fault-campaign-BENCH-seedN."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of everything random on the bench.")] = 1,
) -> None:
    """Run every fault script of models/faults as a whole experiment, and judge each.

    Exits with 1 if a reaction is out of its bound, the true pressure goes above the limit + 10 %,
    a point is lost, or a log cannot be read. The table is saved as CSV, JSON and Markdown.

    Examples:

        rig fault-campaign

        rig fault-campaign --only burst --only cable-pulled --seed 7
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    from rig.board.virtual import require_simulated, specimen_of
    from rig.campaign.campaign import Campaign
    from rig.campaign.table import write_tables
    from rig.cli._calculation import calculating
    from rig.mechanics.job import Job
    from rig.spec.workspace import Workspace

    workspace = Workspace.find()
    names = only or workspace.names("faults")
    scripts = [workspace.faults(name) for name in names]
    console = Console()
    require_simulated(workspace.bench(bench))
    with calculating(console) as job:
        # once for all scenarios: from here on the store knows the specimen
        specimen_of(workspace.setup(actuator, bench), seed, job)
    campaign = Campaign(workspace, actuator, bench, seed, Job(job.store))
    verdicts: list[Verdict] = []
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    )
    with bar:
        task = bar.add_task("the unbroken bench", total=len(scripts))
        for verdict in campaign.run(scripts):
            verdicts.append(verdict)
            bar.update(task, advance=1, description=verdict.outcome.script.name)
    console.print(_table(verdicts))
    for verdict in verdicts:
        for complaint in verdict.complaints:
            console.print(f"{verdict.outcome.script.name}: {complaint}", style="red", markup=False)
    folder = out or workspace.logs / f"fault-campaign-{workspace.bench(bench).name}-seed{seed}"
    paths = write_tables(folder, verdicts, workspace.bench(bench).name)
    passed = sum(v.passed for v in verdicts)
    console.print(
        f"{passed} of {len(verdicts)} scenarios passed; the table is in "
        f"{', '.join(str(p) for p in paths)}",
        markup=False,
        soft_wrap=True,
    )
    if passed < len(verdicts):
        raise typer.Exit(1)


def _table(verdicts: list[Verdict]) -> Table:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    from rig.campaign.table import row, seconds

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("scenario", "fault code", "reacted", "bound", "vented", "peak", "at the end"):
        table.add_column(name, no_wrap=name == "scenario")
    table.add_column("points")
    table.add_column("")
    for verdict in verdicts:
        r = row(verdict)
        points = f"{r['points']}" + (f", {r['wrong_points']} wrong" if r["wrong_points"] else "")
        table.add_row(
            escape(str(r["scenario"])),
            str(r["code"]),
            seconds(verdict.outcome.reacted_s),
            seconds(r["bound_s"]),
            seconds(r["vented_after_s"]) if r["run"] != "success" else "-",
            f"{r['peak_kpa']:.1f} kPa",
            f"{r['final']}, {r['run']}",
            points,
            "[green]pass[/]" if verdict.passed else "[red]FAIL[/]",
        )
    return table
