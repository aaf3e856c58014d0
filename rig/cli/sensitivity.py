"""`rig sensitivity`: which factors of a study matter, and what tolerances do."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.spec.workspace import Workspace
    from rig.study.analysis import Check
    from rig.study.factors import Factor
    from rig.study.sensitivity import Model
    from rig.study.surface import Surface


class Method(StrEnum):
    """What to compute."""

    SOBOL = "sobol"
    MORRIS = "morris"
    TOLERANCE = "tolerance"


@app.command()
def sensitivity(
    file: Annotated[Path, typer.Argument(help="Study file (YAML), or a name in models/studies.")],
    method: Annotated[Method, typer.Option(help="Indices, screening, or tolerances.")],
    response: Annotated[
        str | None, typer.Option(help="Response of the study. Default: the first.")
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(min=2, help="Sobol: a power of two; Morris: paths; tolerance: draws."),
    ] = None,
    study: Annotated[
        Path | None,
        typer.Option(help="Folder of the finished study, whose surface answers for the model."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the samples.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Sobol indices, Morris screening or tolerance analysis over a study's factors.

    Angles of beam theory are computed as they are, a hundred thousand at once; for any other
    response give the folder of the finished study. For tolerances the factors' levels are two
    standard deviations from their mean.

    Example: `rig sensitivity bellow-bending-beam --method sobol`
    """
    import json
    from dataclasses import asdict

    from rig.spec.workspace import Workspace
    from rig.study.model import beam_model, surface_model
    from rig.study.plan import read_study

    workspace = Workspace.find()
    path = workspace.path("study", file)
    _, space = read_study(path, workspace)
    responses = {one.name: one for one in space.responses}
    wanted = response or next(iter(responses))
    if wanted not in responses:
        raise typer.BadParameter(
            f"'{wanted}' is no response of it; expected {', '.join(responses)}"
        )
    check = None
    if study is None:
        model = beam_model(space, responses[wanted])
    else:
        surface, check = _surface(path, workspace, study, wanted)
        model = surface_model(surface, space)
    found = _computed(method, model, space.factors, samples, seed)
    if as_json:
        judged = {} if check is None else {"check": asdict(check)}
        told = {"response": wanted, "method": method.value, **judged, **found}
        typer.echo(json.dumps(told, indent=2))
        return
    _show(wanted, found)
    if study is not None:
        typer.echo(
            f"at {check.words}"
            if check is not None
            else "the surface was not checked: give the study check_points"
        )


def _surface(
    path: Path, workspace: Workspace, folder: Path, response: str
) -> tuple[Surface, Check | None]:
    from rig.study.analysis import check_of, surface_of
    from rig.study.plan import make_plan
    from rig.study.results import Folder
    from rig.study.run import known_study

    finished = known_study(make_plan(path, workspace), Folder(folder))
    surface = surface_of(finished, response)
    return surface, check_of(finished, surface)


def _computed(
    method: Method, model: Model, factors: tuple[Factor, ...], samples: int | None, seed: int
) -> dict[str, Any]:
    from rig.study.sensitivity import morris_screening, sobol_indices, tolerance

    match method:
        case Method.SOBOL:
            sobol = sobol_indices(model, factors, samples or 2**14, seed)
            return {
                "evaluations": sobol.evaluations,
                "factors": {
                    name: dict(
                        zip(
                            ("first", "first_95", "total", "total_95"), map(float, row), strict=True
                        )
                    )
                    for name, *row in zip(
                        sobol.factors,
                        sobol.first,
                        sobol.first_interval,
                        sobol.total,
                        sobol.total_interval,
                        strict=True,
                    )
                },
            }
        case Method.MORRIS:
            morris = morris_screening(model, factors, samples or 50, seed)
            return {
                "evaluations": morris.evaluations,
                "factors": {
                    name: {"mean": float(m), "absolute": float(a), "spread": float(s)}
                    for name, m, a, s in zip(
                        morris.factors, morris.mean, morris.absolute, morris.spread, strict=True
                    )
                },
            }
        case Method.TOLERANCE:
            found = tolerance(model, factors, samples or 100_000, seed)
            return {
                "evaluations": found.values.size + found.lost,
                "lost": found.lost,
                "mean": found.mean,
                "deviation": found.deviation,
                "percentiles": {f"{p:g}": value for p, value in found.percentiles.items()},
                "factors": {name: {"share": share} for name, share in found.shares.items()},
            }


def _show(response: str, found: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    headings = list(next(iter(found["factors"].values())))
    table = Table("factor", *headings, title=f"{response}, {found['evaluations']} evaluations")
    for name, row in found["factors"].items():
        table.add_row(name, *(f"{value:.4g}" for value in row.values()))
    console.print(table)
    if "mean" in found:
        spread = ", ".join(f"{p} %: {value:.4g}" for p, value in found["percentiles"].items())
        console.print(
            f"mean {found['mean']:.4g}, standard deviation {found['deviation']:.3g}; {spread}; "
            f"{found['lost']} draws without a response",
            soft_wrap=True,
        )
