"""The latency that the simulated camera hides, found from a swing of the actuator."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from rig.board.virtual import VirtualBench
from rig.calibrate.latency import Follower, LatencyFit, Swing, fit_latency
from rig.experiment.calibration.latency import SwingPlan, swing_actuator
from rig.experiment.calibration.session import calibrate_on
from rig.link.client import RigLink
from rig.vision.measure import AngleMeter

from .conftest import make_request

SEEDS = (1, 2, 3)
KNOWN = Follower(0.020, 0.012)
"""As the command assumes unless told."""
PLAN = SwingPlan.below(12.0, cycles=1, frames=8)


@dataclass(frozen=True)
class Found:
    hidden_s: float
    fit: LatencyFit

    @property
    def fitted_u_s(self) -> float:
        return self.fit.fit.u({"delay": 1.0})


def found(seed: int) -> Found:
    request = make_request(seed=seed)
    setup = request.setup
    bench = VirtualBench(setup, seed)
    meter = AngleMeter(setup.calibrations.camera, setup.calibrations.ruler)
    known_s = setup.calibrations.camera.latency_s(setup.bench.camera.latency)
    swings: list[Swing] = []

    def swung(link: RigLink) -> None:
        swings.append(swing_actuator(bench, link, meter, PLAN, known_s, lambda _: None))

    calibrate_on(bench, request.board_parameters(), swung, lambda _: None)
    return Found(bench.camera.latency_s, fit_latency(swings[0], KNOWN))


@pytest.fixture(scope="module")
def cameras() -> list[Found]:
    return [found(seed) for seed in SEEDS]


def test_the_hidden_latency_is_found_within_its_uncertainty(cameras: list[Found]) -> None:
    for camera in cameras:
        assert abs(camera.fit.value_s - camera.hidden_s) < 2 * camera.fit.u_s
        assert camera.fit.u_s < 0.015


def test_cameras_differ_by_what_they_hide(cameras: list[Found]) -> None:
    """The actuators follow alike: what is not known of that cancels."""
    first, *others = cameras
    assert max(abs(c.hidden_s - first.hidden_s) for c in others) > 0.01
    for other in others:
        differ_s = other.fit.fit["delay"] - first.fit.fit["delay"]
        u_s = (first.fitted_u_s**2 + other.fitted_u_s**2) ** 0.5
        assert abs(differ_s - (other.hidden_s - first.hidden_s)) < 2 * u_s
        assert u_s < 0.004


def test_frames_are_stamped_by_the_calibration_else_by_the_bench() -> None:
    setup = make_request().setup
    camera = setup.calibrations.camera
    assert camera.latency is not None
    told = replace(
        setup,
        bench=setup.bench.model_copy(
            update={"camera": setup.bench.camera.model_copy(update={"latency": 0.02})}
        ),
    )
    bare = replace(
        told,
        calibrations=replace(told.calibrations, camera=camera.model_copy(update={"latency": None})),
    )
    for which, latency_s in ((told, camera.latency.value), (bare, 0.02)):
        bench = VirtualBench(which, 1)
        bench.bus.poll(0.5)
        assert bench.camera.grab()[0] == pytest.approx(bench.bus.now_s - latency_s)
