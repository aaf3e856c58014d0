"""Measurements on many virtual benches, each with errors of its own, beside the truth.

Pressure and force go through board, link and the evaluation of a run. The benches are the shipped
one but for one thing: their zeros drift faster, so that a zero is as old after seconds as it is in
a run after minutes; how far it drifts is as stated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from rig.board.virtual_calibration import VirtualCalibrationBench
from rig.experiment.deformation import BendingMeter
from rig.experiment.evaluate import Visit, component_of, deformation_point, force_point
from rig.experiment.measure import read_deformation
from rig.experiment.prepare import (
    bench_parameters,
    leave_home,
    make_ready,
    take_over,
    tare,
    write_parameters,
)
from rig.experiment.sweep import cell_readings, go_to, pressures_kpa, settle
from rig.link.client import Message, RigLink
from rig.link.schema import load_schema
from rig.plant.camera import VirtualCamera
from rig.record.documents import PointKey
from rig.spec.bench import BenchSpec
from rig.spec.protocol import Settling
from rig.spec.quantity import STANDARD_GRAVITY
from rig.spec.workspace import Workspace
from rig.validate.uncertainty import Estimate, combine
from rig.vision.measure import AngleMeter

from .conftest import ROOT

DRIFT_S = 15.0
OLD_ZERO_S = 30.0
READ_S = 1.0
FORCE_READ_S = 4.0
POLL_S = 0.02
FRAMES = 3
KEY = PointKey(experiment="blocked_force", repeat=1, direction="up", target_kpa=0.0)
SPACE = Workspace(ROOT)
GEOMETRY = SPACE.actuator("bellow-bending").geometry
CALIBRATIONS = SPACE.resolve_bench(SPACE.bench("virtual-beam"))


@dataclass(frozen=True)
class Coverage:
    """How often the 95 % interval held the truth."""

    errors: NDArray[np.float64]
    u95: NDArray[np.float64]

    @property
    def held(self) -> int:
        return int((abs(self.errors) <= self.u95).sum())

    @property
    def share(self) -> float:
        return self.held / len(self.errors)

    @property
    def plausible(self) -> bool:
        """Whether the count is what chance makes of 95 % in all but 1 of 1000 cases."""
        low, high = binom.interval(0.999, len(self.errors), 0.95)
        return bool(low <= self.held <= high)

    @property
    def rms_ratio(self) -> float:
        """R.m.s. error over U: 0.51 for a normal error; far less says that U is too large."""
        return float(np.sqrt(np.mean((self.errors / self.u95) ** 2)))

    def __str__(self) -> str:
        return (
            f"{self.held} of {len(self.errors)} = {self.share:.1%} within; r.m.s. error / U = "
            f"{self.rms_ratio:.3f} (normal: {1 / 1.96:.3f})"
        )


def fast_drifting_bench() -> BenchSpec:
    bench = SPACE.bench("virtual-beam")
    assert bench.virtual is not None
    sensors = bench.virtual.sensors.model_copy(update={"drift_time": DRIFT_S})
    virtual = bench.virtual.model_copy(update={"sensors": sensors})
    return bench.model_copy(update={"virtual": virtual})


BENCH = fast_drifting_bench()


def opened(seed: int) -> tuple[VirtualCalibrationBench, RigLink]:
    bench = VirtualCalibrationBench(BENCH, seed)
    link = RigLink(bench.bus)
    link.open()
    take_over(link)
    write_parameters(link, bench_parameters(BENCH, CALIBRATIONS.transducer, None, 0.0))
    return bench, link


def pressure_coverage(seeds: range) -> Coverage:
    return _coverage([_measured_pressure(seed) for seed in seeds])


def force_coverage(seeds: range) -> Coverage:
    return _coverage([_measured_force(seed) for seed in seeds])


def _coverage(pairs: list[tuple[Estimate, float]]) -> Coverage:
    return Coverage(
        np.array([measured.value - true for measured, true in pairs]),
        np.array([measured.u95 for measured, _ in pairs]),
    )


def _measured_pressure(seed: int) -> tuple[Estimate, float]:
    """A pressure in kPa on a bench with its tube plugged, and the mean true one meanwhile."""
    target_kpa = float(np.random.default_rng((seed, 1)).uniform(0.5, 14.0))
    bench, link = opened(seed)
    bench.mount("plugged", link.receive)
    make_ready(link)
    link.wait(OLD_ZERO_S)
    leave_home(link)
    go_to(link, target_kpa)
    settle(link, target_kpa, Settling.model_validate({}))
    messages, true = list[Message](), list[float]()
    end_s = link.now_s + READ_S
    while link.now_s < end_s:
        messages += link.receive(POLL_S)
        true.append(bench.plant.truth().gauge_pressure / 1e3)
    visit = _visit(link, pressures_kpa(messages))
    return combine(visit.pressure_kpa, visit.pressure_components), float(np.mean(true))


def _measured_force(seed: int) -> tuple[Estimate, float]:
    """A force in grams-force that came on after the tare and rested, and the true one."""
    force_g = float(np.random.default_rng((seed, 2)).uniform(5.0, 100.0))
    bench, link = opened(seed)
    tare(link)
    bench.plant.set_cell_load(force_g / 1e3 * STANDARD_GRAVITY)
    link.wait(OLD_ZERO_S)
    words = cell_readings(link.wait(FORCE_READ_S), load_schema())
    point = force_point(_visit(link, np.zeros(3)), words, CALIBRATIONS.load_cell)
    assert point.value is not None
    return combine(point.value, [component_of(line) for line in point.value_parts]), force_g


def _visit(link: RigLink, indicated_kpa: NDArray[np.float64]) -> Visit:
    now = link.now_s
    return Visit(KEY, now, now, now, now, indicated_kpa, CALIBRATIONS.transducer)


def angle_coverage(seeds: range) -> Coverage:
    """By rendered pictures."""
    return _coverage([pair for seed in seeds if (pair := _measured_angle(seed)) is not None])


def _measured_angle(seed: int) -> tuple[Estimate, float] | None:
    """An angle in degrees from a camera, ruler and background of this seed; None if rejected."""
    angle_deg = float(np.random.default_rng((seed, 3)).uniform(0.0, 110.0))
    assert BENCH.virtual is not None
    camera = VirtualCamera(
        BENCH.virtual.optics,
        CALIBRATIONS.ruler,
        GEOMETRY,
        BENCH.camera.jpeg_quality,
        np.random.default_rng((seed, 4)),
    )
    meter = BendingMeter(AngleMeter(CALIBRATIONS.camera, CALIBRATIONS.ruler))
    frames = [
        read_deformation(meter, camera.grab(np.radians(angle_deg), 0.1 * frame), KEY, frame)
        for frame in range(FRAMES)
    ]
    visit = Visit(KEY, 0.0, 0.0, 0.0, 0.0, np.zeros(3), CALIBRATIONS.transducer)
    point = deformation_point(visit, frames, "deg")
    if point.value is None:
        return None
    return combine(point.value, [component_of(line) for line in point.value_parts]), angle_deg
