"""Runs the command line in process: exit code and what a person would read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from rig.cli.main import main

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


Command = Callable[..., Outcome]


@pytest.fixture
def rig(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    """`rig("check", file)` as in a shell that stands in the root of the checkout.

    So wide that nothing wraps: where a sentence breaks would hang on how long a test's folder is.
    """
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("COLUMNS", "2000")
    monkeypatch.setattr("rig.cli.main._WIDTH", 2000)

    def run(*arguments: str | Path) -> Outcome:
        capfd.readouterr()
        code = 0
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as stopped:
            code = stopped.code if isinstance(stopped.code, int) else int(stopped.code is not None)
        said = capfd.readouterr()
        return Outcome(code, said.out, said.err)

    return run
