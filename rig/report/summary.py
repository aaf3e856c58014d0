"""The result of a run as data: `summary.json` and everything the report shows as a number.

Pressures are in kPa, times in s, angles in deg, elongations in mm, forces in grams-force; `u95` is
an expanded uncertainty for a level of confidence of 95 %. Floats keep six significant digits.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict

from rig.record.documents import Direction, ExitStatus, ExperimentName

SCHEMA_VERSION: Literal[1] = 1
DIGITS = 6


def rounded(value: float) -> float:
    """`value` with six significant digits; zero loses its sign."""
    return float(f"{value:.{DIGITS}g}") + 0.0


Number = Annotated[float, AfterValidator(rounded)]


class SummaryModel(BaseModel):
    """A frozen part of the summary."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Quantity(SummaryModel):
    """A value with unit and uncertainty."""

    value: Number
    unit: str
    u95: Number


class BudgetLine(SummaryModel):
    """One input quantity of a measurement, and what it does to the result (GUM, Table H.1)."""

    source: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    u: Number
    """Standard uncertainty of the input, in `unit`."""
    unit: str
    sensitivity: Number
    degrees_of_freedom: Number | None
    """None if the uncertainty counts as exactly known."""
    contribution: Number
    """Standard uncertainty that it gives the result, in the budget's unit."""
    share_percent: Number
    """Of the variance."""


class BudgetSummary(SummaryModel):
    """What makes one result uncertain, line by line, combined and expanded."""

    lines: tuple[BudgetLine, ...]
    unit: str
    u: Number
    """Combined standard uncertainty."""
    degrees_of_freedom: Number | None
    """Effective, after Welch and Satterthwaite; None if infinite."""
    coverage_factor: Number
    u95: Number


class LevelSummary(SummaryModel):
    """All repeats of one pressure on one branch."""

    pressure_kpa: float
    """As the protocol asks for it."""
    direction: Direction
    measured_pressure_kpa: Number
    mean: Number
    sd: Number | None
    """Of the repeats; None for a single one."""
    u95: Number
    budget: BudgetSummary
    """Of `mean`."""
    pressure_budget: BudgetSummary
    """Of `measured_pressure_kpa`."""
    repeats: int
    readings: int
    rejected: int
    """Readings not used."""


class RepeatabilitySummary(SummaryModel):
    """Scatter of repeats, pooled over pressures (ISO 5725-2)."""

    sd: Number
    low: Number
    high: Number
    """95 % interval of `sd`."""
    limit: Number
    """Two single results differ by more than this in one case of twenty."""
    unit: str
    homogeneous: bool
    """Whether one scatter for all pressures is tenable (Cochran's test, 5 %)."""
    largest: Number
    """Standard deviation where repeats scatter most."""
    largest_pressure_kpa: float


class HysteresisSummary(SummaryModel):
    """Widest gap between the branches."""

    difference: Number
    """Descending minus ascending."""
    percent_of_span: Number
    pressure_kpa: float
    unit: str


class StepSummary(SummaryModel):
    """How the pressure loop reached one point."""

    repeat: int
    direction: Direction
    initial_kpa: Number
    target_kpa: float
    rise_time_s: Number | None
    settling_time_s: Number | None
    overshoot_kpa: Number
    overshoot_percent: Number | None
    steady_error_kpa: Number
    noise_kpa: Number


class ControllerSummary(SummaryModel):
    """The pressure loop over all steps; the worst of each kind."""

    tolerance_kpa: Number
    unsettled: int
    """Steps that did not stay within the tolerance."""
    worst_settling_time_s: Number | None
    worst_overshoot_kpa: Number
    worst_steady_error_kpa: Number
    """Signed, the one farthest from zero."""
    worst_noise_kpa: Number
    steps: tuple[StepSummary, ...]


class LevelError(SummaryModel):
    """Model minus experiment at one pressure."""

    pressure_kpa: float
    predicted: Number
    error: Number
    u_validation: Number
    """Standard validation uncertainty (V&V 20)."""
    u_input: Number
    """Its part from the model's inputs: modulus and wall thickness of the printed part."""


class ValidationSummary(SummaryModel):
    """|E| against k u_val, after ASME V&V 20."""

    levels: int
    beyond: int
    coverage: Number
    agrees: bool
    statement: str


class MaximumError(Quantity):
    """The largest absolute error and where it is."""

    pressure_kpa: float


class ModelSummary(SummaryModel):
    """One model against the experiment; error is model minus experiment."""

    rmse: Quantity
    bias: Quantity
    max_error: MaximumError
    nrmse: Quantity | None
    """RMSE in per cent of the measured range."""
    validation: ValidationSummary
    errors: tuple[LevelError, ...]


class ReferenceValue(SummaryModel):
    """A figure of a paper."""

    model: str
    statistic: str
    value: Number
    unit: str
    where: str


class Reference(SummaryModel):
    """Figures of one paper for this experiment."""

    citation: str
    note: str
    values: tuple[ReferenceValue, ...]


class ExperimentSummary(SummaryModel):
    """One experiment."""

    quantity: str
    unit: str
    planned: int
    measured: int
    """Points."""
    span: Number | None
    """Range of the ascending means."""
    points: tuple[LevelSummary, ...]
    repeatability: RepeatabilitySummary | None
    hysteresis: HysteresisSummary | None
    controller: ControllerSummary | None
    models: dict[str, ModelSummary]
    references: tuple[Reference, ...]


class ResumeSummary(SummaryModel):
    """The run was interrupted and taken up again."""

    resumed_s: Number
    points_kept: int
    seed: int
    versions: dict[str, str]


class TrialFigure(SummaryModel):
    """One figure of a trial."""

    name: str
    value: Number
    u: Number | None
    """Standard uncertainty; None where none was found."""
    unit: str


class TrialSummary(SummaryModel):
    """One trial: creep, cycles, a drive, a pull or a trajectory."""

    kind: str
    planned: int
    measured: int
    """Parts."""
    figures: tuple[TrialFigure, ...]
    notes: tuple[str, ...]
    """What was not done as asked."""


class RunSummary(SummaryModel):
    """Everything a run found out."""

    schema_version: Literal[1] = SCHEMA_VERSION
    status: ExitStatus
    reason: str
    complete: bool
    """Whether the log was closed in order."""
    problem: str | None
    """What is wrong with the log."""
    actuator: str
    material: str
    bench: str
    board: str
    protocol: str
    seed: int
    created: str | None
    versions: dict[str, str]
    duration_s: Number
    """Bench time of the last point."""
    resumed: tuple[ResumeSummary, ...]
    notes: tuple[str, ...]
    """What could not be computed, and why."""
    experiments: dict[ExperimentName, ExperimentSummary]
    trials: dict[str, TrialSummary] = {}
    """By name."""

    def to_json(self) -> str:
        """Text of `summary.json`; the same run gives the same bytes."""
        return self.model_dump_json(indent=2) + "\n"


def run_summary_schema() -> str:
    """JSON Schema of `summary.json`, as models/schemas/run-summary.json holds it."""
    schema = RunSummary.model_json_schema(mode="serialization")
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    return json.dumps(schema, indent=2, sort_keys=True) + "\n"


def write_run_summary_schema(folder: Path) -> Path:
    """Write the schema into `folder`, which must exist; returns its path."""
    path = folder / "run-summary.json"
    path.write_text(run_summary_schema(), encoding="utf-8")
    return path
