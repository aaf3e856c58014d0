"""`rig compare-controllers`: controllers on one benchmark, on a simulated bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from rig.control.family import Family
    from rig.experiment.controllers import Case
    from rig.report.controllers import Competition
    from rig.spec.workspace import Setup

COURSES = ("time_s", "pressure_kpa", "target_kpa")


@app.command()
def compare_controllers(
    identifications: Annotated[
        list[Path],
        typer.Argument(
            help="Folders or `identification.json` of `rig identify`: each on its own bench."
        ),
    ],
    actuator: Annotated[
        str | None, typer.Option(help="Actuator spec: file or name. Default: the identified one.")
    ] = None,
    bench: Annotated[
        str | None,
        typer.Option(help="A simulated bench: name or file. Default: the identified one."),
    ] = None,
    only: Annotated[
        str, typer.Option(help="Cases whose names begin so, as `staircase`. Default: all.")
    ] = "",
    seed: Annotated[int, typer.Option(min=0, help="Of everything random.")] = 1,
    out: Annotated[Path, typer.Option(help="The page to write.")] = Path("controllers.html"),
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Let the firmware's PI, tuned, fed forward, scheduled, and an LQG in the host compete.

    Each regulates steps, a staircase with three volumes of gas (or of the air in a liquid), sines,
    a leak and a disturbance. All figures are of the reported pressure. Gains are those of `rig
    tune` for the identification.

    Example: `rig compare-controllers logs/air logs/water --out controllers.html`
    """
    import json

    from rich.console import Console
    from rich.table import Table

    from rig.board.virtual import require_simulated
    from rig.control.family import read_family
    from rig.experiment import controllers
    from rig.experiment.errors import ExperimentError
    from rig.report.controllers import COLUMNS, cells, parts, write_competitions
    from rig.spec.workspace import Workspace

    console = Console(stderr=as_json)
    entered = []
    for family in map(read_family, identifications):
        setup = Workspace.find().setup(actuator or family.actuator, bench or family.bench)
        require_simulated(setup.bench)
        cases = [one for one in controllers.cases_of(family.fluid) if one.name.startswith(only)]
        if not cases:
            raise ExperimentError(f"no case begins with '{only}'. Nothing was moved.")
        entered.append((family, setup, cases))
    held = [_compete(*one, seed, console) for one in entered]
    write_competitions(out, held)
    if as_json:
        typer.echo(json.dumps([_document(one) for one in held], indent=2))
        return
    for one in held:
        console.print(f"{one.family.actuator} on bench {one.family.bench}", soft_wrap=True)
        table = Table("case", *(f"{name}\n{unit}" for name, unit in COLUMNS))
        for outcome in one.outcomes:
            table.add_row(outcome.case, *cells(outcome))
        console.print(table)
        for columns, rows in parts(one.standings) if one.standings else ():
            table = Table(*(f"{name}\n{unit}" for name, unit in columns))
            for row in rows:
                table.add_row(*row)
            console.print(table)
    console.print(f"comparison: {out}", soft_wrap=True, markup=False)


def _compete(
    family: Family, setup: Setup, cases: Sequence[Case], seed: int, console: Console
) -> Competition:
    """All controllers in all cases on one bench."""
    from rig.board.virtual import VirtualBench
    from rig.cli._loop import loop_request
    from rig.control.loop import Gains
    from rig.control.tune import Wanted, tune
    from rig.experiment import controllers
    from rig.link.schema import load_schema
    from rig.mechanics.job import Job
    from rig.mechanics.store import FolderStore
    from rig.report.controllers import Competition

    request = loop_request(setup, seed)
    rules = load_schema().parameters
    most = Gains(rules["proportional_ml_s_kpa"].high, rules["integral_ml_s2_kpa"].high)
    competitors = controllers.contenders(family, tune(family, Wanted(most=most)))
    outcomes = []
    for case in cases:
        console.print(case.name, soft_wrap=True)
        changed = controllers.setup_of(setup, case, request.board_parameters()["system_volume_ml"])
        for controller in competitors:
            faults = controllers.leak_of(case, controller)
            opened = VirtualBench(changed, seed, faults=faults, job=Job(FolderStore.of_user()))
            try:
                outcomes.append(controllers.compete(opened, request, controller, case))
            finally:
                opened.close()
    limits = {
        case.name: controllers.motor_limited_mae_kpa(case, family)
        for case in cases
        if case.levels_kpa and case.is_as_identified
    }
    return Competition(family, outcomes, controllers.standings(competitors, outcomes), limits)


def _document(held: Competition) -> dict[str, object]:
    return {
        "actuator": held.family.actuator,
        "bench": held.family.bench,
        "outcomes": [
            {name: value for name, value in vars(o).items() if name not in COURSES}
            for o in held.outcomes
        ],
        "standings": [vars(one) for one in held.standings],
        "motor_limited_mae_kpa": held.limits_kpa,
    }
