"""`rig optimise`: a search for better actuators."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.study.results import Answer
    from rig.study.search import Found


@app.command()
def optimise(
    file: Annotated[
        Path, typer.Argument(help="Optimisation file (YAML), or a name in models/optimisations.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results. Default: studies/NAME.")
    ] = None,
    plot: Annotated[bool, typer.Option(help="Draw the search.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Search for the specs that answer a task best, within limits.

    Writes `best-N.yaml`, actuators that are ready to use, `evaluations.json` and `search.png`.
    What was computed is kept, so a search that was stopped repeats itself in no time and goes on.
    Exits with 1 if no point keeps the limits.

    Example: `rig optimise bellow-bending-angle --out studies/angle`
    """
    import json

    from rich.console import Console

    from rig.cli._interruption import catching_signals
    from rig.spec.loading import read
    from rig.spec.optimisation import OptimisationSpec
    from rig.spec.workspace import Workspace
    from rig.study.errors import StudyError
    from rig.study.plan import make_space
    from rig.study.results import Folder
    from rig.study.search import Memory, search
    from rig.study.search_plots import FEWEST_DRAWN, plot_search

    workspace = Workspace.find()
    path = workspace.path("optimisation", file)
    spec = read(path, OptimisationSpec).spec
    space = make_space(path, workspace, spec.actuator, spec.factors, spec.responses)
    folder = Folder(out or Path("studies") / spec.name)
    console = Console(stderr=as_json)
    with catching_signals("stopping; what was computed is kept") as interruption:
        memory = Memory(space, spec.responses, folder, watch=lambda _: not interruption.requested)
        default = memory.at_default()
        found = search(spec, memory)
    if found.best:
        _write(folder.path, found)
    told = _plain(found, default)
    if as_json:
        typer.echo(json.dumps(told, indent=2))
    else:
        _show(console, told, folder.path)
    if plot and told["feasible"] >= FEWEST_DRAWN:
        plot_search(folder.path / "search.png", found)
    elif plot and found.best:
        console.print(
            f"no picture: {told['feasible']} evaluations kept all limits, {FEWEST_DRAWN} make one"
        )
    if interruption.requested:
        raise KeyboardInterrupt
    if not found.best:
        raise StudyError(
            "no point that was tried keeps all limits; relax them, or widen the bounds."
        )


def _plain(found: Found, default: Answer) -> dict[str, Any]:
    space = found.memory.space
    return {
        "evaluations": len(found.memory.evaluations),
        "computed": found.memory.computed,
        "feasible": sum(one.feasible for one in found.memory.evaluations),
        "default": default.values,
        "best": [
            {
                "factors": {
                    f.name: space.in_lab_units(f.name, one.point.values[f.name])
                    for f in space.factors
                },
                "responses": one.answer.values,
            }
            for one in found.best
        ],
    }


def _write(folder: Path, found: Found) -> None:
    """The best actuators, in place of those of an earlier search, and all evaluations."""
    import json

    from rig.study.results import remove_specs, write_specs, write_whole

    remove_specs(folder, "best")
    for number, one in enumerate(found.best, 1):
        assert one.point.task is not None
        write_specs(folder, f"best-{number}", one.point.task, found.memory.space)
    rows = [
        {**one.point.values, **(one.answer.values or {}), "error": one.answer.error}
        for one in found.memory.evaluations
    ]
    write_whole(folder / "evaluations.json", (json.dumps(rows, indent=1) + "\n").encode())


def _show(console: Any, told: dict[str, Any], folder: Path) -> None:
    from rich.table import Table

    console.print(
        f"{told['evaluations']} points tried, {told['computed']} computed, {told['feasible']} "
        f"within all limits"
    )
    if told["best"]:
        first = told["best"][0]
        table = Table(*first["factors"], *first["responses"], title="best")
        if told["default"] is not None:
            blank = [""] * len(first["factors"])
            table.add_row(*blank, *(f"{v:.5g}" for v in told["default"].values()), style="dim")
        for one in told["best"]:
            values = (*one["factors"].values(), *one["responses"].values())
            table.add_row(*(f"{value:.5g}" for value in values))
        console.print(table)
        if told["default"] is not None:
            console.print("first row: the actuator as it is")
        console.print(f"results: {folder}", soft_wrap=True, markup=False)
