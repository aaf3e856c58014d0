"""Controllers on one benchmark: what each makes of the same set-points on the same benches.

All are judged by the pressure that the board reports. The one in the host streams jogs in `hold`,
so the firmware's safety chain stands for it as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.control.excitation import Segment
from rig.control.family import Family, Fluid
from rig.control.identify import LevelModel
from rig.control.loop import Gains, Margins, margins
from rig.control.lqg import LinearQuadraticGaussian, ramp_gain, robust_regulator
from rig.control.physics import motor_limit_s
from rig.control.step import step_metrics
from rig.control.tune import Tuning
from rig.control.tuning_file import board_gains
from rig.experiment.bench import Bench
from rig.experiment.identification import SAMPLE_S, LoopRequest, play_out
from rig.experiment.prepare import leave_home, make_ready, make_safe, take_over, write_parameters
from rig.link.client import Message, RigLink
from rig.spec.faults import FaultScript
from rig.spec.physics import Liquid
from rig.spec.workspace import Setup

Array = NDArray[np.float64]
Kind = Literal["board", "scheduled", "host"]
FAST_KPA_S = 20.0
"""Rate of the set-point: the firmware lowers it to what the drive can follow."""
HOST_SHARE = 0.85
"""Of the drive's flow and acceleration that the host's set-point may ask for; from 0.95 on it
overshoots by a tenth."""
STEADY_SHARE = 0.3
"""Of a hold, at its end, that counts as steady."""
FAULT_SHARE = 0.8
"""Of the first hold, after which a case's leak begins: the step has settled."""
START_S = 2.0
"""At the beginning of a course that is no staircase, not judged."""
INWARD_ML = 35.0
"""How far the plunger is pushed in with the valve open where less gas is to be compressed."""
SINES_HZ = (0.1, 0.3, 1.0)
STAIRS_KPA = (2.0, 4.0, 6.0, 8.0, 5.0, 3.0, 1.0)
VOLUMES = (0.7, 1.0, 1.3)
"""Of the gas in the line, or in the liquid, over what the models were found for."""


@dataclass(frozen=True)
class Case:
    """A course of set-points on a bench with something about it."""

    name: str
    targets: Callable[[float], float]
    """Set-point in kPa at a time in s."""
    duration_s: float
    levels_kpa: tuple[float, ...] = ()
    """Steps of equal length, if it consists of such."""
    inward_ml: float = 0.0
    volume: float = 1.0
    """Of gas, relative to what the models were found for."""
    leak_ml_s: float = 0.0
    """At 10 kPa gauge."""
    leak_lasts_s: float | None = None
    """None: for good."""

    @property
    def hold_s(self) -> float:
        """Length of a step."""
        return self.duration_s / len(self.levels_kpa)

    @property
    def is_as_identified(self) -> bool:
        """Whether the plunger compresses the gas volume that the models were found for."""
        return self.inward_ml == 0 and self.volume == 1


def staircase(name: str, levels: tuple[float, ...], hold_s: float, **about: float | None) -> Case:
    """Steps of `hold_s` each."""

    def target(t: float) -> float:
        return levels[min(int(t / hold_s), len(levels) - 1)]

    return Case(name, target, hold_s * len(levels), levels, **about)  # type: ignore[arg-type]


def _sines(t: float) -> float:
    """About 4 kPa, each frequency for 10 s."""
    which = min(int(t / 10.0), len(SINES_HZ) - 1)
    return 4.0 + math.sin(2 * math.pi * SINES_HZ[which] * (t - 10.0 * which))


def _benchmark(hold_s: float, leak_ml_s: float, burst_ml_s: float) -> tuple[Case, ...]:
    names = [
        f"staircase, volume {100 * (v - 1):+.0f} %" if v != 1 else "staircase" for v in VOLUMES
    ]
    return (
        staircase("0 to 8 kPa", (8.0,), hold_s),
        *(
            staircase(name, STAIRS_KPA, hold_s, volume=volume)
            for name, volume in zip(names, VOLUMES, strict=True)
        ),
        Case("sines", _sines, 10.0 * len(SINES_HZ)),
        staircase("leak", (5.0, 5.0), hold_s, leak_ml_s=leak_ml_s),
        staircase("disturbance", (5.0,) * 3, hold_s, leak_ml_s=burst_ml_s, leak_lasts_s=0.5),
    )


GAS_CASES = (
    *_benchmark(hold_s=5.0, leak_ml_s=0.3, burst_ml_s=5.0),
    staircase("0 to 8 kPa, plunger in", (8.0,), 5.0, inward_ml=INWARD_ML),
)
LIQUID_CASES = _benchmark(hold_s=20.0, leak_ml_s=0.05, burst_ml_s=0.5)
"""Of a bench full of liquid, which swings and is therefore regulated slowly."""


def cases_of(fluid: Fluid) -> tuple[Case, ...]:
    """The benchmark for a bench with this fluid."""
    return GAS_CASES if fluid == "gas" else LIQUID_CASES


def setup_of(setup: Setup, case: Case, system_ml: float) -> Setup:
    """The simulated set-up of a case, whose gas is not what the controllers know.

    More gas than `system_ml` is more dead volume; with less, `compete` pushes the plunger in. In a
    liquid there is another share of air.
    """
    bench = setup.bench
    if isinstance(bench.fluid, Liquid):
        air = bench.fluid.entrained_air * case.volume
        fluid = bench.fluid.model_copy(update={"entrained_air": air})
        return replace(setup, bench=bench.model_copy(update={"fluid": fluid}))
    dead = bench.syringe.dead_volume + max(case.volume - 1, 0.0) * system_ml * 1e-6
    syringe = bench.syringe.model_copy(update={"dead_volume": dead})
    return replace(setup, bench=bench.model_copy(update={"syringe": syringe}))


def leak_of(case: Case, controller: Controller) -> FaultScript | None:
    """What the simulated bench is to break, if anything."""
    if case.leak_ml_s <= 0:
        return None
    leak = {
        "kind": "leak",
        "flow": f"{case.leak_ml_s} mL/s",
        "when": {"state": "hold" if controller.kind == "host" else "run"},
        "delay": f"{FAULT_SHARE * case.hold_s} s",
    }
    if case.leak_lasts_s is not None:
        leak["lasts"] = f"{case.leak_lasts_s} s"
    return FaultScript.model_validate(
        {
            "kind": "faults",
            "name": "leak",
            "description": case.name,
            "faults": [leak],
            "expect": {"run": "success"},
        }
    )


def motor_limited_mae_kpa(case: Case, family: Family) -> float:
    """Mean absolute error in kPa of a staircase that the fastest moves of this drive leave.

    Each step is one trapezoid of the plunger's speed, from rest to rest in the least time, that the
    model at its middle answers with the target when it ends; then there is no error.
    """
    known, total, before = family.parameters, 0.0, 0.0
    for level in case.levels_kpa:
        moved = abs(level - before)
        middle = (level + before) / 2
        model = min(family.models, key=lambda m: abs(m.level_kpa - middle))
        total += _least_error(
            model, moved, known["max_flow_ml_s"], known["max_flow_acceleration_ml_s2"]
        )
        before = level
    return total / case.duration_s


def _least_error(model: LevelModel, moved_kpa: float, flow: float, acceleration: float) -> float:
    """Integral of the error in kPa s over the fastest move that ends `moved_kpa` further."""
    import control
    from scipy.optimize import brentq

    system = model.state_space() * control.ss(0.0, 1.0, 1.0, 0.0)

    def course(volume_ml: float) -> tuple[Array, Array]:
        duration_s = motor_limit_s(volume_ml, flow, acceleration)
        time_s = np.linspace(0.0, duration_s, 501)
        ramp_s = min(flow / acceleration, duration_s / 2)
        speed = acceleration * np.minimum(np.minimum(time_s, duration_s - time_s), ramp_s)
        return time_s, np.asarray(control.forced_response(system, time_s, speed).outputs)

    about = moved_kpa / model.static_gain
    volume_ml = brentq(lambda v: course(v)[1][-1] - moved_kpa, 0.2 * about, 2.0 * about)
    time_s, pressure = course(float(volume_ml))
    return float(np.trapezoid(np.abs(moved_kpa - pressure), time_s))


class StatedMargins(NamedTuple):
    """The least of all levels and volumes, by the identified models."""

    gain_db: float
    phase_deg: float


class Host(NamedTuple):
    """What the regulator in the host is made of."""

    model: LevelModel
    noise_kpa: float
    weight_ml_s: float


@dataclass(frozen=True)
class Controller:
    """One way to regulate; `parameters` go to the board first."""

    name: str
    kind: Kind
    parameters: dict[str, float]
    margins: StatedMargins
    schedule: dict[float, dict[str, float]] = field(default_factory=dict)
    """For a scheduled one: parameters by set-point in kPa."""
    host: Host | None = None
    """For one in the host."""


def contenders(family: Family, tuning: Tuning) -> tuple[Controller, ...]:
    """The controllers that are compared; a liquid has no feed-forward."""
    rate = FAST_KPA_S if family.fluid == "gas" else family.parameters["setpoint_rate_kpa_s"]
    tuned = board_gains(tuning.single) | {"setpoint_rate_kpa_s": rate}
    middle = family.models[len(family.models) // 2]
    schedule = {p: board_gains(d) for p, d in tuning.schedule.items()}
    untuned = {name: family.parameters[name] for name in board_gains(tuning.single)}
    shipped = Gains(untuned["proportional_ml_s_kpa"], untuned["integral_ml_s2_kpa"])
    members = [one.member.model for one in tuning.single.members]
    lqg = robust_regulator(
        middle, members, family.noise_kpa, SAMPLE_S, family.parameters["max_flow_ml_s"]
    )
    scheduled = [one.margins for design in tuning.schedule.values() for one in design.members]
    single = _worst([one.margins for one in tuning.single.members])
    fed = " + feed-forward" if family.fluid == "gas" else ""
    return (
        Controller(
            "PI as shipped",
            "board",
            untuned | {"setpoint_rate_kpa_s": rate},
            _worst([margins(model, shipped) for model in members]),
        ),
        Controller("tuned PI", "board", tuned | {"feed_forward": 0.0}, single),
        *([Controller(f"tuned PI{fed}", "board", tuned, single)] if fed else []),
        Controller(f"scheduled PI{fed}", "scheduled", tuned, _worst(scheduled), schedule),
        Controller(
            "LQG in the host, 50 Hz",
            "host",
            tuned,
            _worst([lqg.margins(model) for model in members]),
            host=Host(middle, family.noise_kpa, lqg.weight_ml_s),
        ),
    )


def _worst(found: Sequence[Margins]) -> StatedMargins:
    return StatedMargins(min(m.gain_db for m in found), min(m.phase_deg for m in found))


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
        inward_ml = _inward_ml(case, request, known["system_volume_ml"])
        if inward_ml > 0:
            flow = known["max_flow_ml_s"] / 2
            play_out(link, [Segment(inward_ml / flow, flow), Segment(1.0, 0.0)])
        messages, began_s = _run(link, controller, case, known)
    finally:
        make_safe(link)
    return _judged(controller, case, messages, began_s)


def _inward_ml(case: Case, request: LoopRequest, system_ml: float) -> float:
    """How far in the plunger stands, at ambient pressure, before the case begins."""
    if isinstance(request.setup.bench.fluid, Liquid):
        return 0.0
    return case.inward_ml + max(1 - case.volume, 0.0) * system_ml


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
    assert controller.host is not None
    model, noise_kpa, weight_ml_s = controller.host
    regulator = LinearQuadraticGaussian(
        model, noise_kpa, SAMPLE_S, known["max_flow_ml_s"], weight_ml_s
    )
    gain = ramp_gain(model)
    rate = min(HOST_SHARE * known["max_flow_ml_s"] * gain, known["setpoint_rate_kpa_s"])
    change = HOST_SHARE * known["max_flow_acceleration_ml_s2"] * gain
    for mode in model.modes:  # a ramp that begins within one period of a swing does not start it
        change = min(change, rate * mode.frequency / (2 * math.pi))
    course = _Course(rate, change)
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
        hold_s, steady_s = case.hold_s, (1 - STEADY_SHARE) * case.hold_s
        inside = (time_s >= number * hold_s) & (time_s < (number + 1) * hold_s)
        steady |= inside & (time_s >= number * hold_s + steady_s)
        if level != before:
            since = time_s[inside] - number * hold_s
            metrics = step_metrics(
                since, pressure[inside], level, 0.01 * max(case.levels_kpa), steady_s
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


@dataclass(frozen=True)
class Standing:
    """What a controller is on one bench, all cases together."""

    controller: str
    settling_s: float | None
    """Of the staircase, into 1 %; None if a step did not settle."""
    overshoot_percent: float
    """Of the staircase."""
    steady_rmse_kpa: float
    mae_kpa: float
    sine_mae_kpa: float
    effort_ml_s: float
    """Of the staircase."""
    worst_volume: float
    """Largest mean absolute error of the staircase over the volumes, over that of the nominal."""
    gain_db: float
    phase_deg: float


def standings(controllers: Sequence[Controller], outcomes: Sequence[Outcome]) -> list[Standing]:
    """One for each controller whose staircases and sines have all been run."""
    found = []
    for one in controllers:
        own = {o.case: o for o in outcomes if o.controller == one.name}
        stairs = [o for name, o in own.items() if name.startswith("staircase")]
        if len(stairs) < len(VOLUMES) or "sines" not in own:
            continue
        nominal = own["staircase"]
        found.append(
            Standing(
                one.name,
                nominal.settling_s,
                nominal.overshoot_percent,
                nominal.steady_rmse_kpa,
                nominal.mae_kpa,
                own["sines"].mae_kpa,
                nominal.effort_ml_s,
                max(o.mae_kpa for o in stairs) / nominal.mae_kpa,
                *one.margins,
            )
        )
    return found
