"""The list of runs: what is a run, what is said of it, and what a filter finds."""

from __future__ import annotations

import os
from pathlib import Path

from rig.studio.runs import NO_SUMMARY, list_runs, matching


def _run(logs: Path, name: str, written: int) -> Path:
    folder = logs / name
    folder.mkdir(parents=True)
    (folder / "run.mcap").write_bytes(b"")
    os.utime(folder / "run.mcap", (written, written))
    return folder


def test_the_latest_run_comes_first_and_other_folders_are_none(tmp_path: Path) -> None:
    _run(tmp_path, "old", 1000)
    _run(tmp_path, "new", 2000)
    (tmp_path / "notes").mkdir()
    assert [row.name for row in list_runs(tmp_path)] == ["new", "old"]
    assert list_runs(tmp_path / "nothing") == ()


def test_a_run_without_a_readable_summary_says_so(tmp_path: Path) -> None:
    _run(tmp_path, "fresh", 1000)
    broken = _run(tmp_path, "broken", 2000)
    (broken / "summary.json").write_text('{"status": 3}')
    (broken / "report.html").write_text("")
    (broken / "points.csv").write_text("")
    first, second = list_runs(tmp_path)
    assert first.status == second.status == NO_SUMMARY
    assert first.has_report
    assert first.files == ("run.mcap", "summary.json", "report.html", "points.csv")
    assert not second.has_report


def test_every_word_of_a_filter_must_occur(tmp_path: Path) -> None:
    _run(tmp_path, "bellow-virtual", 1000)
    _run(tmp_path, "bellow-mega", 2000)
    rows = list_runs(tmp_path)
    assert [r.name for r in matching(rows, "BELLOW virt")] == ["bellow-virtual"]
    assert len(matching(rows, "  ")) == 2
    assert matching(rows, "bellow nothing") == ()
