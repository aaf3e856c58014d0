"""The report as one HTML page: everything the template shows, made ready here."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources

from jinja2 import Environment, FunctionLoader, StrictUndefined

import rig
from rig.mechanics.response import Response
from rig.record.documents import ExperimentName
from rig.record.reader import Event
from rig.report.data import RunData
from rig.report.figures import (
    ExperimentFigures,
    experiment_figures,
    step_figure,
    trace_figure,
)
from rig.report.pictures import overlay_pictures
from rig.report.sheet_parts import Section as TrialSection
from rig.report.strength import StrengthSection
from rig.report.summary import (
    ControllerSummary,
    ExperimentSummary,
    ModelSummary,
    RunSummary,
    StepSummary,
)
from rig.report.words import (
    count,
    decimals_for,
    duration,
    freedom,
    model_name,
    number,
    significant,
    uncertain,
)

TITLES: dict[ExperimentName, str] = {
    "deformation": "Deformation",
    "blocked_force": "Blocked force",
}


def _template(name: str) -> str | None:
    """Text of a template that ships inside the package, however that is installed."""
    file = resources.files("rig.report") / "templates" / name
    return file.read_text(encoding="utf-8") if file.is_file() else None


def environment() -> Environment:
    """Templates with the report's way of writing numbers; an unknown name is an error."""
    made = Environment(
        loader=FunctionLoader(_template),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "number": number,
        "significant": significant,
        "freedom": freedom,
        "duration": duration,
        "count": count,
        "model": model_name,
    }
    made.globals |= {"uncertain": uncertain, "rig_version": rig.__version__}
    return made


@dataclass(frozen=True)
class Verdict:
    """A card: one model's error in one experiment, beside the papers'."""

    title: str
    result: str
    percent: str
    lines: tuple[str, ...]
    agrees: bool
    references: tuple[str, ...]
    note: str


@dataclass(frozen=True)
class Section:
    """One experiment of the report."""

    name: ExperimentName
    title: str
    summary: ExperimentSummary
    figures: ExperimentFigures | None
    decimals: int
    """That show every mean's uncertainty with two digits."""
    steps: tuple[StepRow, ...]


@dataclass(frozen=True)
class StepRow:
    """The pressure loop at one target over all repeats; the worst of each."""

    direction: str
    target_kpa: float
    count: int
    settling_s: float | None
    overshoot_kpa: float
    steady_error_kpa: float
    noise_kpa: float


@dataclass(frozen=True)
class AttachedFile:
    """A file that travelled with the run."""

    name: str
    size: int
    sha256: str
    text: str | None


def render_report(
    data: RunData,
    summary: RunSummary,
    predictions: Mapping[str, Response],
    strength: StrengthSection | None = None,
    trials: Sequence[TrialSection] = (),
) -> str:
    """HTML text of the report; the same run gives the same bytes."""
    sections = [
        Section(
            name=name,
            title=TITLES[name],
            summary=experiment,
            figures=experiment_figures(name, data, experiment, predictions)
            if experiment.points
            else None,
            decimals=decimals_for(min((p.u95 for p in experiment.points), default=0.0)),
            steps=_step_rows(experiment.controller),
        )
        for name, experiment in summary.experiments.items()
    ]
    first = sections[0].summary if sections else None
    done = [(e.measured, e.planned) for e in summary.experiments.values()]
    done += [(t.measured, t.planned) for t in summary.trials.values()]
    template = environment().get_template("report.html.j2")
    return template.render(
        summary=summary,
        headline=headline(summary),
        verdicts=[
            verdict
            for name, experiment in summary.experiments.items()
            for verdict in _verdicts(name, experiment)
        ],
        citations=_citations(summary),
        sections=sections,
        measured=sum(measured for measured, _ in done),
        planned=sum(planned for _, planned in done),
        trials=trials,
        trace=trace_figure(data) if data.trace.time_s.size else None,
        step=step_figure(data, first),
        strength=strength,
        pictures=overlay_pictures(data),
        warnings=_warnings(data),
        parameters=sorted(data.reader.start().parameters.items()),
        setup=data.setup,
        files=_files(data),
    )


def render_strength(strength: StrengthSection, title: str) -> str:
    """HTML text of a page with the 3D view and the safety factors alone."""
    return environment().get_template("view3d_page.html.j2").render(strength=strength, title=title)


DOES = {"deg": "bends", "mm": "lengthens"}
"""What an actuator does whose deformation has that unit."""


def headline(summary: RunSummary) -> tuple[str, ...]:
    """The run in a sentence or two, with its numbers."""
    at_top: dict[float, list[str]] = {}
    for name, experiment in summary.experiments.items():
        up = [level for level in experiment.points if level.direction == "up"]
        if up:
            top = max(up, key=lambda level: level.pressure_kpa)
            value = uncertain(top.mean, top.u95, experiment.unit)
            does = (
                f"{DOES[experiment.unit]} by {value}"
                if name == "deformation"
                else f"presses with {value} when blocked"
            )
            at_top.setdefault(top.pressure_kpa, []).append(does)
    sentences = [
        f"At {kpa:g} kPa {summary.actuator} {' and '.join(does)}." for kpa, does in at_top.items()
    ]
    errors: dict[str, list[str]] = {}
    for experiment in summary.experiments.values():
        for model, result in experiment.models.items():
            share = f", {significant(result.nrmse.value, 2)} % of its range" if result.nrmse else ""
            rms = uncertain(result.rmse.value, result.rmse.u95, result.rmse.unit)
            errors.setdefault(model, []).append(f"the {experiment.quantity} by {rms} RMS{share}")
    for model, misses in errors.items():
        theory = model_name(model)
        sentences.append(f"{theory[0].upper()}{theory[1:]} misses {'; '.join(misses)}.")
    sentences += [
        f"The trial {name}: {trial.measured} of {trial.planned} parts done."
        for name, trial in summary.trials.items()
    ]
    return tuple(sentences) or ("No point was measured.",)


def _verdicts(name: ExperimentName, experiment: ExperimentSummary) -> list[Verdict]:
    models = dict(experiment.models)
    cards = [_verdict(name, experiment, model, result) for model, result in models.items()]
    others = sorted({v.model for r in experiment.references for v in r.values} - models.keys())
    return cards + [
        Verdict(
            title=f"{TITLES[name]}, {model_name(model)}",
            result="",
            percent="",
            lines=("not predicted in this run" if experiment.points else "nothing was measured",),
            agrees=False,
            references=_reference_lines(experiment, model),
            note=_note(experiment, model),
        )
        for model in others
    ]


def _verdict(
    name: ExperimentName, experiment: ExperimentSummary, model: str, result: ModelSummary
) -> Verdict:
    bias, largest, unit = result.bias, result.max_error, experiment.unit
    side = "above" if bias.value > 0 else "below"
    return Verdict(
        title=f"{TITLES[name]}, {model_name(model)}",
        result=uncertain(result.rmse.value, result.rmse.u95, unit),
        percent=f"{significant(result.nrmse.value, 2)} % of the range" if result.nrmse else "",
        lines=(
            f"mean {uncertain(abs(bias.value), bias.u95, unit)} {side} the experiment",
            f"at most {uncertain(largest.value, largest.u95, unit)}, at "
            f"{largest.pressure_kpa:g} kPa",
        ),
        agrees=result.validation.agrees,
        references=_reference_lines(experiment, model),
        note=_note(experiment, model),
    )


def _reference_lines(experiment: ExperimentSummary, model: str) -> tuple[str, ...]:
    return tuple(
        f"{value.value:.2f} {value.unit} ({value.where})"
        for reference in experiment.references
        for value in reference.values
        if value.model == model
    )


def _note(experiment: ExperimentSummary, model: str) -> str:
    """What to know about the papers' figures: only where one gives two for the same thing."""
    for reference in experiment.references:
        figures = {value.value for value in reference.values if value.model == model}
        if len(figures) > 1:
            return "the paper contradicts itself"
    return ""


def _citations(summary: RunSummary) -> list[tuple[str, str]]:
    """Each paper once, with what to know about its figures."""
    found = [
        (reference.citation, reference.note)
        for experiment in summary.experiments.values()
        for reference in experiment.references
    ]
    return list(dict.fromkeys(found))


def _step_rows(controller: ControllerSummary | None) -> tuple[StepRow, ...]:
    if controller is None:
        return ()
    groups: dict[tuple[str, float], list[StepSummary]] = {}
    for step in controller.steps:
        groups.setdefault((step.direction, step.target_kpa), []).append(step)
    rows = []
    for (direction, target), steps in sorted(
        groups.items(), key=lambda item: (item[0][0] != "up", item[0][1])
    ):
        settling = [s.settling_time_s for s in steps]
        known = [s for s in settling if s is not None]
        rows.append(
            StepRow(
                direction=direction,
                target_kpa=target,
                count=len(steps),
                settling_s=max(known) if len(known) == len(settling) else None,
                overshoot_kpa=max(s.overshoot_kpa for s in steps),
                steady_error_kpa=max((s.steady_error_kpa for s in steps), key=abs),
                noise_kpa=max(s.noise_kpa for s in steps),
            )
        )
    return tuple(rows)


def _warnings(data: RunData) -> list[Event]:
    return [event for event in data.reader.events() if event.level in ("warning", "error")]


def _files(data: RunData) -> list[AttachedFile]:
    return [
        AttachedFile(
            name=name,
            size=len(content),
            sha256=hashlib.sha256(content).hexdigest(),
            text=content.decode() if name.endswith(".yaml") else None,
        )
        for name, content in sorted(data.reader.attachments().items())
    ]
