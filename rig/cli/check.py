"""`rig check`: validate files before anything depends on them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.spec.check import FileReport
    from rig.spec.errors import Problem


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
    A material whose energy is unstable before it breaks is warned of, and is no problem.

    Example: `rig check models/actuators/bellow-bending.yaml calibration`
    """
    from rig.spec.check import check as check_paths

    reports = check_paths(files)
    is_ok = all(report.is_ok for report in reports)
    warnings = _warnings(reports)
    if as_json:
        typer.echo(_as_json(reports, warnings))
    else:
        for report in reports:
            if report.is_ok:
                typer.echo(f"{typer.style('OK', fg='green')} {report.path} ({report.kind})")
            for problem in report.problems:
                typer.echo(str(problem))
        for warning in warnings:
            typer.echo(f"{typer.style('warning', fg='yellow')} {warning}")
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


def _warnings(reports: list[FileReport]) -> list[Problem]:
    """One for each material with an unstable energy, however many files refer to it."""
    fitted = {
        report.material.path.resolve(): report.material
        for report in reports
        if report.material is not None and report.material.spec.hyperelastic is not None
    }
    if not fitted:
        return []
    from rig.mechanics.hyperelastic import material_stability
    from rig.spec.workspace import problem_at

    found = ((material, material_stability(material.spec)) for material in fitted.values())
    return [
        problem_at(material, ("hyperelastic", "energy"), stability.warning)
        for material, stability in found
        if stability.warning is not None
    ]


def _as_json(reports: list[FileReport], warnings: list[Problem]) -> str:
    import json

    files = [
        {
            "path": str(report.path),
            "kind": report.kind or None,
            "ok": report.is_ok,
            "problems": [_plain(problem) for problem in report.problems],
        }
        for report in reports
    ]
    content = {
        "ok": all(report.is_ok for report in reports),
        "files": files,
        "warnings": [_plain(warning) for warning in warnings],
    }
    return json.dumps(content, indent=2)


def _plain(problem: Problem) -> dict[str, str | int | None]:
    return {
        "path": str(problem.path),
        "line": problem.line,
        "column": problem.column,
        "field": problem.field,
        "message": problem.message,
    }
