"""Trials: programs that are checked before anything moves, and runs of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rig.board.virtual import VirtualBench
from rig.experiment.bench import Nobody
from rig.experiment.errors import AbortedError, LimitError
from rig.experiment.program import Motor, Program
from rig.link.bus import SlcanBus
from rig.link.slcan import RawFrame
from rig.record.documents import PartDocument
from rig.report.build import build_report
from rig.report.data import RunData
from rig.report.trials import trial_data
from rig.spec.protocol import ProtocolSpec
from rig.spec.workspace import Workspace

from .conftest import ROOT, VirtualRun, make_request, take, take_rest


def protocol(*trials: dict[str, Any]) -> dict[str, object]:
    named = [{"name": f"trial-{i}", "rest": 1} | trial for i, trial in enumerate(trials)]
    return {"kind": "protocol", "name": "trials", "trials": named}


def program(trial: dict[str, Any]) -> Program:
    return make_request(protocol(trial)).trials[0].programs[0]


CREEP = {"kind": "creep", "pressure": 6, "rate": 4, "hold": 20, "recovery": 15, "looks": 6}
CYCLES = {"kind": "cycles", "low": 0.5, "high": 5, "ramp": 1, "cycles": 6, "block": 3}
VOLUMES = {"kind": "volumes", "stop": 4, "steps": 2, "flow": 2, "hold": 2}
PUSH = {"kind": "pumping", "volume": 4, "duration": 2}
CURVE = {"times": [0, 1, 2], "pressures": [1, 3, 1]}


# --- plans -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("trial", "why"),
    [
        (CREEP | {"pressure": 13}, r"13 kPa, above 12 kPa, limits\.pressure of the actuator"),
        (CYCLES | {"high": 14}, "14 kPa, above 12 kPa"),
        (VOLUMES | {"stop": 59}, "the plunger has 58.5 mL"),
        (VOLUMES | {"flow": 9}, "9 mL/s; the motor gives 8 mL/s"),
        (PUSH | {"duration": 0.5}, r"4 mL in 0\.5 s; the motor needs 0\.70 s"),
        (
            {"kind": "constant_deformation", "angle": 60, "duration": 0.2},
            "60 deg in 0.2 s, .* the motor needs",
        ),
        ({"kind": "constant_deformation", "angle": 300, "duration": 9}, "the actuator gives"),
        (
            {"kind": "trajectory", "loop": {"times": [0, 0.05], "pressures": [0, 1]}},
            "0.05 s apart; the link takes one every 0.1 s",
        ),
        (
            {"kind": "trajectory", "loop": {"times": [0, 1], "pressures": [0, 20]}},
            "20 kPa, above 12 kPa",
        ),
    ],
)
def test_what_is_not_allowed_is_refused_before_anything_moves(
    trial: dict[str, Any], why: str
) -> None:
    with pytest.raises(LimitError, match=why):
        program(trial)


def test_the_least_time_of_a_stroke_is_that_of_a_trapezoid() -> None:
    motor = Motor(flow=8e-6, acceleration=40e-6, travel=60e-6)
    assert motor.least_time(8e-6) == pytest.approx(8 / 8 + 8 / 40)
    assert motor.least_time(0.4e-6) == pytest.approx(2 * np.sqrt(0.4 / 40))
    assert motor.least_time(64 / 40 * 1e-6) == pytest.approx(2 * np.sqrt(1.6 / 40))


def test_a_drive_beyond_the_motor_is_slowed_if_that_is_wanted_and_says_so() -> None:
    slowed = program(PUSH | {"duration": 0.5, "beyond_motor": "slow"})
    assert slowed.times[1] == pytest.approx(1.02 * 0.7)
    assert "it is driven in 0.71 s instead" in slowed.notes[0]
    assert program(PUSH).notes == ()


def test_constant_deformation_follows_the_inverse_of_the_model() -> None:
    from rig.mechanics.model import predict

    setup = make_request().setup
    drive = program({"kind": "constant_deformation", "angle": 60, "duration": 4})
    response = predict(setup.actuator, setup.material, "beam", drive.values[:-2])
    assert response.angle is not None
    degrees = np.degrees(response.angle)
    np.testing.assert_allclose(np.diff(degrees), 60 / (degrees.size - 1), rtol=0.02)


def test_a_trajectory_is_prefix_loops_and_suffix_end_to_end() -> None:
    line = program(
        {
            "kind": "trajectory",
            "prefix": {"times": [0, 2], "pressures": [0, 1]},
            "loop": CURVE,
            "loops": 2,
            "suffix": {"times": [0, 1], "pressures": [0, 0]},
        }
    )
    np.testing.assert_allclose(line.times, [0, 2, 3, 4, 5, 6, 7, 8])
    np.testing.assert_allclose(line.values, np.multiply([0, 1, 3, 1, 3, 1, 0, 0], 1e3))


def test_cycles_are_cut_into_blocks() -> None:
    plan = make_request(protocol(CYCLES | {"cycles": 7})).trials[0]
    assert [p.key.part for p in plan.programs] == [1, 2, 3]
    assert [np.sum(np.diff(p.values) > 1e3) for p in plan.programs] == [3, 3, 1]


# --- runs --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> VirtualRun:
    trials = protocol(CREEP, CYCLES, VOLUMES, {"kind": "trajectory", "loop": CURVE, "loops": 2})
    return take(tmp_path_factory.mktemp("trials") / "run", make_request(trials))


def test_every_part_is_done_and_on_record(run: VirtualRun) -> None:
    assert run.outcome.stop.exit_status == "success", run.outcome.stop.reason
    done = [(p.key.kind, p.key.part) for p in run.reader.parts()]
    assert done == [("creep", 1), ("cycles", 1), ("cycles", 2), ("volumes", 1), ("trajectory", 1)]


def test_the_plunger_stands_where_the_volumes_say(run: VirtualRun) -> None:
    (part,) = [p for p in run.reader.parts() if p.key.kind == "volumes"]
    pressure = run.reader.telemetry("PRESSURE")
    for time_s, volume_ml in ((4.9, 2.0), (7.9, 4.0), (13.9, 0.0)):
        at = int(np.searchsorted(pressure["time_s"], part.from_s + time_s))
        assert pressure["plunger_ml"][at] - part.plunger_from_ml == pytest.approx(
            volume_ml, abs=0.01
        )


def test_the_report_has_the_figures_of_each_trial(run: VirtualRun) -> None:
    summary = build_report(run.folder)
    figures = {trial.kind: {f.name: f for f in trial.figures} for trial in summary.trials.values()}
    assert set(figures) == {"creep", "cycles", "volumes", "trajectory"}
    creep = figures["creep"]["creep from the first to the last look, repeat 1"].value
    specimen = 0.04 * 62  # the bench's share of creep of what 6 kPa bend
    assert 0.3 * specimen < creep < 1.3 * specimen
    assert figures["cycles"]["cycles done"].value == 6
    assert figures["cycles"]["mean of the pressure peaks"].value == pytest.approx(5, abs=0.3)
    assert figures["cycles"]["last amplitude"].value > 30
    assert figures["volumes"]["pressure at 4 mL, up, repeat 1"].value == pytest.approx(4, abs=0.5)
    assert figures["trajectory"]["mean absolute deviation from the line"].value < 0.3
    page = (run.folder / "report.html").read_text(encoding="utf-8")
    for title in ("Creep and recovery", "Cyclic fatigue", "Volume control", "Trajectory"):
        assert title in page
    rows = (run.folder / "looks.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + len(run.reader.looks())


def test_the_report_plans_the_trials_of_any_actuator_that_bends() -> None:
    setup = Workspace(ROOT).setup("bellow-rectangular", "virtual-beam")
    trial = {"kind": "volumes", "name": "v", "stop": "2 mL", "steps": 2}
    spec = ProtocolSpec.model_validate(protocol(trial))
    reader = SimpleNamespace(parts=lambda: ())
    data = RunData(reader, replace(setup, protocol=spec), (), None)  # type: ignore[arg-type]
    ((plan, parts),) = trial_data(data)
    assert (plan.trial.name, parts) == ("v", [])


def test_a_killed_fatigue_run_goes_on_after_its_last_block(tmp_path: Path) -> None:
    class Stops(Nobody):
        def __init__(self) -> None:
            self.stop = False

        def part_done(self, part: PartDocument) -> None:
            self.stop = True

    observer = Stops()

    def interrupted() -> None:
        if observer.stop:
            raise AbortedError("enough")

    request = make_request(protocol(CYCLES | {"look_every": 3}))
    folder = tmp_path / "run"
    aborted = take(folder, request, observer=observer, interrupted=interrupted)
    assert aborted.outcome.stop.exit_status == "aborted"
    assert aborted.reader.events()[-3].data["result"] == (
        "The bench was vented and the plunger is home."
    )
    rest = take_rest(folder, request)
    assert rest.outcome.stop.exit_status == "success"
    assert [p.key.part for p in rest.reader.parts()] == [1, 2]
    assert rest.reader.resumes()[0].points_kept == 1


def test_too_high_a_pressure_ends_a_volume_drive_and_is_told(tmp_path: Path) -> None:
    request = make_request(protocol(VOLUMES | {"stop": 14, "steps": 1, "flow": 4}))
    run = take(tmp_path / "run", request)
    assert run.outcome.stop.exit_status == "success"
    (part,) = run.reader.parts()
    assert "above the actuator's limit of 12 kPa" in part.notes[0]
    assert run.reader.telemetry("PRESSURE")["pressure_kpa"].max() < 13.2, "the board trips there"


def test_the_peak_of_a_pull_is_found(tmp_path: Path) -> None:
    def pulls(bench: VirtualBench) -> None:
        class Pulled(SlcanBus):
            """Somebody pulls harder and harder at the load cell, until it slips at 3 N."""

            def poll(self, duration_s: float) -> list[RawFrame]:
                force = np.interp(self.now_s, [30, 36, 36.2, 99], [0, 3, 0.2, 0.2])
                bench.plant.set_cell_load(float(force))
                return super().poll(duration_s)

        bench.bus = Pulled(bench.board)

    trial = {"kind": "pull", "pressure": 4, "duration": 25, "prominence": 50}
    run = take(tmp_path / "run", make_request(protocol(trial)), prepare=pulls)
    summary = build_report(run.folder)
    figures = {f.name: f.value for f in summary.trials["trial-0"].figures}
    assert figures["pulls in which a peak was found"] == 1
    held = max(t.force_g for t in run.truth() if t.time_s < 36)
    pulled = 3 / 9.80665 * 1e3
    assert figures["mean of the peak forces"] == pytest.approx(pulled + held, rel=0.03)
