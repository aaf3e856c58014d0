"""Entry point of the command line: errors become one paragraph and an exit code.

Verb modules keep heavy imports inside their functions, so that `rig --help` stays instant.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import pkgutil
import sys
import textwrap
from typing import TYPE_CHECKING

import rig.cli
from rig.errors import RigError

if TYPE_CHECKING:
    import typer

NOT_VERBS = {"app", "main"}
INTERRUPTED = 130
PIPE_CLOSED = 141


def application() -> typer.Typer:
    """The typer application with every verb; typer is imported here so that Ctrl-C is caught."""
    from rig.cli.app import app

    for module in pkgutil.iter_modules(rig.cli.__path__):
        if module.name not in NOT_VERBS and not module.name.startswith("_"):
            importlib.import_module(f"rig.cli.{module.name}")
    return app


def _run(arguments: list[str]) -> None:
    """Run one of the verbs."""
    from rig.cli.app import ClosedPipeError, InterruptionError

    try:
        application()(args=arguments, prog_name="rig")
    except InterruptionError:
        raise KeyboardInterrupt from None
    except ClosedPipeError:
        raise BrokenPipeError from None


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; `--debug` anywhere shows tracebacks."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in arguments
    if debug:
        arguments.remove("--debug")
    _print_what_the_terminal_can()
    try:
        try:
            _run(arguments)
        finally:
            sys.stdout.flush()  # a reader that left is noticed here, not after the last handler
    except RigError as error:
        if debug:
            raise
        _complain(str(error))
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        _complain("Interrupted.")
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        _discard_output()
        sys.exit(PIPE_CLOSED)
    except Exception as error:
        if debug:
            raise
        _complain(
            f"This is a defect in rig, not in your input: {type(error).__name__}: {error}. "
            "Run the same command with --debug and report what it prints."
        )
        sys.exit(70)


def _print_what_the_terminal_can() -> None:
    """Show `?` for characters that the encoding of the terminal lacks, instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _discard_output() -> None:
    """Send the rest of the output nowhere: the interpreter flushes once more as it exits."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


_WIDTH = 100
"""Columns that a complaint fills at most."""


def _complain(message: str) -> None:
    for index, line in enumerate(message.splitlines() or [""]):
        print(
            textwrap.fill(
                line,
                _WIDTH,
                initial_indent="rig: " if index == 0 else "     ",
                subsequent_indent="     ",
                break_long_words=False,
                break_on_hyphens=False,
            ),
            file=sys.stderr,
        )
