"""`rig firmware`: the firmware by itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.app import app

firmware = typer.Typer(help="The firmware by itself, without an experiment.", no_args_is_help=True)
app.add_typer(firmware, name="firmware")


@firmware.command()
def serve(
    actuator: Annotated[
        str, typer.Option(help="Actuator on the simulated bench: a name or a file.")
    ] = "bellow-bending",
    bench: Annotated[
        str, typer.Option(help="`virtual`, `emulated`, or a file of a simulated bench.")
    ] = "virtual",
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated bench.")] = 1,
    link: Annotated[
        Path | None, typer.Option(help="Also make this symbolic link to the port.")
    ] = None,
) -> None:
    """Run the firmware with a simulated bench on a serial port, in real time.

    On the bench `virtual` that is the firmware compiled for this machine; on `emulated`, the
    image of the Mega.

    Every SLCAN program can talk to it. Ctrl-C ends it.

    Example:

        rig firmware serve

        python -m can.viewer -i slcan -c /dev/pts/3   # the port that it prints
    """
    from rig.board.pty import PtyServer
    from rig.board.virtual import virtual_board
    from rig.cli._interruption import catching_signals
    from rig.spec.workspace import Workspace

    setup = Workspace.find().setup(actuator, bench)
    server = PtyServer(virtual_board(setup, seed))
    if link is not None:
        link.unlink(missing_ok=True)
        link.symlink_to(server.port)
    typer.echo(f"The board is at {server.port}; watch it with")
    typer.echo(f"  python -m can.viewer -i slcan -c {server.port}")
    try:
        with catching_signals() as interruption:
            server.serve(lambda: interruption.requested)
    finally:
        server.close()
        if link is not None:
            link.unlink(missing_ok=True)
