"""The page of every command, from the command line itself."""

from __future__ import annotations

import typer
from typer.cli import get_docs_for_click

from rig.cli.main import application

INTRODUCTION = """
`--debug` anywhere shows tracebacks. Exit codes: 0 when the command did what it said, 1 when it did
not, 2 for wrong usage, 70 for a defect in rig, 130 after Ctrl-C.
"""


def commands_page() -> str:
    """Markdown: usage, arguments and options of every verb, each under its own heading."""
    command = typer.main.get_command(application())
    text = get_docs_for_click(obj=command, ctx=typer.Context(command), name="rig")
    _, rest = text.split("\n", 1)
    return f"# Commands\n{INTRODUCTION}{rest}"
