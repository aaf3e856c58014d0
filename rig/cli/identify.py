"""`rig identify`: linear models of the pressure system, from experiments on a bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rich.console import Console

    from rig.control.family import Family


@app.command()
def identify(
    run: Annotated[
        Path | None,
        typer.Argument(help="A recorded identification, to be analysed again; moves nothing."),
    ] = None,
    actuator: Annotated[str, typer.Option(help="Actuator spec: file or name.")] = "bellow-bending",
    bench: Annotated[
        str, typer.Option(help="`virtual`, another name in models/benches, or a file.")
    ] = "virtual",
    levels: Annotated[str, typer.Option(help="Pressures in kPa.")] = "1.5,3,5,8,10",
    amplitude: Annotated[
        float, typer.Option(min=0.05, help="How far the pressure is moved, in kPa.")
    ] = 0.5,
    bits: Annotated[
        int, typer.Option(min=3, max=12, help="Of the pseudo-random sequence: 2**bits - 1 moves.")
    ] = 7,
    seed: Annotated[int, typer.Option(min=0, help="Of everything random.")] = 1,
    out: Annotated[Path | None, typer.Option(help="Run folder; default: one in logs/.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the models as JSON.")] = False,
) -> None:
    """Shake the pressure system at several pressures and fit linear models to what it does.

    Steps, ramps, a pseudo-random sequence and a relay move the plunger in the board's state
    `hold`, so its safety chain stands. Everything is recorded in `run.mcap`; `identification.json`
    and `identification.html` hold models, fit, whiteness, uncertainty, and what physics says.

    Examples:

        rig identify --actuator bellow-bending --out logs/identification

        rig identify logs/identification
    """
    from rich.console import Console

    from rig.cli._calibration import numbers
    from rig.cli._loop import loop_request, take
    from rig.control.family import FAMILY_FILE
    from rig.experiment.identification import (
        IdentificationPlan,
        analyse_identification,
        expected_duration_s,
        record_identification,
        require_within_limits,
    )
    from rig.record.reader import RunReader
    from rig.report.identification import write_identification
    from rig.spec.free_path import first_free
    from rig.spec.workspace import Workspace

    console = Console(stderr=as_json)
    if run is None:
        workspace = Workspace.find()
        request = loop_request(workspace.setup(actuator, bench), seed)
        plan = IdentificationPlan(numbers(levels, "pressures in kPa"), amplitude, bits, seed=seed)
        require_within_limits(plan, request.setup)
        length_s = expected_duration_s(plan, request)
        console.print(
            f"{len(plan.levels_kpa)} levels, about {length_s / 60:.1f} min of bench time.",
            soft_wrap=True,
        )
        setup = request.setup
        run = out or first_free(
            workspace.logs / f"identify-{setup.actuator.name}-{setup.bench.name}-seed{seed}"
        )
        folder = run
        take(
            folder,
            request,
            console,
            lambda b, stage, check: record_identification(folder, b, request, plan, stage, check),
        )
    console.print("fitting models", soft_wrap=True)
    analysis = analyse_identification(RunReader(run))
    target = run if run.is_dir() else run.parent
    (target / FAMILY_FILE).write_text(
        analysis.family.model_dump_json(indent=2) + "\n", encoding="utf-8"
    )
    page = write_identification(target, analysis)
    if as_json:
        typer.echo(analysis.family.model_dump_json(indent=2))
        return
    _show(console, analysis.family)
    console.print(f"identification: {page}", soft_wrap=True, markup=False)


def _show(console: Console, family: Family) -> None:
    from rich.table import Table

    table = Table(
        "level\nkPa",
        "fit\n%",
        "relay\nforetold %",
        "residual\nPa",
        "whiteness\np",
        "slow gain\nkPa/mL",
        "isothermal\nkPa/mL",
        "time constants\ns",
        "delay\nms",
        "backlash\nµL",
    )
    for level in family.levels:
        physics = level.physics
        table.add_row(
            f"{level.setpoint_kpa:g}",
            f"{level.fit_percent:.2f}",
            f"{level.relay.fit_percent:.2f}",
            f"{1e3 * level.noise_kpa:.2f}",
            f"{level.whiteness_p:.2g}",
            f"{physics.identified_slow:.3f}",
            f"{physics.isothermal:.3f}",
            ", ".join(f"{t:.2g}" for t in level.times_s),
            f"{1e3 * level.delay_s:.1f}",
            f"{1e3 * level.backlash_ml:.1f}",
        )
    console.print(table)
