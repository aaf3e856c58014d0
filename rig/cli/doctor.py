"""`rig doctor`: is the bench ready for a run?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.app import app


@app.command()
def doctor(
    bench: Annotated[
        str, typer.Option(help="`virtual`, another name in models/benches, or a file.")
    ] = "virtual",
    actuator: Annotated[str, typer.Option(help="What hangs there: a name or a file.")] = (
        "bellow-bending"
    ),
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Also write what was seen to this file.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of a simulated bench.")] = 1,
) -> None:
    """Check port, firmware, link, sensors at rest, switches, camera, disk and packages.

    Nothing is moved. Exits with 1 if something must be mended before a run.

    Example: `rig doctor --bench models/benches/mega.yaml --json doctor.json`
    """
    import json
    from dataclasses import asdict

    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from rig.cli._session import examine

    findings = examine(actuator, bench, seed)
    table = Table("what", "", "seen", box=box.SIMPLE_HEAD, pad_edge=False)
    colours = {"ok": "green", "warning": "yellow", "failed": "red"}
    for finding in findings:
        seen = ", ".join(f"{name} {value}" for name, value in finding.seen.items())
        told = f"{seen}\n{finding.advice}" if seen and finding.advice else seen or finding.advice
        table.add_row(
            finding.what,
            f"[{colours[finding.status]}]{finding.status}[/]",
            escape(told),
        )
    Console().print(table)
    ready = all(finding.status != "failed" for finding in findings)
    if json_file is not None:
        report = {"bench": bench, "ready": ready, "findings": [asdict(f) for f in findings]}
        json_file.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    typer.echo("The bench is ready." if ready else "The bench is not ready; see what failed.")
    if not ready:
        raise typer.Exit(1)
