"""A calibration guided on the terminal, with a board on a serial port in real time."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from rig.board.virtual_calibration import VirtualCalibrationBench
from rig.experiment.calibration import procedures
from rig.spec.calibration import LoadCellCalibration
from rig.spec.loading import load_calibration
from rig.spec.workspace import Workspace
from tests.boards import served

from .conftest import ROOT, Command

SERIAL_BENCH = (ROOT / "models" / "benches" / "mega.yaml").read_text()


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> VirtualCalibrationBench:
    monkeypatch.setattr(procedures, "REST_S", 0.2)
    monkeypatch.setattr(procedures, "CELL_READING_S", 0.8)
    return VirtualCalibrationBench(Workspace(ROOT).bench("virtual-beam"), 3)


def serial_bench(folder: Path, port: str) -> Path:
    path = folder / "mega.yaml"
    path.write_text(SERIAL_BENCH.replace("/dev/ttyACM0", port))
    return path


COMMAND = ("calibrate", "loadcell", "--masses", "20,50,100,150,200", "--cycles", "1")
REFERENCE = ("--reference", "F1 set", "--reference-u", "0.002", "--creep-s", "0")


@pytest.mark.slow
def test_a_person_is_guided_through_a_load_cell(
    rig: Command,
    bench: VirtualCalibrationBench,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []

    def person(self: Console, question: str, **_: Any) -> str:
        asked.append(question)
        placed = re.match(r"Place (\d+) g on the load cell", question)
        bench.references.place(float(placed[1]) if placed else 0.0, lambda: None)
        return ""

    monkeypatch.setattr(Console, "input", person)
    rig("init", tmp_path / "lab")
    monkeypatch.chdir(tmp_path / "lab")
    out = tmp_path / "made.yaml"
    with served(bench.board) as port:
        outcome = rig(*COMMAND, *REFERENCE, "--bench", serial_bench(tmp_path, port), "--out", out)
    assert outcome.code == 0, outcome.err
    assert [q.split(" the load cell")[0] for q in asked] == [
        "Take",  # the load cell away from the actuator
        "Take everything off",
        *(f"Place {m} g on" for m in (20, 50, 100, 150, 200, 200, 150, 100, 50, 20)),
        "Take everything off",
    ]
    made = load_calibration(out)
    assert isinstance(made, LoadCellCalibration)
    assert not made.provenance.simulated
    assert made.counts_per_gram == pytest.approx(
        bench.instruments.counts_per_gram, rel=5 * made.counts_per_gram_u
    )


def test_a_person_who_leaves_ends_it_with_the_points_kept(
    rig: Command,
    bench: VirtualCalibrationBench,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answers = iter(["", "", ""])

    def person(self: Console, question: str, **_: Any) -> str:
        try:
            return next(answers)
        except StopIteration:
            raise EOFError from None

    monkeypatch.setattr(Console, "input", person)
    rig("init", tmp_path / "lab")
    monkeypatch.chdir(tmp_path / "lab")
    with served(bench.board) as port:
        outcome = rig(*COMMAND, *REFERENCE, "--bench", serial_bench(tmp_path, port))
    assert outcome.code == 130
    (kept,) = Path("calibration/points").glob("loadcell-*.csv")
    assert [line.split(",")[0] for line in kept.read_text().splitlines()] == ["kind", "zero", "up"]
    assert bench.plant.truth().valve_open
