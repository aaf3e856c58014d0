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
        float, typer.Option(min=0.0, help="Bench time against the clock; 0 sends all at once.")
    ] = 1.0,
) -> None:
    """Serve the channels of a run to Foxglove, on this machine alone.

    Starts when somebody subscribes, at the beginning of the run, and ends with it. A run in
    progress is followed through its log, which grows a chunk at a time, at each point at the
    latest: it is watched with that delay, and never disturbed. Nobody can send anything to it. The
    layout beside the log shows pressure, angle, load cell, camera and events.

    Example: `rig watch logs/bellow-bending-virtual-seed1 --speed 5`
    """
    from rig.record.follow import LogFollower
    from rig.record.layout import LAYOUT_FILE
    from rig.record.live import LiveServer, relay

    follower = LogFollower(run)
    with LiveServer(port) as server:
        typer.echo(f"In Foxglove: Open connection, Foxglove WebSocket, {server.url}")
        layout = follower.path.with_name(LAYOUT_FILE)
        if layout.is_file():
            typer.echo(f"Layout: Import from file, {layout}")
        typer.echo("Waiting for a subscriber; Ctrl-C ends it.")
        sent = relay(follower, server, speed)
    typer.echo(f"The run has ended; {sent} messages were sent.")
