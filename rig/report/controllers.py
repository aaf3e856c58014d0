"""The page of a comparison of controllers: a table for each case, and the courses of some."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rig.control.family import Family
from rig.experiment.controllers import Outcome, Standing
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
STANDING = (
    *COLUMNS[:-1],
    ("of sines", "kPa"),
    COLUMNS[-1],
    ("worst volume", "times the error"),
    ("gain margin", "dB"),
    ("phase margin", "deg"),
)
ROBUST_FROM = 7
"""Column of `STANDING` where robustness begins."""
Columns = tuple[tuple[str, str], ...]
Rows = list[tuple[str, ...]]
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))


@dataclass(frozen=True)
class Competition:
    """What all controllers made of one bench."""

    family: Family
    outcomes: Sequence[Outcome]
    standings: Sequence[Standing]
    limits_kpa: Mapping[str, float]
    """Mean absolute error that the motor leaves, by case."""


def cells(outcome: Outcome) -> tuple[str, ...]:
    """A row of the table."""
    return (*_regulated(outcome), f"{outcome.effort_ml_s:.2f}")


def places(standing: Standing) -> tuple[str, ...]:
    """A row of the table of all cases together."""
    return (
        *_regulated(standing),
        f"{standing.sine_mae_kpa:.3f}",
        f"{standing.effort_ml_s:.2f}",
        f"{standing.worst_volume:.2f}",
        f"{standing.gain_db:.1f}",
        f"{standing.phase_deg:.0f}",
    )


def _regulated(one: Outcome | Standing) -> tuple[str, ...]:
    return (
        one.controller,
        "-" if one.settling_s is None else f"{one.settling_s:.2f}",
        f"{one.overshoot_percent:.1f}",
        f"{one.steady_rmse_kpa:.4f}",
        f"{one.mae_kpa:.3f}",
    )


def parts(standings: Sequence[Standing]) -> tuple[tuple[Columns, Rows], ...]:
    """Columns and rows of two tables that are not too wide: how good, and how robust."""
    rows = [places(one) for one in standings]
    columns: Columns = STANDING
    return (
        (columns[:ROBUST_FROM], [row[:ROBUST_FROM] for row in rows]),
        (
            columns[:1] + columns[ROBUST_FROM:],
            [row[:1] + row[ROBUST_FROM:] for row in rows],
        ),
    )


def write_competitions(path: Path, held: Sequence[Competition]) -> None:
    """Write the page: a table of all cases together for each bench, then every case."""
    benches = ", ".join(one.family.bench for one in held)
    count = sum(len({o.case for o in one.outcomes}) for one in held)
    write_sheet(
        path,
        Sheet(
            title=f"Controllers in {count} cases",
            eyebrow=f"{held[0].family.actuator} on {benches}",
            headline=(
                "Settling is into 1 % of the largest set-point, the longest of a case; the mean "
                "absolute error is of all samples, transitions included; the effort is the root "
                "mean square of the plunger's flow. All figures are of the reported pressure.",
            ),
            sections=tuple(section for one in held for section in _sections(one)),
        ),
    )


def _sections(held: Competition) -> list[Section]:
    bench = held.family.bench
    overview = Section(
        f"Bench {bench}",
        (
            "Settling to effort are of the staircase. Robustness is told twice: how many times "
            "larger its mean absolute error is with the worst of three volumes of gas (in a "
            "liquid: of air) than with the identified one, and the least margins over all levels "
            "and volumes by the identified models. The controllers know nothing of the volumes.",
        ),
        tuple(Table(*part) for part in parts(held.standings)),
    )
    cases = dict.fromkeys(one.case for one in held.outcomes)
    return [*([overview] if held.standings else []), *(_section(name, held) for name in cases)]


def _section(name: str, held: Competition) -> Section:
    these = [one for one in held.outcomes if one.case == name]
    text = (
        (f"The fastest moves of this motor leave {held.limits_kpa[name]:.3f} kPa on average.",)
        if name in held.limits_kpa
        else ()
    )
    return Section(
        f"{held.family.bench}: {name}",
        text,
        (Table(COLUMNS, [cells(one) for one in these]),),
        (
            (
                _courses(_identifier(f"{held.family.bench} {name}"), these),
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
