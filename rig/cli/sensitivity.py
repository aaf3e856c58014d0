"""`rig sensitivity`: which factors of a study matter, and what tolerances do."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.study.plan import Plan
    from rig.study.sensitivity import Model


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

    from rig.spec.workspace import Workspace
    from rig.study.plan import make_plan

    workspace = Workspace.find()
    plan = make_plan(workspace.path("study", file), workspace)
    names = [one.name for one in plan.spec.responses]
    wanted = response or names[0]
    if wanted not in names:
        raise typer.BadParameter(f"'{wanted}' is no response of it; expected {', '.join(names)}")
    model = _surface(plan, study, wanted) if study is not None else _beam(plan, wanted)
    found = _computed(method, model, plan, samples, seed)
    if as_json:
        typer.echo(json.dumps({"response": wanted, "method": method.value, **found}, indent=2))
        return
    _show(wanted, found)


def _beam(plan: Plan, response: str) -> Model:
    from rig.study.model import beam_model

    return beam_model(plan, response)


def _surface(plan: Plan, folder: Path, response: str) -> Model:
    from rig.study.analysis import analyse
    from rig.study.errors import StudyError
    from rig.study.model import surface_model
    from rig.study.results import Folder
    from rig.study.run import known_study

    finished = known_study(plan, Folder(folder))
    if finished is None:
        raise StudyError(f"the study in {folder} is not finished; run `rig study` first.")
    return surface_model(analyse(finished), plan.factors, response)


def _computed(
    method: Method, model: Model, plan: Plan, samples: int | None, seed: int
) -> dict[str, Any]:
    from rig.study.sensitivity import morris_screening, sobol_indices, tolerance

    match method:
        case Method.SOBOL:
            sobol = sobol_indices(model, plan.factors, samples or 2**14, seed)
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
            morris = morris_screening(model, plan.factors, samples or 50, seed)
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
            found = tolerance(model, plan.factors, samples or 100_000, seed)
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
