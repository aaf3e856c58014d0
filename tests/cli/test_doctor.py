"""`rig doctor`: a table for people, JSON for programs, and an exit code."""

from __future__ import annotations

import json
from pathlib import Path

from .conftest import Command


def test_the_virtual_bench_is_ready(rig: Command, tmp_path: Path) -> None:
    report = tmp_path / "doctor.json"
    outcome = rig("doctor", "--bench", "virtual-beam", "--json", report)
    assert outcome.code == 0
    assert "The bench is ready." in outcome.out
    told = json.loads(report.read_text(encoding="utf-8"))
    assert told["ready"] is True
    assert {f["what"] for f in told["findings"]} >= {"packages", "disk", "firmware", "camera"}


def test_a_bench_without_its_board_is_not_ready(rig: Command, tmp_path: Path) -> None:
    bench = tmp_path / "bench.yaml"
    text = Path("models/benches/mega.yaml").read_text(encoding="utf-8")
    bench.write_text(text.replace("/dev/ttyACM0", "/dev/no-such-port"), encoding="utf-8")
    report = tmp_path / "doctor.json"
    outcome = rig("doctor", "--bench", bench, "--json", report)
    assert outcome.code == 1
    assert "/dev/no-such-port" in outcome.out
    assert json.loads(report.read_text(encoding="utf-8"))["ready"] is False
