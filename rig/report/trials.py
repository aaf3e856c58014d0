"""What the trials of a run showed: figures for the summary, sections for the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.experiment.program import Program, TrialPlan, plan_trials
from rig.mechanics.outline import body_of
from rig.record.documents import LookDocument, PartDocument
from rig.record.reader import RunReader
from rig.report.charts import COLOURS, TALL, Chart, finished, stacked, styled
from rig.report.data import RunData
from rig.report.sheet_parts import Section, Table
from rig.report.summary import TrialFigure, TrialSummary
from rig.report.words import significant
from rig.spec.measurand import Measurand
from rig.spec.trial import PullTrial
from rig.spec.workspace import Setup
from rig.validate.time_response import (
    Peak,
    cycle_extremes,
    fit_creep,
    highest_peak,
    softening,
)

Array = NDArray[np.float64]
TITLES = {
    "creep": "Creep and recovery",
    "cycles": "Cyclic fatigue",
    "pumping": "Constant pumping rate",
    "constant_deformation": "Constant deformation",
    "volumes": "Volume control",
    "pull": "Pulling force",
    "trajectory": "Trajectory",
}


@dataclass(frozen=True)
class PartData:
    """A part with what was recorded in it; times count from its start."""

    part: PartDocument
    program: Program
    time_s: Array
    pressure_kpa: Array
    plunger_ml: Array
    """From where the part began."""
    force_time_s: Array
    force_g: Array
    looks: tuple[LookDocument, ...]
    measurand: Measurand
    """Of the looks."""

    @property
    def asked(self) -> Array:
        """The line of the program at `time_s`, in kPa or mL."""
        scale = 1e-3 if self.program.drive == "pressure" else 1e6
        return np.interp(self.time_s, self.program.times, self.program.values * scale)

    @property
    def followed(self) -> Array:
        """What answers `asked`."""
        return self.pressure_kpa if self.program.drive == "pressure" else self.plunger_ml

    def between(self, first: int, last: int) -> NDArray[np.bool_]:
        """Samples from one corner of the program to another."""
        times = self.program.times
        return np.asarray((self.time_s >= times[first]) & (self.time_s <= times[last]))

    def deformations(self, from_s: float, to_s: float) -> tuple[Array, Array]:
        """Times and values of the accepted looks between two times."""
        seen = [
            (look.time_s, look.value)
            for look in self.looks
            if look.accepted and look.value is not None and from_s <= look.time_s <= to_s
        ]
        table = np.array(seen, dtype=np.float64).reshape(-1, 2)
        return table[:, 0], table[:, 1]


def trial_data(data: RunData) -> list[tuple[TrialPlan, list[PartData]]]:
    """The trials of a run's protocol with the parts that were done."""
    setup = data.setup
    if not setup.protocol.trials:
        return []
    plans = plan_trials(setup, body_of(setup.actuator.geometry).cavity_volume)
    programs = {program.key: program for plan in plans for program in plan.programs}
    done = [
        _part_data(data.reader, setup, part, programs[part.key]) for part in data.reader.parts()
    ]
    return [
        (plan, [part for part in done if part.part.key.trial == plan.trial.name]) for plan in plans
    ]


def _part_data(reader: RunReader, setup: Setup, part: PartDocument, program: Program) -> PartData:
    pressure, cell = reader.telemetry("PRESSURE"), reader.telemetry("LOAD_CELL")
    inside = _within(part, pressure["time_s"])
    weighed = _within(part, cell["time_s"])
    if weighed.any():
        weighed &= cell["load_cell_status"] == 0
    counts = cell.get("load_cell_counts", np.empty(0))[weighed] if weighed.size else np.empty(0)
    return PartData(
        part,
        program,
        pressure["time_s"][inside] - part.from_s,
        pressure["pressure_kpa"][inside],
        pressure["plunger_ml"][inside] - part.plunger_from_ml,
        cell["time_s"][weighed] - part.from_s,
        np.array([setup.calibrations.load_cell.grams(float(word)) for word in counts]),
        tuple(look for look in reader.looks() if look.key == part.key),
        setup.actuator.measurand,
    )


def _within(part: PartDocument, time_s: Array) -> NDArray[np.bool_]:
    return np.asarray((time_s >= part.from_s) & (time_s <= part.to_s))


def summarise_trials(
    trials: Sequence[tuple[TrialPlan, list[PartData]]],
) -> dict[str, TrialSummary]:
    """Figures of every trial by its name; those of a repeat that has no data are left out."""
    return {
        plan.trial.name: TrialSummary(
            kind=plan.trial.kind,
            planned=len(plan.programs),
            measured=len(parts),
            figures=tuple(_figures(plan, parts)) if parts else (),
            notes=tuple(dict.fromkeys(note for p in parts for note in p.part.notes)),
        )
        for plan, parts in trials
    }


def _figures(plan: TrialPlan, parts: list[PartData]) -> list[TrialFigure]:
    unit = "kPa" if parts[0].program.drive == "pressure" else "mL"
    error = np.concatenate([p.followed - p.asked for p in parts])
    figures = [
        _figure("mean absolute deviation from the line", float(np.mean(np.abs(error))), unit),
        _figure("largest deviation from the line", float(np.max(np.abs(error))), unit),
    ]
    kinds = {
        "creep": _creep,
        "cycles": _cycles,
        "pumping": _pumping,
        "constant_deformation": _deformation,
        "volumes": _volumes,
    }
    if isinstance(plan.trial, PullTrial):
        return figures + _pull(plan.trial, parts)
    found = kinds.get(plan.trial.kind)
    return figures + (found(parts) if found is not None else [])


def _figure(name: str, value: float, unit: str, u: float | None = None) -> TrialFigure:
    return TrialFigure(name=name, value=value, u=u, unit=unit)


def _creep(parts: list[PartData]) -> list[TrialFigure]:
    """Of each repeat: how far it crept, the law it followed, what recovery left."""
    figures = []
    for part in parts:
        unit = part.measurand.unit
        t, repeat = part.program.times, f", repeat {part.part.key.repeat}"
        _, before = part.deformations(-1.0, 0.1 * float(t[1]))
        for name, begin, end in (("creep", t[1], t[2]), ("recovery", t[3], t[4])):
            time_s, seen = part.deformations(float(begin), float(end) + 0.1)
            if seen.size < 2:
                continue
            moved = float(seen[-1] - seen[0])
            figures.append(_figure(f"{name} from the first to the last look{repeat}", moved, unit))
            fit = fit_creep(time_s - begin, seen)
            if fit is None:
                continue
            for parameter, (value, u) in fit.parameters.items():
                its = {"time": "s", "exponent": ""}.get(parameter, unit)
                figures.append(_figure(f"{name}: {fit.law} {parameter}{repeat}", value, its, u))
            figures.append(_figure(f"{name}: rest of the {fit.law} fit{repeat}", fit.rms, unit))
            if name == "recovery" and before.size:
                left = float(seen[-1] - before[0])
                figures.append(_figure(f"left after recovery{repeat}", left, unit))
    return figures


def cycle_table(parts: list[PartData]) -> Array:
    """Rows of cycle number, highest and lowest pressure (kPa), deformation at either, (n, 5)."""
    rows: list[Array] = []
    for part in parts:
        times, values = part.program.times, part.program.values
        tops = np.flatnonzero((values[1:] == values.max()) & (np.diff(values) > 0))
        borders = np.append(times[tops], times[-1])
        high, low = cycle_extremes(part.time_s, part.pressure_kpa, borders)
        block = np.full((tops.size, 5), np.nan)
        block[:, 0] = len(rows) and rows[-1][-1, 0]
        block[:, 0] += 1 + np.arange(tops.size)
        block[:, 1], block[:, 2] = high, low
        for index, (begin, end) in enumerate(pairwise(borders)):
            _, seen = part.deformations(float(begin), float(end) + 0.05)
            if seen.size >= 2:
                block[index, 3:] = seen[-2:]
        rows.append(block)
    return np.concatenate(rows)


def _cycles(parts: list[PartData]) -> list[TrialFigure]:
    unit = parts[0].measurand.unit
    first = [p for p in parts if p.part.key.repeat == parts[0].part.key.repeat]
    table = cycle_table(first)
    figures = [
        _figure("cycles done", float(len(table)), ""),
        _figure("mean of the pressure peaks", float(np.nanmean(table[:, 1])), "kPa"),
        _figure("scatter of the pressure peaks", float(np.nanstd(table[:, 1])), "kPa"),
    ]
    seen = table[np.isfinite(table[:, 3])]
    if not len(seen):
        return figures
    amplitude = seen[:, 3] - seen[:, 4]
    figures += [
        _figure("first amplitude", float(amplitude[0]), unit),
        _figure("last amplitude", float(amplitude[-1]), unit),
    ]
    trend = softening(seen[:, 0], amplitude)
    if trend is not None:
        name = "change of the amplitude over ten times the cycles"
        figures.append(_figure(name, trend.per_decade, unit, trend.u))
    return figures


def _pumping(parts: list[PartData]) -> list[TrialFigure]:
    figures = []
    for part in parts:
        push, repeat = part.between(0, 1), f", repeat {part.part.key.repeat}"
        duration = part.program.times[1]
        middle = push & (part.time_s > 0.25 * duration) & (part.time_s < 0.75 * duration)
        if middle.sum() < 3:
            continue
        rate = float(np.polyfit(part.time_s[middle], part.plunger_ml[middle], 1)[0])
        asked = float(part.program.values[1]) * 1e6 / float(duration)
        figures += [
            _figure(f"pumping rate asked for{repeat}", asked, "mL/s"),
            _figure(f"pumping rate in the middle of the push{repeat}", rate, "mL/s"),
            _figure(f"highest pressure{repeat}", float(part.pressure_kpa.max()), "kPa"),
        ]
    return figures


def _deformation(parts: list[PartData]) -> list[TrialFigure]:
    figures = []
    for part in parts:
        _, seen = part.deformations(-1.0, float(part.program.times[-1]))
        duration = float(part.program.times[-3])
        repeat = f", repeat {part.part.key.repeat}"
        figures.append(_figure(f"duration of the drive{repeat}", duration, "s"))
        if seen.size >= 2:
            name, moved = part.measurand.quantity, float(seen[-1] - seen[0])
            figures.append(_figure(f"{name} that came of it{repeat}", moved, part.measurand.unit))
    return figures


def _volumes(parts: list[PartData]) -> list[TrialFigure]:
    """Pressure at the end of each level, up and down."""
    figures = []
    for part in parts:
        times, values = part.program.times, part.program.values * 1e6
        repeat = f", repeat {part.part.key.repeat}"
        levels: dict[float, list[float]] = {}
        for index in range(1, times.size, 2):
            last = (part.time_s > times[index] - 1.0) & (part.time_s <= times[index])
            if last.any():
                level = round(float(values[index]), 6)
                levels.setdefault(level, []).append(float(part.pressure_kpa[last].mean()))
        for level, pressures in sorted(levels.items()):
            figures.append(_figure(f"pressure at {level:g} mL, up{repeat}", pressures[0], "kPa"))
            if len(pressures) > 1:
                name = f"pressure at {level:g} mL, down less up{repeat}"
                figures.append(_figure(name, pressures[1] - pressures[0], "kPa"))
    return figures


def pull_peak(trial: PullTrial, part: PartData) -> Peak | None:
    """The peak of the force while the object was pulled."""
    pulled = part.force_time_s >= part.program.times[2]
    force = part.force_g[pulled]
    return highest_peak(part.force_time_s[pulled], force, trial.prominence * 1e3)


def _pull(trial: PullTrial, parts: list[PartData]) -> list[TrialFigure]:
    peaks = [peak for part in parts if (peak := pull_peak(trial, part)) is not None]
    figures = [_figure("pulls in which a peak was found", float(len(peaks)), "")]
    if peaks:
        force = np.array([peak.value for peak in peaks])
        u = float(force.std(ddof=1) / np.sqrt(force.size)) if force.size > 1 else None
        figures.append(_figure("mean of the peak forces", float(force.mean()), "g", u))
    return figures


def trial_sections(
    trials: Sequence[tuple[TrialPlan, list[PartData]]], summaries: dict[str, TrialSummary]
) -> list[Section]:
    """A section of the page for each trial: its figures, and the first part as a chart."""
    sections = []
    for plan, parts in trials:
        summary = summaries[plan.trial.name]
        rows = [
            (f.name, significant(f.value), "" if f.u is None else significant(f.u, 2), f.unit)
            for f in summary.figures
        ]
        columns = [("figure", ""), ("value", ""), ("standard uncertainty", ""), ("unit", "")]
        text = f"{summary.measured} of {summary.planned} parts were done."
        sections.append(
            Section(
                f"{TITLES[summary.kind]}: {plan.trial.name}",
                (text, *summary.notes),
                (Table(columns, rows),) if rows else (),
                tuple(
                    (_chart(f"trial-{plan.trial.name}", part), _caption(part)) for part in parts[:1]
                ),
            )
        )
    return sections


def _caption(part: PartData) -> str:
    key = part.part.key
    return f"Repeat {key.repeat}, part {key.part}: what was asked for (dashed), and what came."


@styled
def _chart(name: str, part: PartData) -> Chart:
    volume = part.program.drive == "volume"
    figure, axes = stacked(TALL, (1, 1))
    axes[0].plot(part.time_s, part.followed, color=COLOURS["series-1"], lw=1.2)
    axes[0].plot(part.time_s, part.asked, "--", color=COLOURS["series-2"], lw=1.0)
    axes[0].set_ylabel("plunger (mL)" if volume else "pressure (kPa)")
    time_s, seen = part.deformations(-np.inf, np.inf)
    if volume:
        axes[1].plot(part.time_s, part.pressure_kpa, color=COLOURS["series-1"], lw=1.2)
        axes[1].set_ylabel("pressure (kPa)")
    elif part.program.key.kind == "pull":
        axes[1].plot(part.force_time_s, part.force_g, color=COLOURS["series-1"], lw=1.2)
        axes[1].set_ylabel("force (g)")
    else:
        axes[1].plot(time_s, seen, "o-", color=COLOURS["series-1"], lw=0.8, ms=4)
        axes[1].set_ylabel(f"{part.measurand.quantity} ({part.measurand.unit})")
    axes[1].set_xlabel("time (s)")
    return finished(figure, name, f"{TITLES[part.program.key.kind]} over time.")
