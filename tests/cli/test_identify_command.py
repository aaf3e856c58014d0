"""`rig identify` as people call it."""

from __future__ import annotations

import json
from pathlib import Path

from tests.benches import BEAM_ACTUATOR
from tests.cli.conftest import Command

QUICK = ("--actuator", BEAM_ACTUATOR, "--bench", "virtual-beam", "--levels", "5", "--bits", "3")


def test_a_bench_is_identified_and_the_record_read_again(rig: Command, tmp_path: Path) -> None:
    run = tmp_path / "run"
    done = rig("identify", *QUICK, "--out", run, "--json")
    assert done.code == 0, done.err
    (level,) = json.loads(done.out)["levels"]
    assert level["fit_percent"] > 95
    page = (run / "identification.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2
    assert "frequency (rad/s)" in page
    before = (run / "identification.json").read_text(encoding="utf-8")
    again = rig("identify", run)
    assert again.code == 0, again.err
    assert "identification.html" in again.out
    assert (run / "identification.json").read_text(encoding="utf-8") == before


def test_bad_levels_and_runs_are_told_in_a_sentence(rig: Command, tmp_path: Path) -> None:
    high = rig("identify", *QUICK[:4], "--levels", "40", "--out", tmp_path / "run")
    assert high.code == 1
    assert "Nothing was moved" in " ".join(high.err.split())
    none = rig("identify", tmp_path)
    assert none.code == 1
    assert "run.mcap" in none.err
