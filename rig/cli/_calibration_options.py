"""Options that the verbs of calibration share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Bench = Annotated[str, typer.Option(help="Name in models/benches, or a file.")]
Seed = Annotated[int, typer.Option(min=0, help="Of a simulated bench: the one that runs have.")]
Points = Annotated[
    Path | None,
    typer.Option(help="Fit this table instead, taken elsewhere or before an interruption (CSV)."),
]
Out = Annotated[Path | None, typer.Option(help="File to write; default: dated, in calibration/.")]
Operator = Annotated[str, typer.Option(help="Who calibrates.")]
SerialNumber = Annotated[str, typer.Option(help="Of the instrument.")]
ValidDays = Annotated[int, typer.Option(min=1, help="Runs refuse the calibration after these.")]
Reference = Annotated[
    str | None, typer.Option(help="What a real instrument is compared with, and its certificate.")
]
ReferenceU = Annotated[
    float | None,
    typer.Option(min=0, help="Relative standard uncertainty of the reference's scale, per cent."),
]
Temperature = Annotated[
    float | None, typer.Option(help="Of the room in deg C; default: what the bench says.")
]
