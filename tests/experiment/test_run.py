"""Whole runs on the virtual bench: what is measured, what is recorded, how a run ends."""

from __future__ import annotations

import copy
import os
import signal
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rig.board.virtual import VirtualBench
from rig.experiment.bench import Nobody
from rig.experiment.prepare import board_parameters
from rig.experiment.recheck import LOOKS
from rig.experiment.replay import ReplayedRun
from rig.link.e2e import protect
from rig.link.errors import BoardFaultError, UnexpectedStateError
from rig.link.schema import load_schema
from rig.plant.camera import CameraFault
from rig.plant.plant import Faults
from rig.record.bulk_writer import BulkWriter
from rig.record.documents import PointDocument
from rig.record.errors import RecordError
from rig.record.reader import RunReader
from rig.record.writer import RunWriter
from tests.evidence import Evidence

from .conftest import ROOT, SHORT, FailsAfter, StopsAfter, VirtualRun, make_request, take, take_rest
from .truth import errors

ANGLE_TARGET_DEG = 0.2
FORCE_TARGET_G = 0.1
PRESSURE_TARGET_KPA = 0.05


def keys(run: VirtualRun) -> list[tuple[str, int, str, float]]:
    return [
        (p.key.experiment, p.key.repeat, p.key.direction, p.key.target_kpa)
        for p in run.reader.points()
    ]


def test_every_point_of_the_plan_is_measured_in_order(short_run: VirtualRun) -> None:
    assert short_run.outcome.stop.exit_status == "success"
    assert keys(short_run) == [
        ("deformation", 1, "up", 0.0),
        ("deformation", 1, "up", 5.0),
        ("deformation", 1, "up", 10.0),
        ("deformation", 1, "down", 5.0),
        ("deformation", 1, "down", 0.0),
        ("blocked_force", 1, "up", 0.0),
        ("blocked_force", 1, "up", 5.0),
        ("blocked_force", 1, "up", 10.0),
    ]


def test_every_point_is_held_after_settling(short_run: VirtualRun) -> None:
    for point in short_run.reader.points():
        assert point.settled_s is not None
        assert point.measured_from_s - point.settled_s >= 1.0 + 2.0  # window and hold


def test_sweeps_start_off_the_home_switch_so_that_0_kpa_can_be_regulated(
    short_run: VirtualRun,
) -> None:
    pressure = short_run.reader.telemetry("PRESSURE")
    for point in short_run.reader.points():
        if point.key.target_kpa == 0.0 and point.key.direction == "up":
            started = int(pressure["time_s"].searchsorted(point.started_s))
            assert pressure["plunger_ml"][started] > 0.5


def test_the_pressure_is_regulated_to_the_set_point(short_run: VirtualRun) -> None:
    truth = short_run.truth()
    for experiment in ("deformation", "blocked_force"):
        off = errors(short_run.reader.points(), truth, experiment).regulation_kpa
        assert abs(off).max() < PRESSURE_TARGET_KPA


def test_the_board_trips_just_above_the_actuators_own_limit() -> None:
    setup = make_request().setup
    limits = setup.actuator.limits.model_copy(update={"pressure": 5e3})
    weak = setup.actuator.model_copy(update={"limits": limits})
    parameters = board_parameters(setup.bench, weak, setup.calibrations.transducer, 13e-6)
    assert parameters["pressure_limit_kpa"] == pytest.approx(5.5)


def test_the_way_down_lies_above_the_way_up(short_run: VirtualRun) -> None:
    value = {(p.key.direction, p.key.target_kpa): p.value for p in short_run.reader.points()[:5]}
    assert value["down", 5.0] is not None
    assert value["up", 5.0] is not None
    assert value["down", 5.0] > value["up", 5.0] + 0.1


def test_a_board_that_falls_idle_under_a_point_ends_the_run(tmp_path: Path) -> None:
    class Blinks:
        """Between the frames of the third point the supply blinks: idle again, and no fault.

        `LOOKS` frames were taken before, to check the calibration.
        """

        def __init__(self, bench: VirtualBench) -> None:
            self._bench, self._camera, self._frames = bench, bench.camera, 0

        def grab(self) -> tuple[float, bytes]:
            self._frames += 1
            if self._frames == LOOKS + 5:
                idle = {"opcode": 9, "number": 100, "argument": 0.0}
                frame_id, payload = load_schema().encode("COMMAND", idle)
                self._bench.bus.send(frame_id, protect(frame_id, payload, 14))
            return self._camera.grab()

    def blink(bench: VirtualBench) -> None:
        bench.camera = Blinks(bench)  # type: ignore[assignment]

    run = take(tmp_path / "run", make_request(), prepare=blink)
    assert run.outcome.stop.exit_status == "failed"
    assert isinstance(run.outcome.error, UnexpectedStateError)
    assert len(run.reader.points()) == 2


def test_a_full_disk_vents_first_and_says_what_to_do(tmp_path: Path) -> None:
    class Full(Nobody):
        def point_done(self, point: PointDocument) -> None:
            raise OSError(28, "No space left on device")

    with pytest.raises(RecordError, match="Free space"):
        take(tmp_path / "run", make_request(), observer=Full())
    log = RunReader(tmp_path / "run")
    assert len(log.points()) == 1
    assert log.telemetry("HEARTBEAT")["valve_open"][-1] == 1


def test_a_disk_that_fills_between_points_does_not_keep_the_bench_from_venting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, full = RunWriter.can_frames, False
    benches: list[VirtualBench] = []

    def fills(self: RunWriter, *batch: Any) -> None:
        nonlocal full
        full = full or benches[0].plant.truth().gauge_pressure > 4e3
        if full:
            raise OSError(28, "No space left on device")
        write(self, *batch)

    monkeypatch.setattr(RunWriter, "can_frames", fills)
    monkeypatch.setattr("rig.experiment.recorder.BATCH_FRAMES", 10)
    with pytest.raises(RecordError, match="Free space"):
        take(tmp_path / "run", make_request(), prepare=benches.append)
    truth = benches[0].plant.truth()
    assert abs(truth.gauge_pressure) < 50.0
    assert truth.pushed_volume < 1e-8


def test_a_log_that_cannot_grow_does_not_keep_the_bench_from_venting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As above, but the file refuses, which the writer of logs tells in its own words."""
    write = BulkWriter._write
    benches: list[VirtualBench] = []
    full = False

    def fills(self: BulkWriter, data: bytes) -> None:
        nonlocal full
        full = full or (bool(benches) and benches[0].plant.truth().gauge_pressure > 4e3)
        if full:
            monkeypatch.setattr(self, "_stream", device)
        write(self, data)

    monkeypatch.setattr(BulkWriter, "_write", fills)
    monkeypatch.setattr("rig.experiment.recorder.BATCH_FRAMES", 10)
    with (
        Path("/dev/full").open("wb", buffering=0) as device,
        pytest.raises(RecordError, match="make room"),
    ):
        take(tmp_path / "run", make_request(), prepare=benches.append)
    truth = benches[0].plant.truth()
    assert abs(truth.gauge_pressure) < 50.0
    assert truth.pushed_volume < 1e-8


def test_a_dark_picture_ends_the_run_instead_of_a_point_without_a_value(tmp_path: Path) -> None:
    def darken(bench: VirtualBench) -> None:
        """The light goes off after the frames that check the calibration."""
        bench.camera = FailsAfter(bench, LOOKS, CameraFault.DARK)  # type: ignore[assignment]

    run = take(tmp_path / "run", make_request(), prepare=darken)
    assert run.outcome.stop.exit_status == "failed"
    assert "camera frames" in run.outcome.stop.reason
    assert run.reader.points() == ()


def test_what_is_measured_is_what_is_so(short_run: VirtualRun) -> None:
    truth = short_run.truth()
    angle = errors(short_run.reader.points(), truth, "deformation")
    force = errors(short_run.reader.points(), truth, "blocked_force")
    assert angle.rms < ANGLE_TARGET_DEG
    assert force.rms < FORCE_TARGET_G
    assert max(abs(angle.pressure_kpa).max(), abs(force.pressure_kpa).max()) < PRESSURE_TARGET_KPA


def test_the_site_shows_what_is_measured(short_run: VirtualRun, evidence: Evidence) -> None:
    points, truth = short_run.reader.points(), short_run.truth()
    for experiment, quantity, unit, abs_tolerance in (
        ("deformation", "angle", "deg", 0.05),
        ("blocked_force", "force", "g", 0.05),
    ):
        found = errors(points, truth, experiment)
        taken = [p for p in points if p.key.experiment == experiment]
        evidence(
            f"chain-{quantity}",
            f"Whole chain: the {quantity} of a virtual run against the specimen's truth, which the "
            "run cannot see",
            {
                "pressure (kPa)": [p.key.target_kpa for p in taken],
                f"{quantity} error ({unit})": list(found.value),
                f"stated 2 u ({unit})": list(2 * found.u),
            },
            plot="marks",
            quantity=unit,
            abs=abs_tolerance,
        )


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_the_pipeline_error_stays_below_target_at_other_seeds(seed: int, tmp_path: Path) -> None:
    run = take(tmp_path / "run", make_request(seed=seed))
    points, truth = run.reader.points(), run.truth()
    assert errors(points, truth, "deformation").rms < ANGLE_TARGET_DEG
    force = errors(points, truth, "blocked_force")
    assert force.rms < FORCE_TARGET_G
    assert abs(force.pressure_kpa).max() < PRESSURE_TARGET_KPA


def test_the_specimen_bends_otherwise_than_the_model_says(short_run: VirtualRun) -> None:
    from rig.mechanics.model import predict

    setup = make_request().setup
    points = [p for p in short_run.reader.points() if p.key.target_kpa == 10.0]
    response = predict(setup.actuator, setup.material, "beam", [0.0, 10e3])
    model_deg = float(response.angle[-1]) * 57.29577951308232
    measured = next(p.value for p in points if p.key.experiment == "deformation")
    assert measured is not None
    assert abs(measured - model_deg) > 1.0


def test_the_same_seed_gives_the_same_points(short_run: VirtualRun, tmp_path: Path) -> None:
    again = take(tmp_path / "run", make_request())
    assert again.reader.points() == short_run.reader.points()


def test_another_seed_gives_other_points(short_run: VirtualRun, tmp_path: Path) -> None:
    other = take(tmp_path / "run", make_request(seed=2))
    assert other.reader.points()[1].value != short_run.reader.points()[1].value


def test_a_replay_computes_exactly_the_recorded_points(short_run: VirtualRun) -> None:
    replayed = ReplayedRun(short_run.folder)
    assert replayed.points() == short_run.reader.points()
    assert replayed.deformation_readings() == short_run.reader.deformation_readings()


def test_the_bench_is_vented_at_the_end(short_run: VirtualRun) -> None:
    assert abs(short_run.truth()[-1].pressure_kpa) < 0.01
    assert short_run.reader.telemetry("HEARTBEAT")["valve_open"][-1] == 1


def test_what_a_run_was_cautioned_of_is_a_warning_in_its_log(tmp_path: Path) -> None:
    stopper = StopsAfter(1)
    request = replace(make_request(), cautions=("the calibration of load cell has expired",))
    run = take(tmp_path / "run", request, observer=stopper, interrupted=stopper.check)
    (warning,) = (event for event in run.reader.events() if event.name == "caution")
    assert warning.level == "warning"
    assert warning.data == {"what": "the calibration of load cell has expired"}


def test_an_interrupted_run_is_vented_readable_and_resumable(
    short_run: VirtualRun, tmp_path: Path
) -> None:
    stopper = StopsAfter(4)
    request = make_request()
    run = take(tmp_path / "run", request, observer=stopper, interrupted=stopper.check)
    assert run.outcome.stop.exit_status == "aborted"
    assert abs(run.truth()[-1].pressure_kpa) < 0.01
    assert run.reader.complete
    assert len(run.reader.points()) == 4

    resumed = take_rest(run.folder, request)
    assert resumed.outcome.stop.exit_status == "success"
    assert keys(resumed) == keys(short_run)
    assert [note.points_kept for note in resumed.reader.resumes()] == [4]
    # the descending point was taken up again over the top pressure, so its branch is the same
    whole, rest = short_run.reader.points()[4], resumed.reader.points()[4]
    assert whole.value is not None
    assert rest.value is not None
    assert rest.value == pytest.approx(whole.value, abs=0.5)


def test_the_actuator_is_conditioned_before_the_first_point_of_each_session(
    tmp_path: Path,
) -> None:
    protocol = copy.deepcopy(SHORT)
    del protocol["blocked_force"]
    protocol["deformation"]["conditioning"] = 1
    stopper, request = StopsAfter(2), make_request(protocol)
    run = take(tmp_path / "run", request, observer=stopper, interrupted=stopper.check)
    resumed = take_rest(run.folder, request)
    assert resumed.outcome.stop.exit_status == "success"
    points, pressure = resumed.reader.points(), resumed.reader.telemetry("PRESSURE")
    # the resumed log goes on where the last point kept was measured
    sessions = [(0.0, points[0].started_s), (points[1].measured_to_s, points[2].started_s)]
    for begin_s, first_s in sessions:
        before = (pressure["time_s"] > begin_s + 0.5) & (pressure["time_s"] < first_s)
        assert pressure["pressure_kpa"][before].max() > 9.9


@pytest.mark.parametrize(
    ("faults", "code"),
    [
        (Faults(sensor_open=True), "sensor_open"),
        (Faults(sensor_short=True), "sensor_short"),
        (Faults(hx711_silent=True), "hx711_timeout"),
        (Faults(emergency_stop=True), "emergency_stop"),
        (Faults(leak_conductance=4e-10), "leak"),
    ],
)
def test_a_fault_ends_the_run_vented_with_its_points_kept(
    faults: Faults, code: str, tmp_path: Path
) -> None:
    benches: list[VirtualBench] = []

    class Breaks(Nobody):
        def point_done(self, point: PointDocument) -> None:
            if point.key.target_kpa == 5.0:
                benches[0].plant.set_faults(faults)

    run = take(
        tmp_path / "run", make_request(), observer=Breaks(), prepare=lambda b: benches.append(b)
    )
    assert run.outcome.stop.exit_status == "failed"
    assert isinstance(run.outcome.error, BoardFaultError)
    assert run.outcome.error.code == code
    assert len(run.reader.points()) == 2
    assert abs(run.truth()[-1].pressure_kpa) < 0.05


def test_a_killed_run_keeps_its_points_and_can_be_resumed(
    short_run: VirtualRun, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    script = textwrap.dedent(
        """
        import os, signal, sys
        from pathlib import Path
        from rig.experiment.bench import Nobody
        from tests.experiment.conftest import make_request, take

        class Killed(Nobody):
            count = 0
            def point_done(self, point):
                Killed.count += 1
            def point_began(self, key):
                if Killed.count == 3:
                    os.kill(os.getpid(), signal.SIGKILL)

        take(Path(sys.argv[1]), make_request(), observer=Killed())
        """
    )
    process = subprocess.run(
        [sys.executable, "-c", script, str(folder)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=False,
    )
    assert process.returncode == -signal.SIGKILL, process.stderr.decode()
    killed = RunReader(folder)
    assert not killed.complete
    assert killed.points() == short_run.reader.points()[:3]

    resumed = take_rest(folder, make_request())
    assert resumed.outcome.stop.exit_status == "success"
    assert keys(resumed) == keys(short_run)
    assert len(resumed.reader.resumes()) == 1
