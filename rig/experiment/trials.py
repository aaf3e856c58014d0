"""Drives the programs of trials: set-points in bench time, looks by camera, all on record."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from rig.experiment.bench import Fixture
from rig.experiment.context import RunContext
from rig.experiment.deformation import DeformationMeter
from rig.experiment.gas_watch import GasWatch
from rig.experiment.measure import sighted
from rig.experiment.prepare import leave_home, vent
from rig.experiment.program import Motor, Program, TrialPlan
from rig.experiment.recorder import LinkRecorder
from rig.experiment.sweep import go_to
from rig.link.client import POLL_S
from rig.record.documents import LookDocument, PartDocument, PartKey
from rig.record.writer import RunWriter

RATE = "setpoint_rate_kpa_s"
LEAST_RATE_KPA_S = 0.01
"""The board takes none slower (rig.dbc)."""
JOG_PERIOD_S = 0.2
"""A jog lasts for half a second (firmware): renewed in time the plunger moves steadily."""
CORRECTED_AT_REST, CORRECTED_MOVING = 0.6, 0.1
"""Share of the distance from the line that the next jog makes good."""
AT_REST_ML = 0.002
"""The plunger is where it should be; a step is 0.0003 mL, the link resolves 0.001 mL."""


def run_trials(
    context: RunContext,
    record: RunWriter,
    recorder: LinkRecorder,
    watch: GasWatch | None,
    done: Collection[PartKey],
    meter: DeformationMeter | None,
) -> None:
    """Every trial that still has parts to do, each from the vented state.

    `meter` is needed by those that look.
    """
    plans = [p for p in context.request.trials if any(g.key not in done for g in p.programs)]
    rate_kpa_s = context.request.board_parameters()[RATE]
    for plan in plans:
        fixture: Fixture = "blocked" if plan.trial.kind == "pull" else "free"
        context.mount(fixture)
        if watch is not None:
            watch.renew()
        left = [p for p in plan.programs if p.key not in done]
        _trial(context, record, recorder, plan, left, meter)
        context.link.write_parameter(RATE, rate_kpa_s)


def _trial(
    context: RunContext,
    record: RunWriter,
    recorder: LinkRecorder,
    plan: TrialPlan,
    left: list[Program],
    meter: DeformationMeter | None,
) -> None:
    """Parts of one repeat follow each other under pressure; repeats begin vented."""
    link, trial = context.link, plan.trial
    repeat = 0
    for program in left:
        if program.key.repeat != repeat:
            if repeat:
                vent(link)
            repeat = program.key.repeat
            context.observer.stage(f"resting vented before {describe_part(program.key)}")
            link.wait(trial.rest)
            leave_home(link)
        context.observer.stage(describe_part(program.key))
        record.event(link.now_s, "part", program.key.model_dump())
        document = Player(context, record, program, meter).play()
        recorder.flush()
        record.part(document, link.now_s)
        for note in document.notes:
            record.event(link.now_s, "part", {"what": note}, "warning")
            context.observer.warned(note)
        context.observer.part_done(document)
    vent(link)


def describe_part(key: PartKey) -> str:
    """A part in words."""
    return f"{key.trial}, repeat {key.repeat}, part {key.part}"


class Player:
    """Plays one program; the board is idle or, in a later part of a repeat, regulates."""

    def __init__(
        self,
        context: RunContext,
        record: RunWriter,
        program: Program,
        meter: DeformationMeter | None,
    ) -> None:
        self._context = context
        self._link = context.link
        self._record = record
        self._program = program
        self._meter = meter
        self._notes = list(program.notes)
        self._rejected: list[str] = []
        self._accepted = 0
        self._left = list(program.looks)
        self._plunger_ml = self._pressure_kpa = math.nan

    def play(self) -> PartDocument:
        """Follow the line to its end, and say what came of it."""
        self._wait(POLL_S)  # where the plunger stands comes with the telemetry
        program, from_ml = self._program, self._plunger_ml
        if program.drive == "pressure":
            started_s = go_to(self._link, program.values[0] / 1e3)
            self._follow_pressures(started_s)
        else:
            self._link.command("hold")
            self._link.expect_state("hold")
            started_s = self._link.now_s
            self._follow_volumes(started_s, from_ml)
        return PartDocument(
            key=program.key,
            from_s=started_s,
            to_s=self._link.now_s,
            plunger_from_ml=from_ml,
            looks=self._accepted,
            rejected=tuple(self._rejected),
            notes=tuple(self._notes),
        )

    def _follow_pressures(self, started_s: float) -> None:
        """The board ramps from corner to corner by itself; the host gives it rate and target."""
        times, targets = self._program.times, self._program.values / 1e3
        rate = math.nan
        if self._program.key.kind == "pull":
            self._context.observer.stage("pull the object off as soon as the pressure is there")
        for begin, end, start, target in zip(times, times[1:], targets, targets[1:], strict=False):
            self._until(started_s, float(begin))
            if start != target:
                wanted = max(abs(target - start) / (end - begin), LEAST_RATE_KPA_S)
                if not math.isclose(wanted, rate, rel_tol=1e-3):
                    rate = float(wanted)
                    self._link.write_parameter(RATE, rate)
                self._link.command("set_pressure", float(target))
        self._until(started_s, float(times[-1]))

    def _follow_volumes(self, started_s: float, from_ml: float) -> None:
        """Jogs at the slope of the line; too high a pressure ends it."""
        program, setup = self._program, self._context.request.setup
        limit_kpa = setup.actuator.limits.pressure / 1e3
        most_ml_s = Motor.of(setup.bench).flow * 1e6
        line_ml = program.values * 1e6
        moving = False
        while (time_s := self._link.now_s - started_s) < program.duration_s:
            if self._pressure_kpa > limit_kpa:
                self._notes.append(
                    f"The part {describe_part(program.key)} ended after {time_s:.1f} s: the "
                    f"pressure came to {self._pressure_kpa:.2f} kPa, above the actuator's limit "
                    f"of {limit_kpa:g} kPa."
                )
                self._link.command("jog", 0.0)
                return
            now_ml, ahead_ml = np.interp([time_s, time_s + JOG_PERIOD_S], program.times, line_ml)
            off_ml = now_ml - (self._plunger_ml - from_ml)
            # lag while speeding up is made good while braking: hardly chased while moving
            share = CORRECTED_AT_REST if ahead_ml == now_ml else CORRECTED_MOVING
            missing_ml = float(ahead_ml - now_ml + share * off_ml)
            if abs(missing_ml) > AT_REST_ML or moving:
                moving = abs(missing_ml) > AT_REST_ML
                flow = min(max(missing_ml / JOG_PERIOD_S, -most_ml_s), most_ml_s)
                self._link.command("jog", flow if moving else 0.0)
            self._until(started_s, min(time_s + JOG_PERIOD_S, program.duration_s))

    def _until(self, started_s: float, time_s: float) -> None:
        """Let bench time pass until `time_s` after the start, looking where looks are due."""
        while self._left and self._left[0] <= time_s:
            due_s = self._left.pop(0)
            self._wait(started_s + due_s - self._link.now_s)
            self._look(started_s)
        self._wait(started_s + time_s - self._link.now_s)

    def _wait(self, duration_s: float) -> None:
        if duration_s <= 1e-9:
            return
        for message in self._link.wait(duration_s):
            if message.name == "PRESSURE":
                self._plunger_ml = float(message.values["plunger_ml"])
                self._pressure_kpa = float(message.values["pressure_kpa"])

    def _look(self, started_s: float) -> None:
        assert self._meter is not None
        time_s, jpeg = self._context.bench.camera.grab()
        frame = self._accepted + len(self._rejected)
        self._record.image(time_s, jpeg, None, frame)
        sight = sighted(self._meter, jpeg)
        if sight.accepted:
            self._accepted += 1
        else:
            self._rejected.append(sight.reason)
        look = LookDocument(
            key=self._program.key,
            time_s=time_s - started_s,
            value=sight.value,
            unit=self._meter.measurand.unit,
            u=sight.u,
            accepted=sight.accepted,
            reason=sight.reason,
        )
        self._record.look(look, time_s)
