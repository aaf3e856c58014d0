"""Controllers on one benchmark: what each makes of the same set-points on the same benches.

All are judged by the pressure that the board reports. The one in the host streams jogs in `hold`,
so the firmware's safety chain stands for it as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.control.excitation import Segment
from rig.control.family import Family
from rig.control.identify import LevelModel
from rig.control.lqg import LinearQuadraticGaussian
from rig.control.physics import motor_limit_s
from rig.control.step import step_metrics
from rig.control.tune import Tuning
from rig.control.tuning_file import board_gains
from rig.experiment.bench import Bench
from rig.experiment.identification import SAMPLE_S, LoopRequest, play_out
from rig.experiment.prepare import leave_home, make_ready, make_safe, take_over, write_parameters
from rig.link.client import Message, RigLink

Array = NDArray[np.float64]
Kind = Literal["board", "scheduled", "host"]
FAST_KPA_S = 20.0
"""Rate of the set-point: the firmware lowers it to what the drive can follow."""
RAMP_SHARE = 0.8
"""Of the drive's flow and acceleration that the host's set-point may ask for, as the firmware's."""
HOLD_S = 5.0
STEADY_S = 1.5
"""At the end of a hold, where it counts as steady."""
START_S = 2.0
"""At the beginning of a course that is no staircase, not judged."""
INWARD_ML = 35.0
"""How far the plunger is pushed in with the valve open where less gas is to be compressed."""
SINES_HZ = (0.1, 0.3, 1.0)
STAIRS_KPA = (2.0, 4.0, 6.0, 8.0, 5.0, 3.0, 1.0)


@dataclass(frozen=True)
class Case:
    """A course of set-points on a bench with something about it."""

    name: str
    targets: Callable[[float], float]
    """Set-point in kPa at a time in s."""
    duration_s: float
    levels_kpa: tuple[float, ...] = ()
    """Steps of HOLD_S each, if it consists of such."""
    inward_ml: float = 0.0
    added_ml: float = 0.0
    """Volume that the controllers do not know of."""
    leak_ml_s: float = 0.0
    """At 10 kPa gauge."""
    leak_lasts_s: float | None = None
    """None: for good."""

    @property
    def is_as_identified(self) -> bool:
        """Whether the plunger compresses the gas volume that the models were found for."""
        return self.inward_ml == 0 and self.added_ml == 0


def _stairs(levels: Sequence[float]) -> Callable[[float], float]:
    return lambda t: levels[min(int(t / HOLD_S), len(levels) - 1)]


def _sines(t: float) -> float:
    """About 4 kPa, each frequency for 10 s."""
    which = min(int(t / 10.0), len(SINES_HZ) - 1)
    return 4.0 + math.sin(2 * math.pi * SINES_HZ[which] * (t - 10.0 * which))


def _case(name: str, levels: tuple[float, ...], **about: float | None) -> Case:
    return Case(name, _stairs(levels), HOLD_S * len(levels), levels, **about)  # type: ignore[arg-type]


CASES = (
    _case("0 to 8 kPa", (8.0,)),
    _case("0 to 8 kPa, plunger in", (8.0,), inward_ml=INWARD_ML),
    _case("staircase", STAIRS_KPA),
    _case("staircase, +15 mL", STAIRS_KPA, added_ml=15.0),
    _case("staircase, +30 mL", STAIRS_KPA, added_ml=30.0),
    Case("sines", _sines, 30.0),
    _case("leak", (5.0, 5.0), leak_ml_s=0.3),
    _case("disturbance", (5.0, 5.0, 5.0), leak_ml_s=5.0, leak_lasts_s=0.5),
)


def motor_limited_mae_kpa(case: Case, stiffness: float, known: Mapping[str, float]) -> float:
    """Mean absolute error in kPa of a staircase that a perfect controller of this drive makes.

    `stiffness` is dp/dx in kPa/mL; the error of a symmetric move is half its height on average.
    """
    total, before = 0.0, 0.0
    for level in case.levels_kpa:
        moved = abs(level - before)
        move_s = motor_limit_s(
            moved / stiffness, known["max_flow_ml_s"], known["max_flow_acceleration_ml_s2"]
        )
        total += moved * move_s / 2
        before = level
    return total / case.duration_s


@dataclass(frozen=True)
class Controller:
    """One way to regulate; `parameters` go to the board first."""

    name: str
    kind: Kind
    parameters: dict[str, float]
    schedule: dict[float, dict[str, float]] = field(default_factory=dict)
    """For a scheduled one: parameters by set-point in kPa."""
    model: LevelModel | None = None
    """For one in the host: what it knows of the plant."""
    noise_kpa: float = 0.0


def contenders(family: Family, tuning: Tuning) -> tuple[Controller, ...]:
    """The controllers that are compared."""
    tuned = board_gains(tuning.single) | {"setpoint_rate_kpa_s": FAST_KPA_S}
    middle = family.models[len(family.models) // 2]
    schedule = {p: board_gains(d) for p, d in tuning.schedule.items()}
    untuned = {name: family.parameters[name] for name in board_gains(tuning.single)}
    return (
        Controller("PI as shipped", "board", untuned | {"setpoint_rate_kpa_s": FAST_KPA_S}),
        Controller("tuned PI", "board", tuned | {"feed_forward": 0.0}),
        Controller("tuned PI + feed-forward", "board", tuned),
        Controller("scheduled PI + feed-forward", "scheduled", tuned, schedule),
        Controller(
            "LQG in the host, 50 Hz", "host", tuned, model=middle, noise_kpa=family.noise_kpa
        ),
    )


@dataclass(frozen=True)
class Outcome:
    """What a controller made of a case; arrays (n,)."""

    controller: str
    case: str
    time_s: Array
    pressure_kpa: Array
    target_kpa: Array
    settling_s: float | None
    """Longest of the steps, into 1 % of the largest set-point; None if one did not settle."""
    overshoot_percent: float
    """Largest of the steps."""
    steady_rmse_kpa: float
    mae_kpa: float
    """Mean absolute error over all samples, transitions included."""
    effort_ml_s: float
    """Root mean square of the plunger's flow."""


def compete(bench: Bench, request: LoopRequest, controller: Controller, case: Case) -> Outcome:
    """Run a case; the bench is vented however it ends."""
    link = RigLink(bench.bus)
    link.open()
    take_over(link)
    known = write_parameters(link, request.board_parameters())
    for name, value in controller.parameters.items():
        known[name] = link.write_parameter(name, value)
    try:
        make_ready(link)
        leave_home(link)
        if case.inward_ml > 0:
            play_out(link, [Segment(case.inward_ml / 4.0, 4.0), Segment(1.0, 0.0)])
        messages, began_s = _run(link, controller, case, known)
    finally:
        make_safe(link)
    return _judged(controller, case, messages, began_s)


def _run(
    link: RigLink, controller: Controller, case: Case, known: dict[str, float]
) -> tuple[list[Message], float]:
    if controller.kind == "host":
        return _in_the_host(link, controller, case, known)
    messages: list[Message] = []
    began_s, sent = link.now_s, math.nan
    while (t := link.now_s - began_s) < case.duration_s:
        target = case.targets(t)
        if target != sent:
            if controller.schedule and case.levels_kpa:
                nearest = min(controller.schedule, key=lambda p: abs(p - target))
                for name, value in controller.schedule[nearest].items():
                    link.write_parameter(name, value)
            link.post("set_pressure", target)
            sent = target
        messages += link.receive(SAMPLE_S)
    return messages, began_s


def _in_the_host(
    link: RigLink, controller: Controller, case: Case, known: dict[str, float]
) -> tuple[list[Message], float]:
    assert controller.model is not None
    regulator = LinearQuadraticGaussian(
        controller.model, controller.noise_kpa, SAMPLE_S, known["max_flow_ml_s"]
    )
    stiffness = controller.model.static_gain
    course = _Course(
        RAMP_SHARE * known["max_flow_ml_s"] * stiffness,
        RAMP_SHARE * known["max_flow_acceleration_ml_s2"] * stiffness,
    )
    link.command("hold")
    link.await_state("hold", 1.0)
    messages: list[Message] = []
    began_s = link.now_s
    pressure = 0.0
    while (t := link.now_s - began_s) < case.duration_s:
        target = case.targets(t)
        value, rate = course.tick(target, smooth=not case.levels_kpa)
        link.post("jog", regulator.flow(pressure, value, rate))
        for message in link.receive(SAMPLE_S):
            messages.append(message)
            if message.name == "PRESSURE":
                pressure = float(message.values["pressure_kpa"])
    return messages, began_s


class _Course:
    """The host's set-point on its way, as the firmware's ramp moves."""

    def __init__(self, rate_kpa_s: float, acceleration_kpa_s2: float) -> None:
        self._most, self._change = rate_kpa_s, acceleration_kpa_s2 * SAMPLE_S
        self._value, self._rate = 0.0, 0.0

    def tick(self, target: float, *, smooth: bool) -> tuple[float, float]:
        """Set-point and its rate; a `smooth` target is followed as it is."""
        left = target - self._value
        if smooth and abs(left) <= self._most * SAMPLE_S:
            self._value, self._rate = target, left / SAMPLE_S
            return self._value, self._rate
        half = 0.5 * self._change
        fastest = math.sqrt(half**2 + 2 * self._change * abs(left) / SAMPLE_S) - half
        wanted = math.copysign(min(fastest, self._most, abs(left) / SAMPLE_S), left)
        self._rate += min(max(wanted - self._rate, -self._change), self._change)
        self._value += self._rate * SAMPLE_S
        if abs(target - self._value) < 1e-4:
            self._value, self._rate = target, 0.0
        return self._value, self._rate


def _judged(
    controller: Controller, case: Case, messages: Sequence[Message], began_s: float
) -> Outcome:
    reports = [m for m in messages if m.name == "PRESSURE" and m.time_s > began_s]
    time_s = np.array([m.time_s for m in reports]) - began_s
    pressure = np.array([m.values["pressure_kpa"] for m in reports], dtype=float)
    plunger = np.array([m.values["plunger_ml"] for m in reports], dtype=float)
    target = np.array([case.targets(t) for t in time_s])
    settled: list[float | None] = []
    overshoot = 0.0
    steady = np.zeros(time_s.size, dtype=bool)
    before = 0.0
    for number, level in enumerate(case.levels_kpa):
        inside = (time_s >= number * HOLD_S) & (time_s < (number + 1) * HOLD_S)
        steady |= inside & (time_s >= (number + 1) * HOLD_S - STEADY_S)
        if level != before:
            since = time_s[inside] - number * HOLD_S
            metrics = step_metrics(
                since, pressure[inside], level, 0.01 * max(case.levels_kpa), HOLD_S - STEADY_S
            )
            settled.append(metrics.settling_time_s)
            overshoot = max(overshoot, metrics.overshoot_percent or 0.0)
        before = level
    error = pressure - target
    if not case.levels_kpa:  # how it came to the middle is no part of a sine
        steady = time_s > START_S
        error = error[steady]
    judged = error[steady] if case.levels_kpa else error
    times = [s for s in settled if s is not None]
    return Outcome(
        controller=controller.name,
        case=case.name,
        time_s=time_s,
        pressure_kpa=pressure,
        target_kpa=target,
        settling_s=max(times) if times and len(times) == len(settled) else None,
        overshoot_percent=overshoot,
        steady_rmse_kpa=float(np.sqrt(np.mean(judged**2))),
        mae_kpa=float(np.mean(np.abs(error))),
        effort_ml_s=float(np.sqrt(np.mean((np.diff(plunger) / np.diff(time_s)) ** 2))),
    )
