"""The one typer application; every verb's module registers itself here."""

from __future__ import annotations

import typer

app = typer.Typer(
    name="rig",
    help="Characterise soft pneumatic actuators: predict, measure, compare, report.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)
