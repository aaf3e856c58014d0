"""The swing that a camera's latency is found from: pressure up and down, frames all the while."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig.calibrate.latency import Swing
from rig.experiment.bench import Bench
from rig.experiment.calibration.references import Stage
from rig.experiment.errors import ExperimentError
from rig.experiment.prepare import leave_home, make_ready, vent
from rig.experiment.sweep import go_to
from rig.link.client import Message, RigLink
from rig.spec.workspace import Setup
from rig.vision.measure import AngleMeter
from rig.vision.segment import UNREADABLE, decoded

RATE = "setpoint_rate_kpa_s"
SETTLING_CYCLES = 3
"""Before frames count; 30 s in all."""
LEAST_SHARE = 0.5
"""Of the frames must be trusted."""


@dataclass(frozen=True)
class SwingPlan:
    """Limits in kPa, how long a way takes at each rate, s, and frames on it; all that `cycles`
    times up and down."""

    low_kpa: float
    high_kpa: float
    cycles: int
    frames: int
    ways_s: tuple[float, ...] = (1.0, 4.0)

    @classmethod
    def below(cls, limit_kpa: float, cycles: int, frames: int) -> SwingPlan:
        """Well off the limit, and off zero pressure, where the plunger may have to pull."""
        return cls(0.2 * limit_kpa, 0.7 * limit_kpa, cycles, frames)


def swing_meter(setup: Setup) -> AngleMeter:
    """What follows the swing; raises ExperimentError for an actuator that does not bend."""
    if setup.actuator.geometry.deformation != "bending":
        raise ExperimentError(
            "the camera's latency is found with an actuator that bends, but "
            f"'{setup.actuator.name}' lengthens. Nothing was moved. Mount one that bends, as "
            "models/actuators/bellow-bending.yaml, and give its spec."
        )
    return AngleMeter(setup.calibrations.camera, setup.calibrations.ruler)


def swing_actuator(
    bench: Bench, link: RigLink, meter: AngleMeter, plan: SwingPlan, known_s: float, stage: Stage
) -> Swing:
    """Swing the actuator of a bench that has its parameters; it is vented afterwards.

    `known_s` is the latency that the camera's times have been freed of. Raises ExperimentError
    where too few frames can be trusted.
    """
    bench.mount("free")
    stage("homing the plunger and zeroing the transducer")
    make_ready(link)
    leave_home(link)
    messages: list[Message] = []
    frames: list[tuple[float, bytes]] = []
    ways_s = plan.cycles * plan.ways_s
    stage("swinging until creep has become a loop")
    settling = SETTLING_CYCLES * plan.ways_s
    for number, way_s in enumerate((*settling, *ways_s), 1 - len(settling)):
        if number > 0:
            stage(f"swing {number} of {len(ways_s)}")
        link.write_parameter(RATE, (plan.high_kpa - plan.low_kpa) / way_s)
        for target_kpa in (plan.high_kpa, plan.low_kpa):
            go_to(link, target_kpa)
            for _ in range(plan.frames):
                heard = link.wait(way_s / plan.frames)
                if number > 0:
                    messages += heard
                    frames.append(bench.camera.grab())
    vent(link)
    stage(f"measuring {len(frames)} frames")
    return _measured(meter, frames, messages, known_s)


def _measured(
    meter: AngleMeter, frames: list[tuple[float, bytes]], messages: list[Message], known_s: float
) -> Swing:
    seen, reason = [], ""
    for time_s, jpeg in frames:
        image = decoded(jpeg)
        found = None if image is None else meter.measure(image)
        if found is not None and found.accepted:
            seen.append((time_s + known_s, found.angle_deg))
        else:
            reason = UNREADABLE if found is None else found.reason
    if len(seen) < LEAST_SHARE * len(frames):
        raise ExperimentError(
            f"only {len(seen)} of {len(frames)} frames of the swinging actuator can be trusted; "
            f"the last other one: {reason}. Check light, focus and view."
        )
    frame_s, angle_deg = np.array(seen, dtype=np.float64).T
    heard = [
        (m.time_s, m.values["pressure_kpa"], m.values["plunger_ml"])
        for m in messages
        if m.name == "PRESSURE"
    ]
    return Swing(frame_s, angle_deg, *np.array(heard, dtype=np.float64).T)
