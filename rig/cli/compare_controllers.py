"""`rig compare-controllers`: controllers on one benchmark, on a simulated bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.experiment.bench import Bench
    from rig.experiment.controllers import Case, Controller
    from rig.spec.workspace import Setup

COURSES = ("time_s", "pressure_kpa", "target_kpa")
FAULT_AFTER_S = 4.0
"""When a case's leak begins, after regulation did: the first step has settled."""


@app.command()
def compare_controllers(
    identification: Annotated[
        Path, typer.Argument(help="Folder or `identification.json` of `rig identify`.")
    ],
    actuator: Annotated[str, typer.Option(help="Actuator spec: file or name.")] = "bellow-bending",
    bench: Annotated[
        str, typer.Option(help="A simulated bench: name in models/benches, or a file.")
    ] = "virtual",
    seed: Annotated[int, typer.Option(min=0, help="Of everything random.")] = 1,
    out: Annotated[Path, typer.Option(help="The page to write.")] = Path("controllers.html"),
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Let the firmware's PI, tuned, fed forward, scheduled, and an LQG in the host compete.

    Each regulates steps, a staircase with three gas volumes, sines, a leak and a disturbance. All
    figures are of the reported pressure. Gains are those of `rig tune` for the identification.

    Example: `rig compare-controllers logs/identification --out controllers.html`
    """
    import json

    from rich.console import Console
    from rich.table import Table

    from rig.board.virtual import require_simulated
    from rig.cli._loop import loop_request
    from rig.control.family import read_family
    from rig.control.loop import Gains
    from rig.control.tune import Wanted, tune
    from rig.experiment.controllers import CASES, compete, contenders, motor_limited_mae_kpa
    from rig.link.schema import load_schema
    from rig.report.controllers import COLUMNS, cells, write_competition
    from rig.spec.workspace import Workspace

    console = Console(stderr=as_json)
    family = read_family(identification)
    setup = Workspace.find().setup(actuator, bench)
    require_simulated(setup.bench)
    request = loop_request(setup, seed)
    rules = load_schema().parameters
    most = Gains(rules["proportional_ml_s_kpa"].high, rules["integral_ml_s2_kpa"].high)
    competitors = contenders(family, tune(family, Wanted(most=most)))
    outcomes = []
    for case in CASES:
        console.print(case.name, soft_wrap=True)
        for controller in competitors:
            opened = _open(setup, seed, case, controller)
            try:
                outcomes.append(compete(opened, request, controller, case))
            finally:
                opened.close()
    stiffness = family.models[len(family.models) // 2].static_gain
    limits = {
        case.name: motor_limited_mae_kpa(case, stiffness, family.parameters)
        for case in CASES
        if case.levels_kpa and case.is_as_identified
    }
    write_competition(out, family, outcomes, limits)
    if as_json:
        found = [
            {name: value for name, value in vars(o).items() if name not in COURSES}
            for o in outcomes
        ]
        typer.echo(json.dumps({"outcomes": found, "motor_limited_mae_kpa": limits}, indent=2))
        return
    table = Table("case", *(f"{name}\n{unit}" for name, unit in COLUMNS))
    for outcome in outcomes:
        table.add_row(outcome.case, *cells(outcome))
    console.print(table)
    console.print(f"comparison: {out}", soft_wrap=True, markup=False)


def _open(setup: Setup, seed: int, case: Case, controller: Controller) -> Bench:
    """The simulated bench of a case: more volume than the controllers know, or a leak."""
    from dataclasses import replace

    from rig.board.virtual import VirtualBench
    from rig.mechanics.job import Job
    from rig.mechanics.store import FolderStore
    from rig.spec.faults import FaultScript

    bench = setup.bench
    syringe = bench.syringe.model_copy(
        update={"dead_volume": bench.syringe.dead_volume + case.added_ml * 1e-6}
    )
    changed = replace(setup, bench=bench.model_copy(update={"syringe": syringe}))
    faults = None
    if case.leak_ml_s > 0:
        leak = {
            "kind": "leak",
            "flow": f"{case.leak_ml_s} mL/s",
            "when": {"state": "hold" if controller.kind == "host" else "run"},
            "delay": f"{FAULT_AFTER_S} s",
        }
        if case.leak_lasts_s is not None:
            leak["lasts"] = f"{case.leak_lasts_s} s"
        faults = FaultScript.model_validate(
            {
                "kind": "faults",
                "name": "leak",
                "description": case.name,
                "faults": [leak],
                "expect": {"run": "success"},
            }
        )
    return VirtualBench(changed, seed, faults=faults, job=Job(FolderStore.of_user()))
