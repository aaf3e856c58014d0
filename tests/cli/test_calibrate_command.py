"""`rig calibrate`: files that it writes, points that it keeps, calibrations that have run out."""

from __future__ import annotations

import threading
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import pytest

from rig.calibrate.dead_weight import Piston
from rig.cli._calibration import RealCalibrationBench, TerminalReferences
from rig.experiment.errors import AbortedError
from rig.link.bus import SlcanBus
from rig.spec.bench import SerialBoard
from rig.spec.calibration import LoadCellCalibration, TransducerCalibration
from rig.spec.loading import load_calibration
from tests.benches import BEAM_ACTUATOR

from .conftest import Command


def test_a_transducer_is_calibrated_and_its_file_can_be_used(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = tmp_path / "lab"
    assert rig("init", lab).code == 0
    monkeypatch.chdir(lab)
    outcome = rig(
        *("calibrate", "pressure", "--bench", "virtual-beam", "--steps", "5", "--cycles", "1"),
        *("--serial-number", "ADP5 07", "--operator", "somebody"),
    )
    assert outcome.code == 0, outcome.err
    today = date.today()
    (file,) = (lab / "calibration").glob(f"transducer-ADP5-07-{today}.yaml")
    assert rig("check", file).code == 0
    made = load_calibration(file)
    assert isinstance(made, TransducerCalibration)
    provenance = made.provenance
    assert (provenance.date, provenance.operator) == (today, "somebody")
    assert provenance.valid_until == today + timedelta(days=365)
    assert provenance.simulated
    assert "simulated gauge" in provenance.reference
    assert provenance.environment.temperature == pytest.approx(296.15)
    assert made.evidence is not None
    assert len(made.evidence.rows) == 12
    assert all(len(fit.covariance) == len(fit.parameters) for fit in made.evidence.fits)

    bench = lab / "models" / "benches" / "virtual-beam.yaml"
    text = bench.read_text()
    assert text.count("calibration: transducer-virtual") == 1
    bench.write_text(text.replace("transducer-virtual", file.stem))
    characterise = ("characterise", "--actuator", BEAM_ACTUATOR, "--bench", "virtual-beam")
    assert rig(*characterise, "--dry-run").code == 0

    expired = file.read_text().replace(
        f"valid_until: '{provenance.valid_until}'", f"valid_until: '{today - timedelta(days=1)}'"
    )
    file.write_text(expired.replace(f"date: '{today}'", f"date: '{today - timedelta(days=2)}'"))
    refused = rig(*characterise, "--dry-run")
    assert refused.code == 1
    assert "transducer" in refused.err
    assert "--expired-calibrations" in refused.err
    assert rig(*characterise, "--dry-run", "--expired-calibrations").code == 0


def test_points_taken_elsewhere_are_fitted_as_those_of_the_bench(
    rig: Command, tmp_path: Path
) -> None:
    points = tmp_path / "deadweight.csv"
    rows = ["zero,0,0.5", *(f"up,{p},{0.5 + p / 10 + 1e-5 * (p % 2)}" for p in range(1, 15))]
    points.write_text("\n".join(["kind,reference_kpa,voltage_v", *rows]) + "\n")
    out = tmp_path / "made.yaml"
    command = ("calibrate", "pressure", "--bench", "mega", "--points", points, "--out", out)
    assert "--reference-u" in rig(*command).err
    outcome = rig(*command, "--reference", "dead-weight tester", "--reference-u", "0.01")
    assert outcome.code == 0, outcome.err
    made = load_calibration(out)
    assert isinstance(made, TransducerCalibration)
    assert made.gain == pytest.approx(10e3, rel=1e-4)
    assert not made.provenance.simulated


def test_an_interrupted_calibration_keeps_its_points(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = tmp_path / "lab"
    rig("init", lab)
    monkeypatch.chdir(lab)

    def stop(self: Any, about_kpa: float, idle: Any) -> float:
        if about_kpa > 6:
            raise AbortedError("stopped on request.")
        return about_kpa

    monkeypatch.setattr("rig.board.virtual_calibration.VirtualReferenceSet.gauge_kpa", stop)
    outcome = rig("calibrate", "pressure", "--bench", "virtual-beam", "--steps", "5")
    assert outcome.code == 130
    (kept,) = (lab / "calibration" / "points").glob("pressure-*.csv")
    assert len(kept.read_text().splitlines()) == 1 + 3  # header, zero, 2.82 and 5.64 kPa
    assert str(kept) in outcome.out.replace("\n", "")
    assert list((lab / "calibration").glob("transducer-2*.yaml")) == []
    assert "The bench was vented" in outcome.out
    assert f"rig calibrate pressure --bench virtual-beam --points {kept}" in outcome.out


def test_a_bench_that_could_not_be_vented_is_not_said_to_be(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    poll = SlcanBus.poll

    def cut(self: Any, about_kpa: float, idle: Any) -> float:
        if about_kpa > 6:
            monkeypatch.setattr(SlcanBus, "poll", lambda *which: poll(*which)[:0])
        return about_kpa

    monkeypatch.setattr("rig.board.virtual_calibration.VirtualReferenceSet.gauge_kpa", cut)
    outcome = rig("calibrate", "pressure", "--bench", "virtual-beam", "--steps", "5")
    assert outcome.code != 0
    assert "could not be vented from here" in outcome.out
    assert "was vented" not in outcome.out


def test_points_that_cannot_be_kept_are_no_defect_and_nothing_moves_for_them(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "calibration").mkdir()
    (tmp_path / "calibration" / "points").write_text("in the way")
    outcome = rig("calibrate", "loadcell", "--bench", "virtual-beam")
    assert outcome.code == 1
    assert "points cannot be kept there: File exists. Nothing was moved." in outcome.err
    assert "taring" not in outcome.out


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full here")
def test_a_full_disk_ends_a_calibration_with_the_bench_vented(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("rig.cli._calibration.first_free", lambda *_: Path("/dev/full"))
    outcome = rig("calibrate", "loadcell", "--bench", "virtual-beam")
    assert outcome.code == 1
    assert "/dev/full: a point cannot be written: No space left" in outcome.err
    assert "The bench was vented" in outcome.out
    assert "points are kept" not in outcome.out


class Typist:
    """A console whose person types these lines, each once `idle` was called."""

    def __init__(self, *lines: str) -> None:
        self._lines = list(lines)
        self.woken = threading.Event()
        self.said: list[str] = []

    def input(self, question: str) -> str:
        self.said.append(question)
        assert self.woken.wait(5), "nobody kept the board alive"
        self.woken.clear()
        if not self._lines:
            raise EOFError
        return self._lines.pop(0)

    def print(self, text: str) -> None:
        self.said.append(text)


def test_a_person_is_asked_until_the_answer_makes_sense_and_the_board_is_kept_alive() -> None:
    typist = Typist("abc", "998", "9,98")
    references = TerminalReferences(typist)  # type: ignore[arg-type]
    assert references.gauge_kpa(10.0, typist.woken.set) == 9.98
    assert any("no number" in text for text in typist.said)
    assert any("far from 10" in text for text in typist.said)


def test_a_person_is_asked_for_the_masses_on_a_piston() -> None:
    piston = Piston(area_mm2=80.65, area_u=0.0, mass_g=7.3, gravity=9.80665)
    typist = Typist("0,075", "74,95")
    references = TerminalReferences(typist)  # type: ignore[arg-type]
    assert references.floating_g(piston, 10.0, typist.woken.set) == 74.95
    assert "about 75.0 g" in typist.said[0]
    assert any("far from 75.0 g" in text for text in typist.said)


TESTER = ("calibrate", "pressure", "--piston-area-mm2", "80.65", "--piston-g", "7.3")


def test_a_dead_weight_tester_is_told_in_the_calibration(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "made.yaml"
    few = ("--bench", "virtual-beam", "--steps", "5", "--cycles", "1", "--out", out)
    outcome = rig(*TESTER, "--piston-area-u", "0.3", *few)
    assert outcome.code == 0, outcome.err
    made = load_calibration(out)
    assert isinstance(made, TransducerCalibration)
    assert "80.65 mm2 (u = 0.3 %), piston 7.3 g" in made.provenance.method
    assert "simulated masses" in made.provenance.reference
    assert made.gain_u == pytest.approx(3e-3, rel=0.1)


def test_a_real_tester_needs_the_gravity_of_the_lab_and_a_light_piston(rig: Command) -> None:
    mega = ("--bench", "mega", "--reference", "M1 set", "--reference-u", "0.003")
    assert "--gravity" in rig(*TESTER, *mega).err
    heavy = rig("calibrate", "pressure", "--piston-area-mm2", "80.65", "--piston-g", "200")
    assert heavy.code == 2
    assert "the piston alone makes 24.3 kPa" in heavy.err


def test_input_that_ends_stops_the_calibration() -> None:
    typist = Typist()
    with pytest.raises(AbortedError):
        TerminalReferences(typist).place(20.0, typist.woken.set)  # type: ignore[arg-type]


def test_a_person_who_arranges_the_bench_keeps_the_board_alive_and_may_leave(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("rig.cli._calibration.open_bus", lambda *_: None)
    typist = Typist("")
    bench = RealCalibrationBench(SerialBoard(kind="serial", port="none"), typist)  # type: ignore[arg-type]
    bench.mount("plugged", typist.woken.set)
    with pytest.raises(AbortedError):
        bench.mount("free", typist.woken.set)


@pytest.mark.parametrize("verb", ["pressure", "loadcell", "syringe"])
def test_every_verb_shows_examples(rig: Command, verb: str) -> None:
    outcome = rig("calibrate", verb, "--help")
    assert f"rig calibrate {verb} --bench mega" in outcome.out


def test_masses_that_are_none_are_refused(rig: Command) -> None:
    for masses in ("10,abc", "0,10", "10,nan,30,40,50", "10,20,5000", "10,20,30,40,40"):
        outcome = rig("calibrate", "loadcell", "--masses", masses)
        assert outcome.code == 2
        assert "taring" not in outcome.out


def test_a_short_look_at_creep_leaves_it_unknown(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "cell.yaml"
    command = ("calibrate", "loadcell", "--bench", "virtual-beam", "--cycles", "1")
    outcome = rig(*command, "--creep-s", "6", "--out", out)
    assert outcome.code == 0, outcome.err
    assert "creep not known" in outcome.out
    made = load_calibration(out)
    assert isinstance(made, LoadCellCalibration)
    assert made.creep_u == 0.0


def test_weighings_that_would_drive_the_plunger_into_its_end_are_refused(rig: Command) -> None:
    outcome = rig("calibrate", "syringe", "--weighings", "41")
    assert outcome.code == 2
    assert "it allows 32" in outcome.err
    assert "homing" not in outcome.out
