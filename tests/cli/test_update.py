"""`rig update` from the command line."""

from __future__ import annotations

from pathlib import Path

from .conftest import Command
from .test_bad_input import assert_explained


def test_a_run_that_is_not_there_is_explained(rig: Command, tmp_path: Path) -> None:
    assert_explained(rig("update", tmp_path / "nothing"), "nothing", "rig characterise")
