"""`rig check`: validate files before anything depends on them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.spec.check import FileReport


@app.command()
def check(
    files: Annotated[
        list[Path], typer.Argument(help="YAML files; directories mean all YAML beneath them.")
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Check actuators, materials, benches, protocols and calibrations.

    Prints OK for each sound file and every problem of the others with its line, column and field;
    exits with 1 if there are any. Files that an actuator or a bench refers to are checked, too.

    Example: `rig check models/actuators/bellow-bending.yaml calibration`
    """
    from rig.spec.check import check as check_paths

    reports = check_paths(files)
    is_ok = all(report.is_ok for report in reports)
    if as_json:
        typer.echo(_as_json(reports))
    else:
        for report in reports:
            if report.is_ok:
                typer.echo(f"{typer.style('OK', fg='green')} {report.path} ({report.kind})")
            for problem in report.problems:
                typer.echo(str(problem))
        bad = sum(not report.is_ok for report in reports)
        problems = sum(len(report.problems) for report in reports)
        if bad:
            typer.secho(
                f"{_count(problems, 'problem')} in {bad} of {_count(len(reports), 'file')}",
                fg="red",
                err=True,
            )
    if not is_ok:
        raise typer.Exit(1)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _as_json(reports: list[FileReport]) -> str:
    import json

    files = [
        {
            "path": str(report.path),
            "kind": report.kind or None,
            "ok": report.is_ok,
            "problems": [
                {
                    "path": str(problem.path),
                    "line": problem.line,
                    "column": problem.column,
                    "field": problem.field,
                    "message": problem.message,
                }
                for problem in report.problems
            ],
        }
        for report in reports
    ]
    return json.dumps({"ok": all(r.is_ok for r in reports), "files": files}, indent=2)
