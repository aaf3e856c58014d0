"""Which charts a run's report shows, made from its summary and traces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.response import Response
from rig.record.documents import ExperimentName, PointDocument
from rig.report import charts
from rig.report.analysis import predicted_value
from rig.report.charts import Branch, Chart, Line, Residuals
from rig.report.data import RunData, by_level
from rig.report.summary import ExperimentSummary
from rig.report.words import model_name, significant, uncertain

Array = NDArray[np.float64]
STEP_BEFORE_S = 1.0
STEP_AFTER_S = 12.0


@dataclass(frozen=True)
class ExperimentFigures:
    """Charts of one experiment."""

    response: Chart
    residuals: Chart | None
    repeats: Chart | None


def experiment_figures(
    name: ExperimentName,
    data: RunData,
    summary: ExperimentSummary,
    predictions: Mapping[str, Response],
) -> ExperimentFigures:
    """Charts of an experiment that has at least one measured level."""
    return ExperimentFigures(
        response=_response(name, data, summary, predictions),
        residuals=_residuals(name, summary),
        repeats=_repeats(name, data, summary),
    )


def trace_figure(data: RunData) -> Chart:
    """The pressure of the whole run."""
    return charts.trace_chart(
        "trace",
        data.trace,
        f"Measured pressure and set-point over {data.trace.time_s.size} samples of the run: "
        f"staircases from 0 to {data.highest_kpa:.3g} kPa, one for each repeat.",
    )


def step_figure(data: RunData, summary: ExperimentSummary | None) -> Chart | None:
    """One step in the middle of the first sweep; None if there is no trace of one."""
    point = _middle_step(data)
    if point is None or summary is None or summary.controller is None:
        return None
    end_s = min(point.started_s + STEP_AFTER_S, point.measured_to_s)
    trace = data.trace.between(point.started_s - STEP_BEFORE_S, end_s)
    if trace.time_s.size < 2:
        return None
    key = point.key
    metrics = next(
        (
            step
            for step in summary.controller.steps
            if (step.repeat, step.direction, step.target_kpa)
            == (key.repeat, key.direction, key.target_kpa)
        ),
        None,
    )
    settling_s = metrics.settling_time_s if metrics is not None else None
    settled = f"settled after {settling_s:.2f} s" if settling_s is not None else "not settled"
    return charts.step_chart(
        "step",
        trace,
        point.started_s,
        key.target_kpa,
        summary.controller.tolerance_kpa,
        settling_s,
        f"Pressure during the step to {key.target_kpa:g} kPa of repeat {key.repeat}, {settled}.",
    )


def _middle_step(data: RunData) -> PointDocument | None:
    steps = [
        p
        for p in data.points
        if p.key.experiment == data.points[0].key.experiment
        and p.key.repeat == 1
        and p.key.direction == "up"
        and p.key.target_kpa > 0
    ]
    return steps[len(steps) // 2] if steps else None


def branch_of(summary: ExperimentSummary, direction: str, label: str) -> Branch:
    """Means of one branch for a chart."""
    levels = [level for level in summary.points if level.direction == direction]
    return Branch(
        label,
        np.array([level.measured_pressure_kpa for level in levels]),
        np.array([level.mean for level in levels]),
        np.array([level.u95 for level in levels]),
    )


def _response(
    name: ExperimentName,
    data: RunData,
    summary: ExperimentSummary,
    predictions: Mapping[str, Response],
) -> Chart:
    branches = [branch_of(summary, "up", "ascending, mean and 95 %")]
    down = branch_of(summary, "down", "descending")
    if down.pressure_kpa.size:
        branches.append(down)
    points = [p for p in data.points_of(name) if p.value is not None]
    repeats = (
        np.array([p.pressure_kpa for p in points]),
        np.array([p.value for p in points], dtype=np.float64),
    )
    lines = []
    for model, response in predictions.items():
        value = predicted_value(response, name)
        if value is not None:
            inside = response.pressure <= data.highest_kpa * 1e3 * (1 + 1e-9)
            kpa = response.pressure[inside] / 1e3
            lines.append(Line(model_name(model), kpa, value[inside]))
    up = branches[0]
    top = (
        f"{uncertain(float(up.mean[-1]), float(up.u95[-1]))} {summary.unit} at "
        f"{up.pressure_kpa[-1]:.3g} kPa"
        if up.mean.size
        else "nothing on the ascending branch"
    )
    return charts.response_chart(
        f"{name}-response",
        f"{summary.quantity} ({summary.unit})",
        branches,
        repeats,
        lines,
        f"{summary.quantity.capitalize()} against pressure: experiment, {top}, with "
        + (", ".join(line.label for line in lines) or "no model")
        + " for comparison.",
    )


def _residuals(name: ExperimentName, summary: ExperimentSummary) -> Chart | None:
    if not summary.models:
        return None
    residuals = [
        Residuals(
            model_name(model),
            np.array([e.pressure_kpa for e in result.errors]),
            np.array([e.error for e in result.errors]),
            np.array([result.validation.coverage * e.u_validation for e in result.errors]),
        )
        for model, result in summary.models.items()
    ]
    worst = ", ".join(
        f"{model_name(model)} up to {significant(result.max_error.value)} {summary.unit} at "
        f"{result.max_error.pressure_kpa:g} kPa"
        for model, result in summary.models.items()
    )
    return charts.residual_chart(
        f"{name}-residuals",
        f"model minus experiment ({summary.unit})",
        residuals,
        f"Model minus experiment of the {summary.quantity} against pressure: {worst}.",
    )


def _repeats(name: ExperimentName, data: RunData, summary: ExperimentSummary) -> Chart | None:
    if summary.repeatability is None:
        return None
    deviations: dict[int, list[tuple[float, float]]] = {}
    for (direction, kpa), group in by_level(data.points_of(name)).items():
        values = np.array([p.value for p in group], dtype=np.float64)
        if direction != "up" or values.size < 2:
            continue
        for point, deviation in zip(group, values - values.mean(), strict=True):
            deviations.setdefault(point.key.repeat, []).append((kpa, float(deviation)))
    if not deviations:
        return None
    return charts.repeats_chart(
        f"{name}-repeats",
        f"deviation from the mean ({summary.unit})",
        {
            repeat: (np.array([x for x, _ in pairs]), np.array([y for _, y in pairs]))
            for repeat, pairs in sorted(deviations.items())
        },
        summary.repeatability.sd,
        f"Deviation of each repeat's {summary.quantity} from the mean at its pressure; digits are "
        f"repeats, dashed lines one repeatability standard deviation, "
        f"{significant(summary.repeatability.sd)} {summary.unit}.",
    )
