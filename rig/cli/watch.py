"""`rig watch`: a run in Foxglove, while it is taken or afterwards."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.app import app


@app.command()
def watch(
    run: Annotated[Path, typer.Argument(help="Folder of a run, or its run.mcap.")],
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 takes a free one.")] = 8765,
    speed: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            help="Bench time against the clock; 0 sends what is there at once. Without it a run "
            "that has ended is played at 1, one in progress is sent as it comes.",
        ),
    ] = None,
) -> None:
    """Serve the channels of a run to Foxglove, on this machine alone.

    Starts when somebody subscribes and ends with the run. A run in progress is followed through
    its log, so that watching never disturbs it: what happened before comes at once, and then what
    happens, a second late on a real bench. Simulated runs write their log in larger pieces. Nobody
    can send anything to a run. The layout beside the log shows pressure, deformation, load cell,
    camera and events.

    Example: `rig watch logs/bellow-bending-virtual-seed1 --speed 5`
    """
    from rig.record.follow import LogFollower
    from rig.record.layout import LAYOUT_FILE
    from rig.record.live import LiveServer, pace, relay

    follower = LogFollower(run)
    with LiveServer(port) as server:
        typer.echo(f"In Foxglove: Open connection, Foxglove WebSocket, {server.url}")
        layout = follower.path.with_name(LAYOUT_FILE)
        if layout.is_file():
            typer.echo(f"Layout: Import from file, {layout}")
        typer.echo("Waiting for a subscriber; Ctrl-C ends it.")
        sent = relay(follower, server, pace(follower) if speed is None else speed)
    typer.echo(f"The run has ended; {sent} messages were sent.")
