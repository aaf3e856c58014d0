"""The page of a comparison of controllers: a table for each case, and the courses of some."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rig.control.family import Family
from rig.experiment.controllers import Outcome
from rig.report.charts import COLOURS, TALL, Chart, finished, legend_below, new_figure, styled
from rig.report.sheet import Sheet, write_sheet
from rig.report.sheet_parts import Section, Table

COLUMNS = (
    ("controller", ""),
    ("settling", "s"),
    ("overshoot", "%"),
    ("steady RMSE", "kPa"),
    ("mean absolute error", "kPa"),
    ("effort", "mL/s"),
)
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))


def cells(outcome: Outcome) -> tuple[str, ...]:
    """A row of the table."""
    return (
        outcome.controller,
        "-" if outcome.settling_s is None else f"{outcome.settling_s:.2f}",
        f"{outcome.overshoot_percent:.1f}",
        f"{outcome.steady_rmse_kpa:.4f}",
        f"{outcome.mae_kpa:.3f}",
        f"{outcome.effort_ml_s:.2f}",
    )


def write_competition(
    path: Path, family: Family, outcomes: Sequence[Outcome], limits: Mapping[str, float]
) -> None:
    """Write the page; `limits` are the mean absolute errors in kPa that the motor leaves."""
    cases = list(dict.fromkeys(one.case for one in outcomes))
    write_sheet(
        path,
        Sheet(
            title=f"{len(outcomes) // len(cases)} controllers in {len(cases)} cases",
            eyebrow=f"{family.actuator} on bench {family.bench}",
            headline=(
                "Settling is into 1 % of the largest set-point, the longest of a case; the mean "
                "absolute error is of all samples, transitions included; the effort is the root "
                "mean square of the plunger's flow. All figures are of the reported pressure.",
            ),
            sections=tuple(_section(name, outcomes, limits) for name in cases),
        ),
    )


def _section(name: str, outcomes: Sequence[Outcome], limits: Mapping[str, float]) -> Section:
    these = [one for one in outcomes if one.case == name]
    text = (
        (f"No controller of this drive gets below {limits[name]:.3f} kPa on average.",)
        if name in limits
        else ()
    )
    return Section(
        name,
        text,
        (Table(COLUMNS, [cells(one) for one in these]),),
        (
            (
                _courses(_identifier(name), these),
                "Set-point (grey) and pressures.",
            ),
        ),
    )


def _identifier(name: str) -> str:
    return "case-" + "".join(filter(str.isalnum, name))


@styled
def _courses(name: str, outcomes: Sequence[Outcome]) -> Chart:
    figure, axes = new_figure(TALL)
    first = outcomes[0]
    axes.plot(first.time_s, first.target_kpa, color=COLOURS["muted"], lw=1)
    for number, one in enumerate(outcomes):
        axes.plot(
            one.time_s,
            one.pressure_kpa,
            ls=LINES[number % len(LINES)],
            color=COLOURS[f"series-{number % 5 + 1}"],
            lw=1.2,
            label=one.controller,
        )
    axes.set_xlabel("time (s)")
    axes.set_ylabel("pressure (kPa)")
    legend_below(figure, columns=2)
    return finished(figure, name, "Pressure and set-point over time, a line for each controller.")
