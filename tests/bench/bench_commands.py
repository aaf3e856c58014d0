"""Whole commands in wall time: `rig --help`, and the default characterisation stage by stage.

Targets: help below 0.5 s, the default run below 60 s of which the bench's part at more than
100 times real time.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import AbstractContextManager
from pathlib import Path
from unittest import mock

from rig.mechanics.job import Job
from rig.mechanics.store import FOLDER_VARIABLE, FolderStore
from rig.record.reader import RunReader
from rig.report.build import build_report

ROOT = Path(__file__).resolve().parents[2]
RIG = [sys.executable, "-c", "from rig.cli.main import main; main()"]
HELP_RUNS = 7


def seconds(command: list[str]) -> float:
    """Wall time of a command that must succeed."""
    start = time.perf_counter()
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return time.perf_counter() - start


def results_in(folder: Path) -> AbstractContextManager[object]:
    """Finite elements of this process and its children keep their results in `folder`."""
    return mock.patch.dict(os.environ, {FOLDER_VARIABLE: str(folder)})


def main() -> None:
    """Print the table."""
    helps = [seconds([*RIG, "--help"]) for _ in range(HELP_RUNS)]
    with tempfile.TemporaryDirectory() as scratch, results_in(Path(scratch) / "cache"):
        first, run = Path(scratch) / "first", Path(scratch) / "run"
        actuator = "models/actuators/bellow-bending.yaml"
        command = [*RIG, "characterise", "--actuator", actuator, "--out"]
        first_s = seconds([*command, str(first)])
        whole_s = seconds([*command, str(run)])
        bench_s = float(RunReader(run).telemetry("HEARTBEAT")["time_s"][-1])
        start = time.perf_counter()
        build_report(run, job=Job(FolderStore.of_user()))
        report_s = time.perf_counter() - start
    rows = [
        ("rig --help, median", f"{statistics.median(helps):.2f} s", "0.5 s"),
        ("rig characterise, default, empty cache", f"{first_s:.1f} s", ""),
        ("rig characterise, default, again", f"{whole_s:.1f} s", "60 s"),
        ("  of which report", f"{report_s:.1f} s", ""),
        ("  bench time", f"{bench_s / 60:.1f} min", ""),
        (
            "  bench time / wall time without report",
            f"{bench_s / (whole_s - report_s):.0f}",
            "100",
        ),
    ]
    print("{:<44}{:>12}{:>10}".format("command", "measured", "target"))
    for row in rows:
        print("{:<44}{:>12}{:>10}".format(*row))
