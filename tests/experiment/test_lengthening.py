"""Actuators that lengthen on the virtual bench: measured by two markers against a frame at rest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from rig.board.virtual import VirtualBench
from rig.experiment.calibration.latency import swing_meter
from rig.experiment.deformation import ElongationMeter, LiveElongationMeter, recorded_meter
from rig.experiment.errors import ExperimentError
from rig.experiment.recheck import LOOKS
from rig.experiment.replay import ReplayedRun
from rig.plant.camera import CameraFault
from rig.vision.segment import decoded
from tests.experiment.conftest import (
    ROOT,
    FailsAfter,
    StopsAfter,
    VirtualRun,
    make_request,
    take,
    take_rest,
)
from tests.experiment.truth import errors

ACTUATOR = "bellow-axisymmetric"
ELONGATION_TARGET_MM = 0.05
FORCE_TARGET = 3e-3
"""Of the force itself: hundreds of grams press here, not two."""


def request(seed: int = 1):
    return make_request(seed=seed, bench="virtual", actuator=ACTUATOR)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> VirtualRun:
    return take(tmp_path_factory.mktemp("lengthening") / "run", request())


def test_elongation_and_push_are_what_is_so(run: VirtualRun) -> None:
    assert run.outcome.stop.exit_status == "success"
    points, truth = run.reader.points(), run.truth()
    assert {p.unit for p in points if p.key.experiment == "deformation"} == {"mm"}
    long = errors(points, truth, "deformation")
    assert np.abs(long.value).max() < ELONGATION_TARGET_MM
    assert (np.abs(long.value) < 2 * long.u).all()
    push = errors(points, truth, "blocked_force")
    top = max(p.value for p in points if p.key.experiment == "blocked_force")
    assert top > 500.0
    assert push.rms < FORCE_TARGET * top


def test_the_budget_names_what_pictures_of_markers_leave_uncertain(run: VirtualRun) -> None:
    top = max(run.reader.points(), key=lambda p: (p.unit == "mm", p.value))
    lines = {part.name for part in top.value_parts}
    assert {"readings", "scatter", "ruler pitch", "distance from the ruler's plane"} <= lines
    assert np.hypot.reduce([p.u * p.sensitivity for p in top.value_parts]) == pytest.approx(
        top.value_u
    )


def test_a_replay_counts_from_the_recorded_rest(run: VirtualRun) -> None:
    replayed = ReplayedRun(run.folder)
    assert replayed.points() == run.reader.points()
    assert replayed.deformation_readings() == run.reader.deformation_readings()


def test_a_resumed_run_counts_from_the_rest_of_its_beginning(tmp_path: Path) -> None:
    stopper = StopsAfter(2)
    run = take(tmp_path / "run", request(), observer=stopper, interrupted=stopper.check)
    rest = run.reader.rest_image()
    assert rest is not None
    whole = take_rest(run.folder, request())
    assert whole.outcome.stop.exit_status == "success"
    assert whole.reader.rest_image() == rest
    meter = recorded_meter(request().setup, rest)
    last = [image for image in whole.reader.images() if image.key is not None][-1]
    picture = decoded(last.jpeg)
    assert picture is not None
    (recorded,) = (
        r for r in whole.reader.deformation_readings() if (r.key, r.frame) == (last.key, last.frame)
    )
    assert meter.see(picture).value == recorded.value


def test_without_markers_at_rest_nothing_is_pressurised(tmp_path: Path) -> None:
    def hide(bench: VirtualBench) -> None:
        """Something is before the lower marker after the frames that check the calibration."""
        fault = CameraFault.OCCLUDED_CAP
        bench.camera = FailsAfter(bench, LOOKS, fault)  # type: ignore[assignment]

    run = take(tmp_path / "run", request(), prepare=hide)
    assert run.outcome.stop.exit_status == "failed"
    assert "marker 1 not found" in run.outcome.stop.reason
    assert max(t.pressure_kpa for t in run.truth()) < 0.5


def test_who_watches_gets_the_elongation_since_the_first_good_frame(run: VirtualRun) -> None:
    setup = request().setup
    meter = LiveElongationMeter(setup.calibrations)
    assert not meter.see(np.zeros((720, 1280, 3), np.uint8)).accepted
    pictures = [decoded(i.jpeg) for i in run.reader.images() if i.key is not None]
    first, last = meter.see(pictures[0]), meter.see(pictures[4])
    assert first.value == pytest.approx(0.0, abs=0.02)
    sight, drawn = meter.drawn(pictures[4])
    assert sight == last
    assert (drawn != pictures[4]).any()
    rest = run.reader.rest_image()
    assert rest is not None
    known = ElongationMeter.at_rest(decoded(rest), setup.calibrations).see(pictures[4])
    assert last.value == pytest.approx(known.value, abs=0.05)


def test_an_elongation_too_uncertain_is_no_measurement(run: VirtualRun) -> None:
    calibrations = request().setup.calibrations
    rest = run.reader.rest_image()
    assert rest is not None
    known = ElongationMeter.at_rest(decoded(rest), calibrations)
    # markers anywhere within a metre of the plane
    lost = replace(known, picturing=replace(known.picturing, out_of_plane_u_mm=1e3))
    picture = decoded([i.jpeg for i in run.reader.images() if i.key is not None][4])
    assert known.see(picture).accepted
    assert "would be uncertain by" in lost.see(picture).reason
    assert not lost.drawn(picture)[0].accepted


def test_a_run_without_rest_says_what_is_missing() -> None:
    with pytest.raises(ExperimentError, match="frame at rest"):
        recorded_meter(request().setup, None)
    with pytest.raises(ExperimentError, match="no readable picture"):
        recorded_meter(request().setup, b"no picture")


def test_the_latency_is_not_looked_for_with_it() -> None:
    with pytest.raises(ExperimentError, match="Nothing was moved"):
        swing_meter(request().setup)


def test_a_gripper_that_meets_its_object_is_not_taken_for_a_leak(tmp_path: Path) -> None:
    """Its 69 mL grow less from there on, which a straight line through the origin does not."""
    quick = yaml.safe_load((ROOT / "models/protocols/quick.yaml").read_text())
    del quick["deformation"]
    run = take(
        tmp_path / "run", make_request(quick, bench="virtual", actuator="bellow-gripper-cube")
    )
    assert run.outcome.stop.exit_status == "success"
    assert [e for e in run.reader.events() if e.name in ("leak", "burst")] == []
