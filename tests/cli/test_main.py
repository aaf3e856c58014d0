"""How the command line ends: interrupted, into a closed pipe, on an old terminal."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
import typer

from rig import __version__ as version
from rig.cli import main as main_module

from .conftest import ROOT, Command

RIG = [sys.executable, "-m", "rig"]


def interrupt(*arguments: object) -> None:
    raise KeyboardInterrupt


def test_an_interrupt_inside_a_verb_says_so(rig: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.spec.check.check", interrupt)
    outcome = rig("check", "models")
    assert (outcome.code, outcome.err) == (130, "rig: Interrupted.\n")


def test_an_interrupt_while_verbs_are_imported_says_so(
    rig: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(main_module.importlib, "import_module", interrupt)
    outcome = rig("check", "models")
    assert (outcome.code, outcome.err) == (130, "rig: Interrupted.\n")


def test_input_that_ends_inside_a_question_counts_as_an_interrupt(
    rig: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def abort(*arguments: object) -> None:
        raise typer.Abort

    monkeypatch.setattr("rig.spec.check.check", abort)
    assert rig("check", "models").code == 130


def test_exit_codes_of_verbs_and_of_wrong_usage_are_kept(rig: Command) -> None:
    assert rig("check", "models/nothing.yaml").code == 1
    assert rig("check", "models/materials").code == 0
    assert rig("--help").code == 0
    wrong = rig("check", "--nonsense")
    assert wrong.code == 2
    assert "--nonsense" in wrong.err


@pytest.mark.parametrize("arguments", [["check", "models"], ["check", "--json", "models"]])
def test_a_reader_that_leaves_ends_it_quietly(arguments: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [*RIG, *arguments], cwd=ROOT, stdout=writing, stderr=subprocess.PIPE, check=False
        )
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


def test_a_terminal_that_knows_only_ascii_gets_question_marks() -> None:
    program = "from rig.cli import main as m; m._print_what_the_terminal_can(); print('5 ± 1')"
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, env=environment, capture_output=True, check=False
    )
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, b"5 ? 1", b"")


def test_the_version_names_the_commit(rig: Command) -> None:
    outcome = rig("--version")
    assert outcome.code == 0
    checkout = subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True
    )
    known = f"commit {checkout.stdout[:12]}" if checkout.returncode == 0 else "commit unknown"
    assert outcome.out == f"rig {version} ({known})\n"
