"""The latency that the simulated camera hides, found from a swing of the actuator."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from rig.board.virtual import VirtualBench
from rig.calibrate.latency import (
    CREEP,
    TRANSDUCER,
    Lag,
    LatencyFit,
    Swing,
    fit_latency,
    tube_lag,
)
from rig.experiment.calibration.latency import SwingPlan, swing_actuator
from rig.experiment.calibration.session import calibrate_on
from rig.link.client import RigLink
from rig.vision.measure import AngleMeter

from .conftest import make_request

SEEDS = (1, 2, 3)
DAMPING_U_S = 0.012
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
    spec = setup.bench
    assert spec.virtual is not None
    # the command's default, too
    damping = Lag("damping", spec.virtual.specimen.response_time, DAMPING_U_S)
    tube = tube_lag(swings[0], spec, spec.syringe.dead_volume)
    lags = (damping, tube, TRANSDUCER, CREEP)
    return Found(bench.camera.latency_s, fit_latency(swings[0], lags))


@pytest.fixture(scope="module")
def cameras() -> list[Found]:
    return [found(seed) for seed in SEEDS]


def test_the_hidden_latency_is_found_within_its_uncertainty(cameras: list[Found]) -> None:
    for camera in cameras:
        assert abs(camera.fit.value_s - camera.hidden_s) < 2 * camera.fit.u_s
        assert camera.fit.u_s < 0.015


def test_what_is_not_damping_is_known_to_milliseconds(cameras: list[Found]) -> None:
    """Tube, filter and creep: the damping is the bench's own here, so its uncertainty is none."""
    for camera in cameras:
        u_s = (camera.fit.u_s**2 - DAMPING_U_S**2) ** 0.5
        assert u_s < 0.004
        assert abs(camera.fit.value_s - camera.hidden_s) < 1.5 * u_s


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
