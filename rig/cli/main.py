"""Entry point of the command line: errors become one paragraph and an exit code.

Verb modules keep heavy imports inside their functions, so that `rig --help` stays instant.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
import textwrap

import rig.cli
from rig.cli.app import app
from rig.errors import RigError

NOT_VERBS = {"app", "main"}


def _register_verbs() -> None:
    for module in pkgutil.iter_modules(rig.cli.__path__):
        if module.name not in NOT_VERBS and not module.name.startswith("_"):
            importlib.import_module(f"rig.cli.{module.name}")


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; `--debug` anywhere shows tracebacks."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in arguments
    if debug:
        arguments.remove("--debug")
    _register_verbs()
    try:
        app(args=arguments, prog_name="rig")
    except RigError as error:
        if debug:
            raise
        _complain(str(error))
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        _complain("Interrupted.")
        sys.exit(130)
    except BrokenPipeError:
        sys.exit(141)
    except Exception as error:
        if debug:
            raise
        _complain(
            f"This is a defect in rig, not in your input: {type(error).__name__}: {error}. "
            "Run the same command with --debug and report what it prints."
        )
        sys.exit(70)


def _complain(message: str) -> None:
    width = 100
    for index, line in enumerate(message.splitlines() or [""]):
        print(
            textwrap.fill(
                line,
                width,
                initial_indent="rig: " if index == 0 else "     ",
                subsequent_indent="     ",
                break_long_words=False,
                break_on_hyphens=False,
            ),
            file=sys.stderr,
        )
