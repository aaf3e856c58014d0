"""`rig init`: a lab's own workspace."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.app import app


@app.command()
def init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where to make the workspace.")],
    schemas: Annotated[
        bool,
        typer.Option(
            "--schemas", help="Write only this version's JSON Schemas, straight into DIR."
        ),
    ] = False,
) -> None:
    """Make a workspace: models, calibrations, a place for logs, and editor support.

    The model library is copied, so that you can change it; editors that know JSON Schema complete
    and check its YAML. A directory that holds anything already is left alone.

    Example: `rig init my-lab`; after an update of rig: `rig init --schemas my-lab/models/schemas`
    """
    from rig.report.summary import write_run_summary_schema
    from rig.spec.scaffold import SCHEMAS, make_workspace, refresh_schemas

    if schemas:
        for path in (*refresh_schemas(folder), write_run_summary_schema(folder)):
            typer.echo(path)
        return
    make_workspace(folder)
    write_run_summary_schema(folder / SCHEMAS)
    typer.echo(f"Workspace {folder} is ready. Next:")
    typer.echo(f"  cd {folder}")
    typer.echo("  rig characterise --actuator bellow-bending --protocol quick")
