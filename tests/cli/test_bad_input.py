"""Bad input: one paragraph that says what to do, a non-zero exit, nothing moved, nothing lost."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from .conftest import ROOT, Command, Outcome

GOOD = (ROOT / "models/actuators/bellow-bending.yaml").read_text()


def assert_explained(outcome: Outcome, *words: str) -> None:
    said = " ".join((outcome.out + outcome.err).split())
    assert outcome.code != 0
    assert "Traceback" not in said
    assert "defect in rig" not in said
    for word in words:
        assert word in said


def broken(folder: Path, old: str, new: str) -> Path:
    assert old in GOOD
    path = folder / "actuator.yaml"
    path.write_text(GOOD.replace(old, new))
    return path


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("bellow_number: 6", "bellow_nunber: 6", ("bellow_nunber", "bellow_number")),
        ("wall_thickness: 1.5 mm", "wall_thickness: 1.5 kPa", ("wall_thickness", "length")),
        ("wall_thickness: 1.5 mm", "wall_thickness: 3 mm", ("wall_thickness", "2.75")),
        ("material: agilus30", "material: agilus3", ("agilus30",)),
    ],
)
def test_a_broken_actuator_names_file_field_and_remedy(
    rig: Command, tmp_path: Path, old: str, new: str, words: tuple[str, ...]
) -> None:
    out = tmp_path / "run"
    outcome = rig("characterise", "--actuator", broken(tmp_path, old, new), "--out", out)
    assert_explained(outcome, "actuator.yaml", *words)
    assert not out.exists()


def test_a_missing_actuator_is_named(rig: Command, tmp_path: Path) -> None:
    outcome = rig("characterise", "--actuator", tmp_path / "nothing.yaml")
    assert_explained(outcome, "nothing.yaml")


def test_a_pressure_above_the_limit_moves_nothing(rig: Command, tmp_path: Path) -> None:
    actuator = broken(tmp_path, "pressure: 12 kPa", "pressure: 8 kPa")
    out = tmp_path / "run"
    outcome = rig("characterise", "--actuator", actuator, "--out", out)
    assert_explained(outcome, "10 kPa", "8 kPa", "Nothing was moved")
    assert not out.exists()


def test_a_real_bench_is_not_run_on_the_virtual_ones_calibrations(
    rig: Command, tmp_path: Path
) -> None:
    actuator = ROOT / "models/actuators/bellow-bending.yaml"
    out = tmp_path / "run"
    outcome = rig("characterise", "--actuator", actuator, "--bench", "mega", "--out", out)
    assert_explained(outcome, "transducer", "camera", "Calibrate", "Nothing was moved")
    assert not out.exists()


def test_a_port_that_is_not_there_is_named(rig: Command, tmp_path: Path) -> None:
    for source in (ROOT / "calibration").glob("*-virtual.yaml"):
        measured = source.read_text().replace("simulated: true", "simulated: false")
        (tmp_path / source.name).write_text(measured)
    text = (ROOT / "models/benches/mega.yaml").read_text()
    bench = tmp_path / "bench.yaml"
    text = re.sub(r"port: [^,}\s]+", "port: /dev/no-such-port", text)
    bench.write_text(re.sub(r"(\w+-virtual)(\.yaml)?", r"\1.yaml", text))
    actuator = ROOT / "models/actuators/bellow-bending.yaml"
    out = tmp_path / "run"
    outcome = rig("characterise", "--actuator", actuator, "--bench", bench, "--out", out)
    assert_explained(outcome, "/dev/no-such-port", "cannot be opened")
    assert not out.exists()


def test_a_folder_in_use_is_not_overwritten(rig: Command, tmp_path: Path) -> None:
    (tmp_path / "precious.txt").write_text("data")
    actuator = ROOT / "models/actuators/bellow-bending.yaml"
    outcome = rig("characterise", "--actuator", actuator, "--out", tmp_path)
    assert_explained(outcome, "not empty", "precious.txt")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["precious.txt"]


@pytest.mark.parametrize("verb", ["resume", "replay", "report"])
def test_a_folder_without_a_run_is_named(rig: Command, tmp_path: Path, verb: str) -> None:
    assert_explained(rig(verb, tmp_path / "nothing"), "nothing")


@pytest.mark.parametrize("verb", ["resume", "replay", "report"])
def test_a_file_that_is_no_log_is_refused(rig: Command, tmp_path: Path, verb: str) -> None:
    (tmp_path / "run.mcap").write_bytes(b"this is no MCAP file at all")
    assert_explained(rig(verb, tmp_path), "run.mcap")


def test_a_picture_without_an_actuator_is_rejected(rig: Command, tmp_path: Path) -> None:
    path = tmp_path / "wall.png"
    noise = np.random.default_rng(1).integers(60, 90, (480, 640, 3), dtype=np.uint8)
    cv2.imwrite(str(path), noise)
    assert_explained(rig("measure", path), "wall.png")


def test_a_text_file_is_no_picture(rig: Command, tmp_path: Path) -> None:
    path = tmp_path / "notes.png"
    path.write_text("not a picture")
    assert_explained(rig("measure", path), "notes.png")


def test_an_unknown_verb_is_refused(rig: Command) -> None:
    assert_explained(rig("charcterise"))
