"""`rig characterise` and `rig resume`: the main job, from spec to report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.app import app

ExpiredCalibrations = Annotated[
    bool,
    typer.Option("--expired-calibrations", help="Use calibrations past their last valid day, too."),
]


@app.command()
def characterise(
    actuator: Annotated[Path, typer.Option(help="Actuator spec (YAML).", show_default=False)],
    bench: Annotated[
        str, typer.Option(help="`virtual`, another name in models/benches, or a file.")
    ] = "virtual",
    protocol: Annotated[str, typer.Option(help="Name in models/protocols, or a file.")] = "default",
    out: Annotated[
        Path | None, typer.Option(help="Run folder; default: a new one in logs/.")
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="Of everything random on the virtual bench.")
    ] = 1,
    faults: Annotated[
        str | None,
        typer.Option(help="Break the simulated bench: name in models/faults, or a file."),
    ] = None,
    expired_calibrations: ExpiredCalibrations = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check and print the plan; move nothing.")
    ] = False,
) -> None:
    """Measure deformation and blocked force against pressure, compare with models, report.

    Actuators that bend are measured by their angle, those that lengthen by two markers.

    Runs on the virtual bench unless told otherwise. Ctrl-C vents the bench and closes the log;
    `rig resume` continues such a run.

    Examples:

        rig characterise --actuator models/actuators/bellow-bending.yaml

        rig characterise --actuator my.yaml --bench models/benches/mega.yaml --dry-run
    """
    from rig.cli._session import new_session

    session = new_session(actuator, bench, protocol, seed, faults, expired=expired_calibrations)
    session.show_plan()
    if dry_run:
        typer.echo("Dry run: nothing was moved.")
        return
    raise typer.Exit(session.run(out))


@app.command()
def resume(
    run: Annotated[Path, typer.Argument(help="Folder of an interrupted run.")],
    expired_calibrations: ExpiredCalibrations = False,
) -> None:
    """Continue a run after its last complete point, then write its report.

    Specs, calibrations and seed are those recorded in the run.

    Example:

        rig resume logs/bellow-bending-virtual-seed1
    """
    from rig.cli._session import resumed_session

    session = resumed_session(run, expired=expired_calibrations)
    session.show_plan()
    raise typer.Exit(session.resume(run))
