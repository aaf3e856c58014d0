"""The main command: dry run, run, outputs, exit codes, and the same report twice."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from datetime import date
from pathlib import Path

import pytest

from rig.errors import RigError
from rig.record.reader import RunReader
from rig.spec.workspace import BenchCalibrations

from .conftest import ROOT, Command

ACTUATOR = "tests/specs/bellow-bending.yaml"
CHARACTERISE = [
    *(sys.executable, "-m", "rig", "characterise"),
    *("--actuator", ACTUATOR, "--bench", "virtual-beam"),
]


@pytest.fixture(scope="module")
def quick_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "quick"
    characterise(folder).check_returncode()
    return folder


def characterise(
    folder: Path, *more: str, protocol: str = "quick"
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*CHARACTERISE, "--protocol", protocol, "--out", str(folder), *more],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_dry_run_prints_the_plan_and_moves_nothing(rig: Command, tmp_path: Path) -> None:
    out = tmp_path / "run"
    outcome = rig("characterise", "--actuator", ACTUATOR, "--out", out, "--dry-run")
    assert outcome.code == 0
    assert "120 points" in outcome.out
    assert "min of bench time" in outcome.out
    assert "nothing was moved" in outcome.out
    assert not out.exists()


def test_a_run_leaves_everything_the_contract_names(quick_run: Path) -> None:
    names = {path.name for path in quick_run.iterdir()}
    assert {"run.mcap", "summary.json", "report.html", "points.csv", "truth.mcap"} <= names
    summary = json.loads((quick_run / "summary.json").read_text())
    assert summary["status"] == "success"
    assert summary["actuator"] == "bellow-bending"
    assert summary["seed"] == 1
    for unit, experiment in (("deg", "deformation"), ("g", "blocked_force")):
        found = summary["experiments"][experiment]
        assert found["models"]["beam"]["rmse"]["unit"] == unit
        assert found["models"]["beam"]["rmse"]["value"] > 0
        assert [level["repeats"] for level in found["points"] if level["direction"] == "up"] == [
            2,
            2,
            2,
        ]


def test_the_report_is_one_file_without_outside_references(quick_run: Path) -> None:
    html = (quick_run / "report.html").read_text()
    assert "<html" in html
    for outside in ('src="http', 'href="http', "url(http", "@import"):
        assert outside not in html


def test_the_report_does_not_know_the_truth(quick_run: Path) -> None:
    assert "truth" not in (quick_run / "summary.json").read_text()
    assert RunReader(quick_run).counts().keys().isdisjoint({"/truth"})


def test_the_same_seed_gives_the_same_report_to_the_byte(quick_run: Path, tmp_path: Path) -> None:
    # in a folder of the same name, since the report says how to make it again
    again = tmp_path / quick_run.name
    characterise(again).check_returncode()
    for name in ("summary.json", "report.html", "points.csv"):
        assert (again / name).read_bytes() == (quick_run / name).read_bytes(), name


def test_a_replay_from_the_log_alone_gives_the_same_summary(
    rig: Command, quick_run: Path, tmp_path: Path
) -> None:
    log = tmp_path / "run.mcap"
    log.write_bytes((quick_run / "run.mcap").read_bytes())
    outcome = rig("replay", log, "--out", tmp_path / "replayed")
    assert outcome.code == 0
    assert "exactly as they were taken" in outcome.out
    replayed = (tmp_path / "replayed" / "summary.json").read_bytes()
    assert replayed == (quick_run / "summary.json").read_bytes()


def test_a_complete_run_has_nothing_to_resume(rig: Command, quick_run: Path) -> None:
    outcome = rig("resume", quick_run)
    assert outcome.code != 0
    assert "complete" in outcome.err


def test_a_run_is_not_resumed_on_calibrations_that_ran_out_meanwhile(
    rig: Command, quick_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(BenchCalibrations, "expired", lambda *_: {"load_cell": date(2026, 1, 31)})
    refused = rig("resume", quick_run)
    assert refused.code != 0
    assert "load cell (until 2026-01-31) is no longer valid" in refused.err
    assert "--expired-calibrations" in refused.err
    assert "complete" in rig("resume", quick_run, "--expired-calibrations").err


def test_ctrl_c_vents_closes_the_log_and_says_how_to_go_on(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    process = subprocess.Popen(
        [*CHARACTERISE, "--out", str(folder)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "COLUMNS": "200"},
    )
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and _points(folder) < 1:
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "aborted" in said
    assert f"rig resume {folder}" in said.replace("\n", " ")
    reader = RunReader(folder)
    assert reader.complete
    assert len(reader.points()) >= 1
    assert reader.telemetry("HEARTBEAT")["valve_open"][-1] == 1
    assert json.loads((folder / "summary.json").read_text())["status"] == "aborted"


SWEEPS = """
kind: protocol
name: sweeps
deformation:
  pressures: {start: 0 kPa, stop: 10 kPa, step: 5 kPa}
  repeats: 12
  hold: 2 s
  rest: 1 s
  frames: 2
"""


def test_a_killed_run_is_completed_by_resume_and_the_report_says_so(
    rig: Command, tmp_path: Path
) -> None:
    protocol, folder = tmp_path / "sweeps.yaml", tmp_path / "run"
    protocol.write_text(SWEEPS)
    process = subprocess.Popen(
        [*CHARACTERISE, "--protocol", str(protocol), "--out", str(folder)],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and _points(folder) < 2:
        time.sleep(0.05)
    process.kill()
    process.wait()
    killed = RunReader(folder)
    assert not killed.complete
    kept = killed.points()
    assert 2 <= len(kept) < 36

    assert rig("report", folder).code == 0
    assert json.loads((folder / "summary.json").read_text())["status"] == "failed"

    assert rig("resume", folder).code == 0
    resumed = RunReader(folder)
    assert resumed.complete
    assert len(resumed.points()) == 36
    assert resumed.points()[: len(kept)] == kept
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == "success"
    assert [r["points_kept"] for r in summary["resumed"]] == [len(kept)]
    assert f"after {len(kept)} points" in (folder / "report.html").read_text()


def _points(folder: Path) -> int:
    try:
        return len(RunReader(folder).points())
    except RigError:
        return 0


def test_insisting_on_ctrl_c_still_vents(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    process = subprocess.Popen(
        [*CHARACTERISE, "--out", str(folder)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and _points(folder) < 1:
        time.sleep(0.1)
    for _ in range(2):
        process.send_signal(signal.SIGINT)
        time.sleep(0.02)
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "venting" in said
    reader = RunReader(folder)
    assert reader.complete
    assert reader.telemetry("HEARTBEAT")["valve_open"][-1] == 1


def test_a_run_on_a_breaking_bench_fails_with_its_log_readable(
    rig: Command, tmp_path: Path
) -> None:
    out = tmp_path / "run"
    outcome = rig(
        "characterise", "--actuator", "bellow-bending", "--protocol", "faults",
        "--faults", "sensor-open", "--out", out,
    )  # fmt: skip
    assert outcome.code == 1
    assert "sensor_open" in outcome.out
    log = RunReader(out)
    assert log.complete
    assert len(log.points()) == 2
    assert b"kind: sensor_open" in log.attachments()["faults.yaml"]


def test_a_real_bench_is_never_broken(rig: Command, tmp_path: Path) -> None:
    outcome = rig(
        "characterise", "--actuator", "bellow-bending", "--bench", "mega",
        "--faults", "sensor-open", "--out", tmp_path / "run",
    )  # fmt: skip
    assert outcome.code == 1
    assert "simulated benches only" in outcome.err.replace("\n     ", " ")
