"""Runs with leaks on the virtual bench: what the log and the summary say of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.board.virtual import VirtualBench
from rig.experiment.bench import Nobody
from rig.experiment.gas_watch import LEAK_PRESSURE, GasWatch, gas_monitor
from rig.link.client import Message
from rig.plant.plant import Faults
from rig.record.documents import GasDocument
from rig.report.build import build_report

from .conftest import SHORT, VirtualRun, make_request, take

DEFORMATION_ONLY = {k: v for k, v in SHORT.items() if k != "blocked_force"}
USUAL_LEAK_ML_S = 0.002


class Listens(Nobody):
    """Remembers what it was warned of."""

    def __init__(self) -> None:
        self.heard: list[str] = []

    def warned(self, text: str) -> None:
        self.heard.append(text)


@pytest.mark.parametrize(("cycles", "told"), [(1, True), (60, False)])
def test_after_many_strokes_the_estimate_is_not_put_on_record(cycles: int, told: bool) -> None:
    request = make_request()
    notes: list[GasDocument] = []
    watch = GasWatch(lambda: gas_monitor(request), lambda *_: None, notes.append)
    period_s, times = 10.0, np.arange(0.0, cycles * 10.0, 0.02)
    plunger_ml = 1.5 + 1.0 * (1 - np.cos(2 * np.pi * times / period_s))
    for index, (time_s, ml) in enumerate(zip(times, plunger_ml, strict=True)):
        kpa = 101.325 * (76.4 / (76.4 - (ml - 1.5)) - 1)
        pressure = {"pressure_kpa": kpa, "plunger_ml": ml, "plausible": 1}
        messages = [Message(float(time_s), "PRESSURE", pressure)]
        if index % 5 == 0:
            messages.append(Message(float(time_s), "HEARTBEAT", {"valve_open": 0}))
        watch([], messages)
    watch([], [Message(float(times[-1]), "HEARTBEAT", {"valve_open": 1})])
    assert bool(notes) == told


def leaking(ml_s: float) -> object:
    def prepare(bench: VirtualBench) -> None:
        bench.plant.set_faults(Faults(leak_conductance=ml_s * 1e-6 / LEAK_PRESSURE))

    return prepare


def test_a_sound_run_warns_of_nothing_and_knows_its_gas(short_run: VirtualRun) -> None:
    reader = short_run.reader
    assert not [e for e in reader.events() if e.name in ("leak", "burst")]
    notes = reader.gas()
    assert len(notes) == 2, "one closing for each sweep"
    for note in notes:
        assert abs(note.leak_ml_s - USUAL_LEAK_ML_S) < 3 * note.leak_u_ml_s < 0.02
    truth = {round(t.time_s, 1): t.volume_ml for t in short_run.truth()}
    for note in notes:
        true = truth[round(note.to_s, 1)]
        assert abs(note.actuator_ml - true) < 3 * note.actuator_u_ml


def test_a_leak_is_warned_of_in_log_report_and_to_the_observer(tmp_path: Path) -> None:
    observer = Listens()
    run = take(
        tmp_path / "run",
        make_request(DEFORMATION_ONLY),
        observer=observer,
        prepare=leaking(0.1),  # type: ignore[arg-type]
    )
    assert run.outcome.stop.exit_status == "success", "the plunger makes the leak good"
    (warning,) = [e for e in run.reader.events() if e.name == "leak"]
    assert warning.level == "warning"
    assert observer.heard == [warning.data["what"]]
    (note,) = run.reader.gas()
    assert note.leak_ml_s == pytest.approx(0.1 + USUAL_LEAK_ML_S, abs=3 * note.leak_u_ml_s)
    assert note.leak_u_ml_s < 0.01
    summary = build_report(run.folder)
    assert warning.data["what"] in summary.notes
    assert "There is a leak" in (run.folder / "report.html").read_text(encoding="utf-8")
