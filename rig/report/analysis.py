"""From a run's points and the models' predictions to its summary."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig.control.errors import ControlError
from rig.control.step import StepMetrics, step_metrics
from rig.mechanics.response import Response
from rig.record.documents import ExitStatus, ExperimentName, PointDocument
from rig.record.reader import RunReader
from rig.report.data import EXPERIMENTS, RunData, by_level, load_run, planned_points
from rig.report.inputs import input_uncertainty
from rig.report.levels import (
    Level,
    calibration_components,
    levels_of,
    nearest_scatter,
    repeats_component,
)
from rig.report.summary import (
    BudgetLine,
    BudgetSummary,
    ControllerSummary,
    ExperimentSummary,
    HysteresisSummary,
    LevelError,
    LevelSummary,
    MaximumError,
    ModelSummary,
    Quantity,
    Reference,
    ReferenceValue,
    RepeatabilitySummary,
    ResumeSummary,
    RunSummary,
    StepSummary,
    ValidationSummary,
)
from rig.spec.measurand import MEASURANDS
from rig.spec.published import PublishedReference
from rig.spec.quantity import STANDARD_GRAVITY
from rig.validate.metrics import (
    ComparisonErrors,
    ValidationStatement,
    bias,
    hysteresis,
    maximum_error,
    normalised,
    repeatability,
    rmse,
    same_variance,
    validation_statement,
)
from rig.validate.uncertainty import Component, Estimate, combine, coverage_factor

Array = NDArray[np.float64]
PRESSURE_NOISE_KPA = 0.03
"""A mean pressure may lie this far beyond where a model ends and still be compared with it."""


def build_summary(
    reader: RunReader,
    predictions: Mapping[str, Response],
    references: Sequence[PublishedReference] = (),
    notes: Sequence[str] = (),
) -> RunSummary:
    """Summarise a run.

    `predictions` are the models' responses over at least the pressures measured; `references` are
    published figures, of which those for this actuator's family are kept; `notes` say what could
    not be predicted. Raises RecordError or SpecError for a log without the set-up of a run.
    """
    return summarise(load_run(reader), predictions, references, notes)


def summarise(
    data: RunData,
    predictions: Mapping[str, Response],
    references: Sequence[PublishedReference] = (),
    notes: Sequence[str] = (),
) -> RunSummary:
    """Summarise a run that was read already; see `build_summary`."""
    reader = data.reader
    start, (status, reason) = reader.start(), _ending(reader)
    experiments = {
        name: _experiment(name, data, predictions, references)
        for name in EXPERIMENTS
        if data.section(name) is not None or data.points_of(name)
    }
    return RunSummary(
        status=status,
        reason=reason,
        complete=reader.complete,
        problem=reader.problem,
        actuator=start.actuator,
        material=start.material,
        bench=start.bench,
        board=start.board,
        protocol=start.protocol,
        seed=start.seed,
        created=start.created,
        versions=dict(sorted(start.versions.items())),
        duration_s=max(
            (
                *(point.measured_to_s for point in data.points),
                *(part.to_s for part in reader.parts()),
            ),
            default=0.0,
        ),
        resumed=tuple(ResumeSummary.model_validate(note.model_dump()) for note in reader.resumes()),
        notes=tuple(notes),
        experiments=experiments,
    )


def _ending(reader: RunReader) -> tuple[ExitStatus, str]:
    stop = reader.stop()
    if stop is not None:
        return stop.exit_status, stop.reason
    return "failed", f"the run ended without saying so, as when it is killed: {reader.problem}"


def predicted_value(response: Response, experiment: ExperimentName) -> Array | None:
    """What a model says of an experiment, in deg, mm or grams-force; None if it says nothing."""
    if experiment == "deformation":
        if response.angle is None:
            return MEASURANDS["elongation"].per_si * response.displacement
        return MEASURANDS["bending"].per_si * response.angle
    if response.blocked_force is None:
        return None
    return response.blocked_force / STANDARD_GRAVITY * 1e3


def _experiment(
    name: ExperimentName,
    data: RunData,
    predictions: Mapping[str, Response],
    references: Sequence[PublishedReference],
) -> ExperimentSummary:
    points = data.points_of(name)
    levels = levels_of(points)
    up = [level for level in levels if level.direction == "up"]
    span = max(v.mean for v in up) - min(v.mean for v in up) if up else None
    section, unit = data.section(name), data.unit(name)
    return ExperimentSummary(
        quantity=data.quantity(name),
        unit=unit,
        planned=planned_points(section) if section is not None else len(points),
        measured=len(points),
        span=span,
        points=tuple(_level_summary(level, points, unit) for level in levels),
        repeatability=_repeatability(levels, unit),
        hysteresis=_hysteresis(points, unit),
        controller=_controller(data, points, name),
        models=_models(name, up, predictions, span, data),
        references=_references(name, data, references),
    )


def _level_summary(level: Level, points: Sequence[PointDocument], unit: str) -> LevelSummary:
    here = [
        p
        for p in points
        if p.key.direction == level.direction and p.key.target_kpa == level.target_kpa
    ]
    values = level.values
    return LevelSummary(
        pressure_kpa=level.target_kpa,
        direction=level.direction,
        measured_pressure_kpa=float(level.pressures_kpa.mean()),
        mean=level.mean,
        sd=float(values.std(ddof=1)) if values.size > 1 else None,
        u95=level.estimate.u95,
        budget=_budget(level.components, unit),
        pressure_budget=_budget(level.pressure_components, "kPa"),
        repeats=values.size,
        readings=sum(p.readings for p in here),
        rejected=sum(len(p.rejected) for p in here),
    )


def _repeatability(levels: Sequence[Level], unit: str) -> RepeatabilitySummary | None:
    repeated = [level for level in levels if level.values.size > 1]
    found = repeatability([level.values for level in repeated])
    if found is None:
        return None
    sd = [float(level.values.std(ddof=1)) for level in repeated]
    largest = int(np.argmax(sd))
    return RepeatabilitySummary(
        sd=found.sd,
        low=found.low,
        high=found.high,
        limit=found.limit,
        unit=unit,
        homogeneous=same_variance([level.values for level in repeated]),
        largest=sd[largest],
        largest_pressure_kpa=repeated[largest].target_kpa,
    )


def _hysteresis(points: Sequence[PointDocument], unit: str) -> HysteresisSummary | None:
    """Of the sweeps that went both ways, mean of the branches."""
    both = {p.key.repeat for p in points if p.key.direction == "down"}
    groups = by_level(p for p in points if p.key.repeat in both)
    kpa = sorted({pressure for _, pressure in groups})

    def branch(direction: str) -> Array:
        values = [
            np.array([p.value for p in groups.get((direction, pressure), [])], dtype=np.float64)
            for pressure in kpa
        ]
        return np.array([v.mean() if v.size else np.nan for v in values])

    found = hysteresis(branch("up"), branch("down")) if kpa else None
    if found is None:
        return None
    return HysteresisSummary(
        difference=found.difference,
        percent_of_span=found.percent_of_span,
        pressure_kpa=kpa[found.level],
        unit=unit,
    )


def steps(
    data: RunData, points: Sequence[PointDocument]
) -> list[tuple[PointDocument, StepMetrics]]:
    """Metrics of the pressure loop on the way to each point; points without a trace left out."""
    found = []
    for point in points:
        section = data.section(point.key.experiment)
        tolerance_kpa = section.settling.tolerance / 1e3 if section is not None else 0.05
        trace = data.trace.between(point.started_s, point.measured_to_s)
        settled_s = point.started_s if point.settled_s is None else point.settled_s
        try:
            metrics = step_metrics(
                trace.time_s,
                trace.pressure_kpa,
                point.key.target_kpa,
                tolerance_kpa,
                # The later half of the hold: what is left there is no part of the approach.
                steady_from_s=(settled_s + point.measured_to_s) / 2,
            )
        except ControlError:
            continue
        found.append((point, metrics))
    return found


def _controller(
    data: RunData, points: Sequence[PointDocument], name: ExperimentName
) -> ControllerSummary | None:
    found = steps(data, points)
    section = data.section(name)
    if not found or section is None:
        return None
    metrics = [m for _, m in found]
    settled = [m.settling_time_s for m in metrics if m.settling_time_s is not None]
    return ControllerSummary(
        tolerance_kpa=section.settling.tolerance / 1e3,
        unsettled=len(metrics) - len(settled),
        worst_settling_time_s=max(settled, default=None),
        worst_overshoot_kpa=max(m.overshoot for m in metrics),
        worst_steady_error_kpa=max((m.steady_error for m in metrics), key=abs),
        worst_noise_kpa=max(m.noise for m in metrics),
        steps=tuple(
            StepSummary(
                repeat=point.key.repeat,
                direction=point.key.direction,
                initial_kpa=m.initial,
                target_kpa=m.target,
                rise_time_s=m.rise_time_s,
                settling_time_s=m.settling_time_s,
                overshoot_kpa=m.overshoot,
                overshoot_percent=m.overshoot_percent,
                steady_error_kpa=m.steady_error,
                noise_kpa=m.noise,
            )
            for point, m in found
        ),
    )


def _budget(components: Sequence[Component], unit: str) -> BudgetSummary:
    """A budget as a table; `unit` is that of the result."""
    whole = combine(0.0, components)
    return BudgetSummary(
        lines=tuple(
            BudgetLine(
                source=c.name,
                kind=c.kind,
                distribution=c.distribution,
                u=c.u,
                unit=c.unit,
                sensitivity=c.sensitivity,
                degrees_of_freedom=_finite(c.dof),
                contribution=c.contribution,
                share_percent=100 * (c.contribution / whole.u) ** 2 if whole.u else 0.0,
            )
            for c in components
        ),
        unit=unit,
        u=whole.u,
        degrees_of_freedom=_finite(whole.dof),
        coverage_factor=coverage_factor(whole.dof),
        u95=whole.u95,
    )


def _finite(dof: float) -> float | None:
    return dof if math.isfinite(dof) else None


def _models(
    name: ExperimentName,
    levels: Sequence[Level],
    predictions: Mapping[str, Response],
    span: float | None,
    data: RunData,
) -> dict[str, ModelSummary]:
    found = {}
    for model, response in predictions.items():
        if predicted_value(response, name) is None:
            continue
        curve = ModelCurve(response, name)
        covered = [v for v in levels if curve.reaches(float(v.pressures_kpa.mean()))]
        if covered:
            found[model] = _model(model, name, covered, curve, span or 0.0, data)
    return found


@dataclass(frozen=True)
class ModelCurve:
    """A model's prediction for one experiment as a function of pressure in kPa.

    Outside the response's range the ends count: the noise of a pressure may lie just outside.
    """

    response: Response
    experiment: ExperimentName

    def reaches(self, pressure_kpa: float) -> bool:
        """Whether the model answers for a pressure, give or take the noise of one."""
        return pressure_kpa <= self._top / 1e3 + PRESSURE_NOISE_KPA

    @cached_property
    def _top(self) -> float:
        """Highest pressure in Pa at which there is an answer."""
        predicted = predicted_value(self.response, self.experiment)
        assert predicted is not None
        known = self.response.pressure[np.isfinite(predicted)]
        return float(known[-1]) if known.size else -math.inf

    def value(self, pressures_kpa: Array) -> Array:
        """Prediction in deg, mm or grams-force, the shape of `pressures_kpa`."""
        predicted = predicted_value(self.response.at(self._inside(pressures_kpa)), self.experiment)
        assert predicted is not None
        return predicted

    def slope(self, pressure_kpa: float) -> float:
        """Its slope in deg, mm or grams-force per kPa."""
        around = self._inside(np.array([pressure_kpa - 0.05, pressure_kpa + 0.05])) / 1e3
        low, high = self.value(around)
        return float((high - low) / (around[1] - around[0]))

    def _inside(self, pressures_kpa: Array) -> Array:
        return np.clip(pressures_kpa * 1e3, self.response.pressure[0], self._top)


def _model(
    model: str,
    name: ExperimentName,
    levels: Sequence[Level],
    curve: ModelCurve,
    span: float,
    data: RunData,
) -> ModelSummary:
    unit, setup = data.unit(name), data.setup
    inputs = input_uncertainty(
        setup.actuator,
        setup.material,
        model,
        name,
        curve.value,
        lambda response: predicted_value(response, name),
        np.array([level.pressure.value for level in levels]),
    )
    errors = comparison_errors(levels, curve, inputs)
    level, largest = maximum_error(errors)
    root = rmse(errors)
    statement = validation_statement(errors)
    predicted = curve.value(np.array([v.pressures_kpa.mean() for v in levels]))
    return ModelSummary(
        rmse=_quantity(root, unit),
        bias=_quantity(bias(errors), unit),
        max_error=MaximumError(
            value=largest.value,
            unit=unit,
            u95=largest.u95,
            pressure_kpa=levels[level].target_kpa,
        ),
        nrmse=_quantity(normalised(root, span), "%") if span > 0 else None,
        validation=ValidationSummary(
            levels=statement.levels,
            beyond=statement.beyond,
            coverage=statement.coverage,
            agrees=statement.agrees,
            statement=_in_words(statement, bool(inputs)),
        ),
        errors=tuple(
            LevelError(
                pressure_kpa=v.target_kpa,
                predicted=float(p),
                error=float(e),
                u_validation=float(u),
                u_input=float(i),
            )
            for v, p, e, u, i in zip(
                levels,
                predicted,
                errors.error,
                errors.u_validation,
                errors.u_simulation,
                strict=True,
            )
        ),
    )


def comparison_errors(
    levels: Sequence[Level], curve: ModelCurve, inputs: Mapping[str, Array]
) -> ComparisonErrors:
    """Model minus experiment at each level, at the pressures that were really there.

    Calibrations act at all levels together; an error of pressure moves along the model's slope.
    `inputs` are what one standard uncertainty of each of the model's inputs does, (n,).
    """
    error, u_random, dof = [], [], []
    common: dict[str, list[float]] = {}
    differences = [curve.value(level.pressures_kpa) - level.values for level in levels]
    repeated: dict[tuple[str, float], Array] = {
        (level.direction, level.target_kpa): d
        for level, d in zip(levels, differences, strict=True)
        if d.size > 1
    }
    for index, (level, difference) in enumerate(zip(levels, differences, strict=True)):
        scatter = nearest_scatter(repeated, level.direction, level.target_kpa)
        repeats = repeats_component(difference, level.points, scatter)
        error.append(float(difference.mean()))
        u_random.append(repeats.contribution)
        dof.append(repeats.dof)
        slope = curve.slope(float(level.pressures_kpa.mean()))
        effects = {c.name: c.sensitivity * c.u for c in calibration_components(level.points)}
        effects |= {c.name: slope * c.sensitivity * c.u for c in level.pressure_calibrations}
        for source, effect in effects.items():
            common.setdefault(source, [0.0] * len(levels))[index] = effect
    return ComparisonErrors(
        error=np.array(error),
        u_random=np.array(u_random),
        dof=np.array(dof, dtype=np.float64),
        u_common={source: np.array(u) for source, u in common.items()},
        u_input=inputs,
    )


def _quantity(estimate: Estimate, unit: str) -> Quantity:
    return Quantity(value=estimate.value, unit=unit, u95=estimate.u95)


def _in_words(statement: ValidationStatement, inputs: bool) -> str:
    """`inputs` says whether the uncertainty of the model's inputs is in the statement."""
    k = f"k = {statement.coverage:g}"
    if statement.agrees:
        return (
            f"at none of {statement.levels} pressures does the model differ from the experiment "
            f"by more than the expanded validation uncertainty ({k}): any error of the model is "
            f"below what this experiment resolves"
        )
    return (
        f"at {statement.beyond} of {statement.levels} pressures the model differs from the "
        f"experiment by more than the expanded validation uncertainty ({k}), by up to "
        f"{statement.largest_ratio:.3g} times: "
        + (
            "more than the measurement and the part's tolerances of modulus and wall explain"
            if inputs
            else "more than the measurement explains. How far modulus and dimensions of the "
            "printed part are from the spec is not in that uncertainty: its spec states no "
            "tolerances"
        )
    )


def _references(
    name: ExperimentName, data: RunData, references: Sequence[PublishedReference]
) -> tuple[Reference, ...]:
    family = data.setup.actuator.geometry.family
    found = []
    for reference in references:
        values = tuple(
            ReferenceValue(
                model=value.model,
                statistic=value.statistic,
                value=value.value,
                unit=value.unit,
                where=value.where,
            )
            for value in reference.values
            if value.experiment == name
        )
        if values and reference.actuator_family == family:
            found.append(Reference(citation=reference.citation, note=reference.note, values=values))
    return tuple(found)
