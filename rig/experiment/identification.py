"""Identification of the pressure system: excitations at several pressures, recorded like any run.

At each level the loop brings the pressure there and lets go; then the plunger moves as the
excitations say, by jogs in the state `hold`, where the firmware's safety chain stands.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from rig.control.excitation import (
    Segment,
    Stroke,
    duration_s,
    fastest_stroke,
    pseudo_random,
    ramp,
    step,
)
from rig.control.family import Estimate, Family, IdentifiedLevel, PhysicsCheck, RelayCheck
from rig.control.identify import (
    Fit,
    LevelModel,
    Recording,
    fit_percent,
    identify_level,
    predict,
)
from rig.control.loop import KNOWN_DELAY_S
from rig.control.physics import ADIABATIC_EXPONENT, GasColumn
from rig.control.relay import FrequencyPoint, relay_point
from rig.experiment.bench import Bench
from rig.experiment.errors import ExperimentError, LimitError
from rig.experiment.prepare import (
    leave_home,
    make_ready,
    parameters_for,
    take_over,
    vent,
    write_parameters,
)
from rig.experiment.recorded import RunOutcome, carry_out, explaining_disk_errors, versions
from rig.experiment.recorder import LinkRecorder
from rig.experiment.sweep import go_to, settle
from rig.link.client import RigLink
from rig.link.schema import load_schema
from rig.mechanics import model as mechanics
from rig.mechanics.response import interpolated
from rig.record.documents import StartDocument
from rig.record.reader import RunReader
from rig.record.writer import RunWriter
from rig.spec.physics import Liquid
from rig.spec.protocol import Settling
from rig.spec.workspace import Setup

PLAN_FILE = "identification-plan.json"
BEGAN, ENDED = "excitation began", "excitation ended"
SETTLING = Settling(tolerance=50.0, window=1.0, timeout=60.0)
JOG_REPEAT_S = 0.3
"""A jog ends by itself after half a second."""
SAMPLE_S = 0.02
STEP_REST_S = 3.0
RAMP_SLOWNESS = 10.0
CUSHION_S = 0.04
"""In which a stroke may compress the air in a liquid by the amplitude: about an eighth of the swing
of what is in the tube (a guess)."""
BELLOW_SOFTNESS = 0.02
"""Growth of a bellow's cavity for each kPa (a guess, as of `ActuatorVolume.of_cavity`)."""
RELAY_HYSTERESIS = 0.25
"""Of the amplitude: the relay must not chatter on noise."""
RELAY_S = 6.0
FIT_KINDS = ("step", "ramp", "pseudo-random")
"""What models are fitted to; the relay is kept to judge them."""


@dataclass(frozen=True)
class IdentificationPlan:
    """Which levels, and how hard they are shaken."""

    levels_kpa: tuple[float, ...]
    amplitude_kpa: float = 0.5
    """Roughly how far the pseudo-random excitation moves the pressure."""
    bits: int = 7
    rest_s: float = 10.0
    """At each level before it is shaken: creep must have slowed down."""
    seed: int = 1


@dataclass(frozen=True)
class LoopRequest:
    """A set-up on which the pressure loop is studied."""

    setup: Setup
    seed: int
    cavity_volume: float
    """Of the undeformed actuator in m3."""
    created: str | None = None
    """ISO date and time on a real bench; None in simulated time."""

    def board_parameters(self) -> dict[str, float]:
        """What the board is told before it moves; raises LimitError for what it would refuse."""
        return parameters_for(self.setup, self.cavity_volume)


@dataclass(frozen=True)
class Excited:
    """One recorded excitation."""

    level_kpa: float
    """Set-point before it."""
    kind: str
    recording: Recording


def stroke_for(plan: IdentificationPlan, request: LoopRequest) -> Stroke:
    """The plunger's stroke: what changes the pressure by about the amplitude.

    Gas is compressed as a whole. A liquid fills the actuator, slowly: at first it compresses only
    the air in it, and a quick stroke would raise a swing far larger than the amplitude.
    """
    parameters = request.board_parameters()
    softness = parameters["system_volume_ml"] / parameters["ambient_pressure_kpa"]
    flow, acceleration = parameters["max_flow_ml_s"], parameters["max_flow_acceleration_ml_s2"]
    fluid = request.setup.bench.fluid
    if isinstance(fluid, Liquid):
        cushion = fluid.entrained_air * softness
        flow = min(flow, plan.amplitude_kpa * cushion / CUSHION_S)
        softness = cushion + BELLOW_SOFTNESS * request.cavity_volume * 1e6
    return fastest_stroke(plan.amplitude_kpa * softness, flow, acceleration)


def excitations(plan: IdentificationPlan, stroke: Stroke) -> dict[str, list[Segment]]:
    """The open-loop excitations of one level by name, in their order."""
    return {
        "step": step(stroke, STEP_REST_S),
        "ramp": ramp(stroke, RAMP_SLOWNESS, STEP_REST_S),
        "pseudo-random": pseudo_random(stroke, plan.bits, plan.seed),
    }


def expected_duration_s(plan: IdentificationPlan, request: LoopRequest) -> float:
    """Bench time of the whole plan, roughly."""
    shaking = sum(duration_s(one) for one in excitations(plan, stroke_for(plan, request)).values())
    return 20.0 + len(plan.levels_kpa) * (5.0 + plan.rest_s + shaking + RELAY_S)


def require_within_limits(plan: IdentificationPlan, setup: Setup) -> None:
    """Raise LimitError, before anything moves, for a level that the excitation would overshoot."""
    if not plan.levels_kpa or min(plan.levels_kpa) < plan.amplitude_kpa:
        raise LimitError(
            f"levels of {', '.join(f'{p:g}' for p in plan.levels_kpa) or 'nothing'} kPa cannot be "
            f"identified with an amplitude of {plan.amplitude_kpa:g} kPa; expected levels above "
            "the amplitude. Nothing was moved."
        )
    highest = max(plan.levels_kpa) + 2.5 * plan.amplitude_kpa
    limits = {
        f"limits.pressure of the actuator '{setup.actuator.name}'": setup.actuator.limits.pressure,
        f"safety.pressure of the bench '{setup.bench.name}'": setup.bench.safety.pressure,
    }
    for what, limit in limits.items():
        if highest > limit / 1e3:
            raise LimitError(
                f"the highest level with its excitation reaches {highest:g} kPa, above "
                f"{limit / 1e3:g} kPa, {what}. Nothing was moved. Choose a lower level or a "
                "smaller amplitude."
            )


def record_identification(
    folder: Path,
    bench: Bench,
    request: LoopRequest,
    plan: IdentificationPlan,
    stage: Callable[[str], None],
    interrupted: Callable[[], None] | None = None,
) -> RunOutcome:
    """Shake the pressure system at every level and record it in `folder`.

    Raises what goes wrong before the bench moved; later failures are in the outcome.
    """
    require_within_limits(plan, request.setup)
    stroke = stroke_for(plan, request)

    def work(link: RigLink, record: RunWriter, recorder: LinkRecorder) -> None:
        stage("homing the plunger and zeroing the transducer")
        bench.mount("free")
        make_ready(link)
        leave_home(link)
        for level_kpa in plan.levels_kpa:
            stage(f"identifying at {level_kpa:g} kPa")
            _identify_level(link, record, plan, stroke, level_kpa)
            recorder.flush()
        vent(link)

    return record_work(
        folder,
        bench,
        request,
        {PLAN_FILE: json.dumps(asdict(plan), indent=2)},
        "identification",
        work,
        stage,
        interrupted,
    )


def record_work(
    folder: Path,
    bench: Bench,
    request: LoopRequest,
    enclosures: Mapping[str, str],
    name: str,
    work: Callable[[RigLink, RunWriter, LinkRecorder], None],
    stage: Callable[[str], None],
    interrupted: Callable[[], None] | None,
) -> RunOutcome:
    """Greet the board, write its parameters, and do `work` on record in a new run folder.

    `name` stands in the start document where a characterisation names its protocol.
    """
    link = RigLink(bench.bus, interrupted=interrupted)
    identity = link.open()
    take_over(link)
    parameters = write_parameters(link, request.board_parameters())
    setup = request.setup
    start = StartDocument(
        actuator=setup.actuator.name,
        bench=setup.bench.name,
        board=setup.bench.board.kind,
        protocol=name,
        material=setup.material.name,
        seed=request.seed,
        created=request.created,
        versions=versions(identity),
        parameters=parameters,
    )
    texts = {**setup.attachments(), **enclosures, "rig.dbc": load_schema().text}
    files = {file: text.encode() for file, text in texts.items()}
    with (
        explaining_disk_errors(folder),
        RunWriter.create(folder, start, files, units=load_schema().units()) as record,
    ):
        return carry_out(
            link,
            record,
            lambda recorder: work(link, record, recorder),
            success=f"the {name} was done",
            stage=stage,
        )


def _identify_level(
    link: RigLink, record: RunWriter, plan: IdentificationPlan, stroke: Stroke, level_kpa: float
) -> None:
    go_to(link, level_kpa)
    settle(link, level_kpa, SETTLING)
    link.wait(plan.rest_s)
    link.expect_state(None)
    link.command("hold")
    link.await_state("hold", 1.0)
    link.expect_state("hold")
    for kind, segments in excitations(plan, stroke).items():
        note = {"kind": kind, "level_kpa": level_kpa}
        record.event(link.now_s, BEGAN, note)
        play_out(link, segments)
        record.event(link.now_s, ENDED, note)
    note = {"kind": "relay", "level_kpa": level_kpa}
    record.event(link.now_s, BEGAN, note)
    _relay(link, level_kpa, stroke, RELAY_HYSTERESIS * plan.amplitude_kpa)
    record.event(link.now_s, ENDED, note)
    link.expect_state(None)


def play_out(link: RigLink, segments: Sequence[Segment]) -> None:
    """Move the plunger as the segments say; the valve must be closed or the plunger free."""
    end_s = link.now_s
    for segment in segments:
        end_s += segment.duration_s
        while (left_s := end_s - link.now_s) > 1e-9:
            link.post("jog", segment.flow_ml_s)
            link.wait(min(JOG_REPEAT_S, left_s))


def _relay(link: RigLink, level_kpa: float, stroke: Stroke, hysteresis_kpa: float) -> None:
    """Full flow in below the level, full flow out above it."""
    end_s = link.now_s + RELAY_S
    flow = stroke.flow_ml_s
    while link.now_s < end_s:
        for message in link.receive(SAMPLE_S):
            if message.name != "PRESSURE":
                continue
            error = level_kpa - float(message.values["pressure_kpa"])
            if abs(error) > hysteresis_kpa:
                flow = stroke.flow_ml_s if error > 0 else -stroke.flow_ml_s
        link.post("jog", flow)
    link.post("jog", 0.0)


def read_excitations(reader: RunReader) -> list[Excited]:
    """The excitations that a run recorded, in their order; raises ExperimentError if none."""
    telemetry = reader.telemetry("PRESSURE")
    found: list[Excited] = []
    began_s = float("nan")
    for event in reader.events():
        if event.name == BEGAN:
            began_s = event.time_s
        elif event.name == ENDED:
            inside = (telemetry["time_s"] >= began_s) & (telemetry["time_s"] <= event.time_s)
            time_s, first = np.unique(telemetry["time_s"][inside], return_index=True)
            recording = Recording(
                time_s,
                telemetry["plunger_ml"][inside][first],
                telemetry["pressure_kpa"][inside][first],
            )
            found.append(
                Excited(float(event.data["level_kpa"]), str(event.data["kind"]), recording)
            )
    if not found:
        raise ExperimentError(
            f"{reader.path}: the run holds no excitation; `rig identify` records such runs."
        )
    return found


def joined(excited: Sequence[Excited]) -> Recording:
    """Several excitations that followed each other without a gap, as one recording."""
    parts = [one.recording for one in excited]
    time_s = np.concatenate([part.time_s for part in parts])
    _, first = np.unique(time_s, return_index=True)
    return Recording(
        time_s[first],
        np.concatenate([part.plunger_ml for part in parts])[first],
        np.concatenate([part.pressure_kpa for part in parts])[first],
    )


@dataclass(frozen=True)
class Analysis:
    """What a recorded identification says: the family and the fits behind it."""

    family: Family
    fits: tuple[Fit, ...]
    relays: tuple[Recording, ...]
    """The recordings that the models are judged by, one for each level."""


def analyse_identification(reader: RunReader) -> Analysis:
    """Fit a model to every level of a recorded identification.

    Raises ExperimentError if the run holds no excitations, ControlError if one says nothing.
    """
    start, setup = reader.start(), reader.setup()
    by_level: dict[float, list[Excited]] = {}
    for one in read_excitations(reader):
        by_level.setdefault(one.level_kpa, []).append(one)
    compliance = predicted_compliance(setup, tuple(by_level))
    liquid = setup.bench.fluid if isinstance(setup.bench.fluid, Liquid) else None
    fits, relays, levels = [], [], []
    for setpoint_kpa, excited in sorted(by_level.items()):
        shaken = joined([one for one in excited if one.kind in FIT_KINDS])
        fit = identify_level(shaken, KNOWN_DELAY_S, modes=1 if liquid else 0)
        relay = joined([one for one in excited if one.kind == "relay"])
        point = relay_point(relay, fit.model.backlash_ml)
        column = GasColumn(
            fit.model.level_kpa,
            start.parameters["ambient_pressure_kpa"],
            _gas_volume_ml(fit.model, start.parameters, liquid),
            compliance.get(setpoint_kpa, 0.0),
            exponent_quick=1.0 if liquid else ADIABATIC_EXPONENT,
        )
        fits.append(fit)
        relays.append(relay)
        levels.append(
            _level(setpoint_kpa, fit, relay, point, column, known=setpoint_kpa in compliance)
        )
    family = Family(
        actuator=start.actuator,
        bench=start.bench,
        board=start.board,
        fluid="liquid" if liquid else "gas",
        seed=start.seed,
        created=start.created,
        versions=start.versions,
        parameters=start.parameters,
        levels=tuple(levels),
    )
    return Analysis(family, tuple(fits), tuple(relays))


def _gas_volume_ml(
    model: LevelModel, parameters: Mapping[str, float], liquid: Liquid | None
) -> float:
    """Gas in syringe, tube and actuator at the model's pressure; of a liquid its bubbles."""
    room_ml = parameters["system_volume_ml"]
    if liquid is None:
        return room_ml - model.plunger_ml
    ambient = parameters["ambient_pressure_kpa"]
    return liquid.entrained_air * room_ml * ambient / (ambient + model.level_kpa)


def predicted_compliance(setup: Setup, levels_kpa: Sequence[float]) -> dict[float, float]:
    """dV/dp of the actuator's cavity in mL/kPa at each level, from beam theory.

    Empty for a family that beam theory does not cover.
    """
    if "beam" not in mechanics.available_models(setup.actuator.geometry.family):
        return {}
    pressure = np.linspace(0.0, max(levels_kpa) * 1e3, 41)
    volume = mechanics.predict(setup.actuator, setup.material, "beam", pressure).volume
    slope = np.gradient(volume, pressure) * 1e9
    at = np.asarray(levels_kpa) * 1e3
    return dict(zip(levels_kpa, interpolated(pressure, slope, at).tolist(), strict=True))


def _level(
    setpoint_kpa: float,
    fit: Fit,
    relay: Recording,
    point: FrequencyPoint,
    column: GasColumn,
    *,
    known: bool,
) -> IdentifiedLevel:
    model = fit.model
    (modelled,) = model.response(np.array([point.omega]))
    terms = len(model.gains)
    static = slice(2, 3 + terms)
    unseen = relay.pressure_kpa - predict(fit, relay)
    return IdentifiedLevel(
        setpoint_kpa=setpoint_kpa,
        **asdict(model),
        estimates={
            p.name: Estimate(value=p.value, deviation=p.deviation, unit=p.unit)
            for p in fit.parameters
        },
        covariance=tuple(tuple(row) for row in fit.covariance.tolist()),
        samples=fit.time_s.size,
        noise_kpa=fit.residual_deviation_kpa,
        fit_percent=fit.fit_percent,
        whiteness_p=fit.whiteness_p,
        criteria=fit.alternatives,
        relay=RelayCheck(
            omega=point.omega,
            magnitude=abs(point.response),
            deviation=point.deviation,
            phase_deg=float(np.angle(point.response, deg=True)),
            model_magnitude=float(abs(modelled)),
            model_phase_deg=float(np.angle(modelled, deg=True)),
            fit_percent=fit_percent(unseen, relay.pressure_kpa),
        ),
        physics=PhysicsCheck(
            gas_volume_ml=column.volume_ml,
            compliance_ml_kpa=column.compliance_ml_kpa if known else None,
            isothermal=column.isothermal,
            adiabatic=column.quick,
            identified_slow=model.static_gain,
            identified_slow_deviation=float(np.sqrt(fit.covariance[static, static].sum())),
            identified_quick=float(abs(modelled)),
            known_delay_s=KNOWN_DELAY_S,
        ),
    )
