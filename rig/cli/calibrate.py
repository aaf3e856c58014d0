"""`rig calibrate`: the group of verbs that compare an instrument with something better known.

Each verb is a module of its own, `rig.cli.calibrate_*`, that registers with `calibrate`.
"""

from __future__ import annotations

import typer

from rig.cli.app import app

calibrate = typer.Typer(
    name="calibrate",
    help="Calibrate an instrument; writes a dated file into `calibration/`.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)
app.add_typer(calibrate)
