"""Trials as programs: every set-point and every look, known and checked before the bench moves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.control.physics import motor_limit_s
from rig.experiment.errors import LimitError
from rig.experiment.plan import PREPARE_GUESS_S, VENT_GUESS_S, check_pressure
from rig.mechanics.errors import MechanicsError
from rig.record.documents import PartKey
from rig.spec.bench import BenchSpec
from rig.spec.trial import (
    CreepTrial,
    CyclesTrial,
    DeformationTrial,
    PullTrial,
    PumpingTrial,
    TrajectoryTrial,
    Trial,
    VolumesTrial,
)
from rig.spec.workspace import Setup

Array = NDArray[np.float64]
Drive = Literal["pressure", "volume"]
MOVE_OFF_HOME = 1.5e-6
"""m3 that the plunger is off home when a program begins; volumes count from there."""
FASTEST_RATE = 100e3
"""Pa/s; the board takes no faster set-point (rig.dbc)."""
FIRST_LOOK_S = 2.0
"""Before, the pressure is still settling and the deformation says more of that than of creep."""
SHORTEST_S = 0.1
"""From corner to corner; a set-point and its rate take two acknowledgements, some 0.04 s."""
DEFORMATION_PIECES = 20
"""At most, of the broken line of pressures that deforms the actuator at a constant rate."""


@dataclass(frozen=True)
class Program:
    """One part of a trial: corners of a broken line of set-points, (n,), and when to look.

    `values` are in Pa or, as plunger volume from where the part begins, in m3.
    """

    key: PartKey
    drive: Drive
    times: Array
    values: Array
    looks: tuple[float, ...] = ()
    """Seconds since the start at which the camera is asked for the deformation."""
    notes: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """From the first to the last corner."""
        return float(self.times[-1])


@dataclass(frozen=True)
class TrialPlan:
    """A trial and its parts in order."""

    trial: Trial
    programs: tuple[Program, ...]

    @property
    def duration_s(self) -> float:
        """Expected bench time."""
        each = self.trial.rest + VENT_GUESS_S
        return PREPARE_GUESS_S + sum(p.duration_s + each for p in self.programs)


@dataclass(frozen=True)
class Motor:
    """What the plunger can do; SI units."""

    flow: float
    acceleration: float
    travel: float

    @classmethod
    def of(cls, bench: BenchSpec) -> Motor:
        """The motor of a bench as its spec limits it."""
        flow = min(bench.controller.max_flow, bench.stepper.max_step_rate * bench.volume_per_step)
        return cls(flow, bench.controller.max_flow_acceleration, bench.syringe.volume)

    def least_time(self, stroke: float) -> float:
        """Seconds for a stroke in m3 from rest to rest."""
        return motor_limit_s(stroke * 1e6, self.flow * 1e6, self.acceleration * 1e6)


def plan_trials(setup: Setup, cavity_volume: float) -> tuple[TrialPlan, ...]:
    """Every trial of the protocol as programs, checked.

    `cavity_volume` is that of the undeformed actuator in m3. Raises LimitError for what actuator,
    transducer, board, motor or syringe do not allow.
    """
    plans = []
    for trial in setup.protocol.trials:
        programs = tuple(
            program
            for repeat in range(1, trial.repeats + 1)
            for program in _programs(trial, repeat, setup, cavity_volume)
        )
        for program in programs[: len(programs) // trial.repeats]:
            _check(trial, program, setup)
        plans.append(TrialPlan(trial, programs))
    return tuple(plans)


def _programs(trial: Trial, repeat: int, setup: Setup, cavity: float) -> list[Program]:
    key = PartKey(trial=trial.name, kind=trial.kind, repeat=repeat, part=1)
    match trial:
        case CreepTrial():
            return [_creep(trial, key)]
        case CyclesTrial():
            return _cycles(trial, key)
        case PumpingTrial():
            return [_pumping(trial, key, Motor.of(setup.bench))]
        case DeformationTrial():
            return [_deformation(trial, key, setup, cavity)]
        case VolumesTrial():
            return [_volumes(trial, key)]
        case PullTrial():
            times = np.cumsum([0.0, 2.0, trial.settle, trial.duration])
            held = trial.pressure
            return [Program(key, "pressure", times, np.array([0.0, held, held, held]))]
        case TrajectoryTrial():
            return [_trajectory(trial, key)]


def _creep(trial: CreepTrial, key: PartKey) -> Program:
    ramp = trial.pressure / trial.rate
    times = np.cumsum([0.0, ramp, trial.hold, ramp, trial.recovery])
    values = np.array([0.0, trial.pressure, trial.pressure, 0.0, 0.0])
    looks = (0.0, *times[1] + _decades(trial.hold, trial.looks))
    looks += tuple(times[3] + _decades(trial.recovery, trial.looks))
    return Program(key, "pressure", times, values, tuple(float(t) for t in looks))


def _decades(duration: float, count: int) -> Array:
    """Times from `FIRST_LOOK_S` to the end, as many in each decade."""
    return np.geomspace(min(FIRST_LOOK_S, duration / 4), duration, count)


def _cycles(trial: CyclesTrial, key: PartKey) -> list[Program]:
    """One program for each block; a look at the end of either dwell of the chosen cycles."""
    programs = []
    period = 2 * (trial.ramp + trial.dwell)
    for first in range(0, trial.cycles, trial.block):
        cycles = range(first, min(first + trial.block, trial.cycles))
        corners = [(0.0, 0.0)] if trial.low == 0 else [(0.0, 0.0), (trial.ramp, trial.low)]
        looks = []
        for cycle in cycles:
            start = corners[-1][0]
            up = start + trial.ramp
            corners += [(up, trial.high), (up + trial.dwell, trial.high)]
            down = corners[-1][0] + trial.ramp
            corners += [(down, trial.low), (down + trial.dwell, trial.low)]
            if cycle % trial.look_every == 0:
                looks += [up + trial.dwell, start + period]
        times, values = np.array(corners).T
        part = key.model_copy(update={"part": first // trial.block + 1})
        programs.append(Program(part, "pressure", times, values, tuple(looks)))
    return programs


def _pumping(trial: PumpingTrial, key: PartKey, motor: Motor) -> Program:
    duration, notes = _possible(
        trial.duration,
        motor.least_time(trial.volume),
        f"{trial.volume * 1e6:g} mL in {trial.duration:g} s",
        trial,
    )
    times = np.cumsum([0.0, duration, trial.hold, duration, 1.0])
    values = np.array([0.0, trial.volume, trial.volume, 0.0, 0.0])
    looks = (0.0, float(times[2]), float(times[4]))
    return Program(key, "volume", times, values, looks, notes)


def _deformation(trial: DeformationTrial, key: PartKey, setup: Setup, cavity: float) -> Program:
    """Pressures at which a model has the deformation of equal times."""
    from rig.mechanics.model import predict

    limit = setup.actuator.limits.pressure
    known = np.linspace(0.0, limit, 61)
    try:
        response = predict(setup.actuator, setup.material, trial.model, known)
    except MechanicsError as error:
        raise LimitError(
            f"the trial '{trial.name}' needs the model '{trial.model}', which has no answer: "
            f"{error} Nothing was moved."
        ) from error
    if trial.angle is not None:
        deformed, wanted, unit, scale = response.angle, trial.angle, "deg", math.degrees(1)
    else:
        assert trial.displacement is not None
        deformed, wanted, unit, scale = response.displacement, trial.displacement, "mm", 1e3
    if deformed is None or not np.all(np.diff(deformed[np.isfinite(deformed)]) > 0):
        raise LimitError(
            f"the trial '{trial.name}' is refused: the model '{trial.model}' has no such "
            "deformation that grows with the pressure. Nothing was moved."
        )
    reached = np.isfinite(deformed)
    known, deformed = known[reached], deformed[reached]
    if wanted > deformed[-1] - deformed[0]:
        raise LimitError(
            f"the trial '{trial.name}' asks for {wanted * scale:g} {unit}; by the model "
            f"'{trial.model}' the actuator gives {(deformed[-1] - deformed[0]) * scale:.3g} {unit} "
            f"up to its limit of {limit / 1e3:g} kPa. Nothing was moved. Ask for less."
        )

    def line_at(share: Array) -> tuple[Array, Array]:
        """Pressures and strokes of the plunger at shares of the deformation."""
        p = np.interp(deformed[0] + share * wanted, deformed, known)
        growth = np.interp(p, known, response.volume[reached]) - response.volume[0]
        bench = setup.bench
        line = bench.syringe.volume + bench.syringe.dead_volume + bench.tubing.volume
        # Boyle: what the plunger must push for the gas and for the cavity's growth
        return p, (line + cavity) * p / (bench.ambient.pressure + p) + growth

    motor = Motor.of(setup.bench)
    fine = np.linspace(0.0, 1.0, 10 * DEFORMATION_PIECES + 1)
    pressures, strokes = line_at(fine)
    steepest = float(np.max(np.diff(strokes))) * (fine.size - 1) / motor.flow
    rate = float(np.max(np.diff(pressures))) * (fine.size - 1) / FASTEST_RATE
    duration, notes = _possible(
        trial.duration,
        max(motor.least_time(float(strokes[-1])), steepest, rate),
        f"{wanted * scale:g} {unit} in {trial.duration:g} s, {strokes[-1] * 1e6:.3g} mL of stroke",
        trial,
    )
    pieces = min(max(int(duration / SHORTEST_S), 1), DEFORMATION_PIECES)
    share = np.linspace(0.0, 1.0, pieces + 1)
    pressures, _ = line_at(share)
    times = np.append(share * duration, [duration + trial.hold, 2 * duration + trial.hold])
    values = np.append(pressures, [pressures[-1], 0.0])
    looks = (0.0, duration + trial.hold)
    return Program(key, "pressure", times, values, tuple(float(t) for t in looks), notes)


def _possible(
    wanted_s: float, least_s: float, what: str, trial: PumpingTrial | DeformationTrial
) -> tuple[float, tuple[str, ...]]:
    """The duration to use and what to say of it; raises LimitError if it is to be refused."""
    if wanted_s >= least_s:
        return wanted_s, ()
    why = (
        f"the trial '{trial.name}' asks for {what}; the motor needs {least_s:.2f} s "
        "(controller.max_flow, controller.max_flow_acceleration, stepper.max_step_rate)"
    )
    if trial.beyond_motor == "refuse":
        raise LimitError(
            f"{why}. Nothing was moved. Ask for less or more slowly, or say beyond_motor: slow."
        )
    return least_s * 1.02, (f"{why}: it is driven in {least_s * 1.02:.2f} s instead.",)


def _volumes(trial: VolumesTrial, key: PartKey) -> Program:
    step = trial.stop / trial.steps
    move = step / trial.flow
    corners = [(0.0, 0.0), (trial.hold, 0.0)]
    looks = [trial.hold]
    for level in [*range(1, trial.steps + 1), *range(trial.steps - 1, -1, -1)]:
        start = corners[-1][0]
        corners += [(start + move, level * step), (start + move + trial.hold, level * step)]
        looks.append(corners[-1][0])
    times, values = np.array(corners).T
    return Program(key, "volume", times, values, tuple(looks))


def _trajectory(trial: TrajectoryTrial, key: PartKey) -> Program:
    """Prefix, loops and suffix end to end; a gap of values between them is a ramp of 1 s."""
    pieces = [c for c in (trial.prefix, *[trial.loop] * trial.loops, trial.suffix) if c is not None]
    drive: Drive = "pressure" if pieces[0].pressures else "volume"
    corners: list[tuple[float, float]] = [(0.0, 0.0)]
    for piece in pieces:
        values = piece.pressures or piece.volumes
        begin, last = corners[-1]
        if values[0] != last:
            begin += 1.0
            corners.append((begin, values[0]))
        corners += [(begin + t, v) for t, v in zip(piece.times[1:], values[1:], strict=True)]
    line = np.array(corners)
    looks = np.linspace(0.0, line[-1, 0], trial.looks) if trial.looks else np.empty(0)
    return Program(key, drive, line[:, 0], line[:, 1], tuple(float(t) for t in looks))


def _check(trial: Trial, program: Program, setup: Setup) -> None:
    """Raise LimitError unless bench and actuator allow every set-point."""
    where = f"the trial '{trial.name}' of the protocol '{setup.protocol.name}'"
    shortest = float(np.min(np.diff(program.times)))
    if shortest < SHORTEST_S - 1e-9:
        raise LimitError(
            f"{where} has set-points {shortest:.3g} s apart; the link takes one every "
            f"{SHORTEST_S:g} s. Nothing was moved. Leave some out."
        )
    slopes = np.abs(np.diff(program.values) / np.diff(program.times))
    highest, steepest = float(np.max(program.values)), float(np.max(slopes))
    if program.drive == "pressure":
        check_pressure(where, highest, setup.actuator, setup.bench)
        if steepest > FASTEST_RATE:
            raise LimitError(
                f"{where} asks for {steepest / 1e3:.4g} kPa/s; the board takes no faster set-point "
                f"than {FASTEST_RATE / 1e3:g} kPa/s. Nothing was moved. Give it more time."
            )
        return
    motor = Motor.of(setup.bench)
    if highest + MOVE_OFF_HOME > motor.travel:
        raise LimitError(
            f"{where} asks for {highest * 1e6:g} mL; the plunger has "
            f"{(motor.travel - MOVE_OFF_HOME) * 1e6:g} mL (syringe.volume less the "
            f"{MOVE_OFF_HOME * 1e6:g} mL at which it begins). Nothing was moved. Ask for less."
        )
    if steepest > motor.flow * (1 + 1e-9):
        raise LimitError(
            f"{where} asks for {steepest * 1e6:.4g} mL/s; the motor gives {motor.flow * 1e6:g} "
            "mL/s (controller.max_flow, stepper.max_step_rate). Nothing was moved. Give it more "
            "time."
        )
