"""The one typer application; every verb's module registers itself here."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup


class InterruptionError(Exception):
    """Somebody pressed Ctrl-C, or closed the input while rig asked for some."""


class ClosedPipeError(Exception):
    """Whoever read the output has left, as `head` does."""


class Verbs(TyperGroup):
    """The group of verbs; leaves Ctrl-C and a closed pipe to `rig.cli.main`.

    Typer would end the process without a word for the first and with status 1 for the second.
    """

    def invoke(self, ctx: Any) -> Any:
        """Run a verb; raises InterruptionError and ClosedPipeError."""
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()
            return result
        except (KeyboardInterrupt, typer.Abort):
            raise InterruptionError from None
        except BrokenPipeError:
            raise ClosedPipeError from None


app = typer.Typer(
    name="rig",
    cls=Verbs,
    help="Characterise soft pneumatic actuators: predict, measure, compare, report.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(asked: bool) -> None:
    if asked:
        from rig.revision import version_line

        typer.echo(version_line())
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show version and commit."
        ),
    ] = False,
) -> None:
    """Options of rig itself; those of a verb stand behind it."""
