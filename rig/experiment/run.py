"""A run from greeting the board to its stop document; the same for a new and a resumed one."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from rig.control.gas_monitor import GasAlarm
from rig.experiment.bench import Bench, Fixture, Observer
from rig.experiment.context import RunContext
from rig.experiment.deformation import DeformationMeter
from rig.experiment.gas_watch import GasWatch, describe_alarm, gas_monitor
from rig.experiment.measure import DeformationMeasurement, ForceMeasurement, Measurement
from rig.experiment.plan import Sweep
from rig.experiment.plausible import ResponseCheck, require_zero
from rig.experiment.prepare import (
    condition,
    leave_home,
    make_ready,
    take_over,
    vent,
    vented_pressure_kpa,
    write_parameters,
)
from rig.experiment.recorded import RunOutcome, carry_out, explaining_disk_errors, versions
from rig.experiment.recorder import LinkRecorder
from rig.experiment.setup import RunRequest
from rig.experiment.sweep import Arrival, approach, go_to, settle
from rig.experiment.trials import run_trials
from rig.link.client import RigLink
from rig.link.schema import load_schema
from rig.record.documents import (
    ExperimentName,
    PartKey,
    PointKey,
    ResumeDocument,
    StartDocument,
)
from rig.record.writer import RunWriter
from rig.spec.physics import Liquid
from rig.spec.protocol import BlockedForceProtocol, DeformationProtocol

FIXTURES: Mapping[ExperimentName, Fixture] = {"deformation": "free", "blocked_force": "blocked"}


def new_run(
    folder: Path,
    bench: Bench,
    request: RunRequest,
    observer: Observer,
    interrupted: Callable[[], None] | None = None,
) -> RunOutcome:
    """Do the whole plan and record it in `folder`.

    A failure after the bench moved ends in a vented bench, a finished log and an outcome with the
    error; failures before that raise.
    """
    link = RigLink(bench.bus, interrupted=interrupted)
    identity = link.open()
    parameters = _configure(link, request)
    setup = request.setup
    start = StartDocument(
        actuator=setup.actuator.name,
        bench=setup.bench.name,
        board=setup.bench.board.kind,
        protocol=setup.protocol.name,
        material=setup.material.name,
        seed=request.seed,
        created=request.created,
        versions=versions(identity),
        parameters=parameters,
    )
    texts = {**setup.attachments(), **request.enclosures}
    files = {name: text.encode() for name, text in texts.items()}
    files["rig.dbc"] = load_schema().text.encode()
    context = RunContext(bench, link, request, observer)
    with (
        explaining_disk_errors(folder),
        RunWriter.create(folder, start, files, units=load_schema().units()) as record,
    ):
        return _recorded(context, record, done=())


def resume_run(
    folder: Path,
    bench: Bench,
    request: RunRequest,
    observer: Observer,
    done: Collection[PointKey],
    interrupted: Callable[[], None] | None = None,
    done_parts: Collection[PartKey] = (),
    rest_jpeg: bytes | None = None,
) -> RunOutcome:
    """Do what is left of the plan and append it to the log in `folder`; see `new_run`.

    `rest_jpeg` is the log's frame of the actuator at rest, if it has one.
    """
    # the log is locked before the bench hears anything: another process may be using both
    with (
        explaining_disk_errors(folder),
        RunWriter.resume(folder, units=load_schema().units()) as record,
    ):
        link = RigLink(bench.bus, interrupted=interrupted)
        identity = link.open()
        _configure(link, request)
        note = ResumeDocument(
            resumed_s=link.now_s,
            points_kept=len(done) + len(done_parts),
            seed=request.seed,
            versions=versions(identity),
        )
        record.resume_note(note, link.now_s)
        context = RunContext(bench, link, request, observer, rest_jpeg)
        return _recorded(context, record, done, done_parts)


def _configure(link: RigLink, request: RunRequest) -> dict[str, float]:
    take_over(link)
    return write_parameters(link, request.board_parameters())


def _recorded(
    context: RunContext,
    record: RunWriter,
    done: Collection[PointKey],
    done_parts: Collection[PartKey] = (),
) -> RunOutcome:
    request = context.request
    watch = _gas_watch(context, record)
    return carry_out(
        context.link,
        record,
        lambda recorder: _experiments(
            context, record, recorder, watch, frozenset(done), frozenset(done_parts)
        ),
        success="all that was planned was measured",
        cautions=request.cautions,
        stage=context.observer.stage,
        watch=watch,
    )


def _gas_watch(context: RunContext, record: RunWriter) -> GasWatch | None:
    """Warns of leaks, in the log and to whoever watches; none where there is no gas to follow."""
    if isinstance(context.request.setup.bench.fluid, Liquid):
        return None

    def warn(time_s: float, alarm: GasAlarm) -> None:
        text = describe_alarm(time_s, alarm)
        record.event(time_s, alarm.kind, {"what": text}, "warning")
        context.observer.warned(text)

    return GasWatch(
        make_monitor=lambda: gas_monitor(context.request),
        warn=warn,
        note=lambda document: record.gas(document, document.to_s),
    )


def _experiments(
    context: RunContext,
    record: RunWriter,
    recorder: LinkRecorder,
    watch: GasWatch | None,
    done: frozenset[PointKey],
    done_parts: frozenset[PartKey],
) -> None:
    """Every sweep and trial that still has points or parts to take."""
    link, observer = context.link, context.observer
    sweeps = context.request.plan.sweeps
    observer.began(context.request.plan, context.request.trials, len(done) + len(done_parts))
    mounted: ExperimentName | None = None
    observer.stage("homing the plunger and zeroing the transducer")
    make_ready(link)
    meter: DeformationMeter | None = None
    if _needs_camera(context, done, done_parts):
        meter = context.ready_meter(record)
    for sweep in sweeps:
        left = [key for key in sweep.keys if key not in done]
        if not left:
            continue
        if sweep.experiment != mounted:
            mounted = sweep.experiment
            context.mount(FIXTURES[mounted])
            if watch is not None:
                watch.renew()
            observer.stage("conditioning the actuator")
            condition(link, context.request.plan.settings(mounted))
        _sweep(context, record, recorder, sweep, left, meter)
    run_trials(context, record, recorder, watch, done_parts, meter)


def _sweep(
    context: RunContext,
    record: RunWriter,
    recorder: LinkRecorder,
    sweep: Sweep,
    left: list[PointKey],
    meter: DeformationMeter | None,
) -> None:
    """One repeat: from the vented state through its pressures, and vented again."""
    link, observer = context.link, context.observer
    section = context.request.plan.settings(sweep.experiment)
    measure = _measurement(context, sweep.experiment, meter)
    observer.stage(f"resting vented before repeat {sweep.repeat}")
    link.wait(section.rest)
    leave_home(link)
    approach(link, left[0], section)
    response = ResponseCheck((section.pressures.stop - section.pressures.start) / 1e3)
    for key in left:
        observer.point_began(key)
        record.event(link.now_s, "point", key.model_dump())
        started_s = go_to(link, key.target_kpa)
        settled_s = settle(link, key.target_kpa, section.settling)
        link.wait(section.hold)
        arrival = Arrival(
            key,
            started_s,
            settled_s,
            section.settling.tolerance / 1e3,
            context.request.setup.calibrations.transducer,
        )
        point = measure(link, record, arrival)
        recorder.flush()
        record.point(point, link.now_s)
        observer.point_done(point)
        response.add(point)
    vent(link)
    require_zero(vented_pressure_kpa(link), section.settling.tolerance / 1e3)


def _needs_camera(
    context: RunContext, done: Collection[PointKey], done_parts: Collection[PartKey]
) -> bool:
    """Whether what is left asks for a deformation."""
    request = context.request
    return any(
        key.experiment == "deformation" and key not in done
        for sweep in request.plan.sweeps
        for key in sweep.keys
    ) or any(
        program.looks and program.key not in done_parts
        for plan in request.trials
        for program in plan.programs
    )


def _measurement(
    context: RunContext, experiment: ExperimentName, meter: DeformationMeter | None
) -> Measurement:
    setup, section = context.request.setup, context.request.plan.settings(experiment)
    calibrations = setup.calibrations
    if isinstance(section, DeformationProtocol):
        assert meter is not None  # there is something for it
        return DeformationMeasurement(
            camera=context.bench.camera,
            meter=meter,
            frames=section.frames,
            frame_period_s=1 / setup.bench.camera.frame_rate,
        )
    assert isinstance(section, BlockedForceProtocol)
    return ForceMeasurement(
        calibration=calibrations.load_cell,
        readings=section.readings,
        reading_period_s=1 / setup.bench.load_cell.sample_rate,
        schema=load_schema(),
    )
