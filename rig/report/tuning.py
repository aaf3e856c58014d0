"""The page of a tuning: margins of every member, and the classical plots of the loop."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.control.family import Family
from rig.control.loop import TICK_S, Gains, closed_loop, frequencies, loop, loop_response, margins
from rig.control.tune import Member, MemberMargins, Tuning
from rig.report.charts import (
    COLOURS,
    MODEL_LINES,
    SMALL,
    TALL,
    Chart,
    finished,
    legend_below,
    new_figure,
    stacked,
    styled,
)
from rig.report.sheet import Banner, Sheet, write_sheet
from rig.report.sheet_parts import Section, Table

Array = NDArray[np.float64]
PAGE_FILE = "tuning.html"
STEP_PERIODS = 30.0
"""Length of the step responses over the slowest loop's time constant, 1 / crossover."""
MOST_POINTS = 1000
LOCUS_FACTORS = np.geomspace(0.05, 20.0, 160)


def write_tuning(folder: Path, family: Family, tuning: Tuning, drawn: tuple[float, float]) -> Path:
    """Write `tuning.html` into `folder`; returns its path.

    `drawn` are the gain margin in dB and the phase margin in deg that 95 % of the plants keep which
    the covariance of the worst member's estimates makes likely.
    """
    path = folder / PAGE_FILE
    write_sheet(path, _sheet(family, tuning, drawn))
    return path


def _sheet(family: Family, tuning: Tuning, drawn: tuple[float, float]) -> Sheet:
    design, wanted = tuning.single, tuning.wanted
    gains = design.gains
    shown = _shown(tuning)
    schedule = "pays" if tuning.schedule_pays else "does not pay"
    return Sheet(
        title=f"kp {gains.proportional:.3g} mL/s/kPa, ki {gains.integral:.3g} mL/s²/kPa",
        eyebrow=f"Tuning for {family.actuator} on bench {family.bench}",
        headline=(
            f"Worst of {len(design.members)} plants: gain margin {design.gain_db:.1f} dB, phase "
            f"margin {design.phase_deg:.0f}°, delay margin {1e3 * design.delay_s:.1f} ms; slowest "
            f"crossover {design.bandwidth_hz:.2f} Hz, bound by {design.bound_by}.",
            f"95 % of the plants that the uncertainty of the worst one allows keep "
            f"{drawn[0]:.1f} dB and {drawn[1]:.0f}°.",
        ),
        banners=(
            Banner(
                "note",
                f"A gain schedule {schedule}.",
                f"Gains for each level would make the slowest crossover {tuning.schedule_gain:.2f} "
                "times as fast.",
            ),
        ),
        sections=(
            Section(
                "Margins",
                (
                    f"Every level with its gas volume and {100 * wanted.volume_share:g} % less and "
                    "more; tick, hold, filter and delay included.",
                ),
                (_margins_table(design.members),),
            ),
            Section(
                "The open loop",
                (),
                (),
                (
                    (_bode("bode", shown, gains), "Open loop; dots mark gain and phase margin."),
                    (
                        _nyquist("nyquist", shown, gains, wanted.peak_sensitivity),
                        "Nyquist plot; the loop keeps out of the dashed circle about -1.",
                    ),
                ),
            ),
            Section(
                "The closed loop",
                (),
                (),
                (
                    (
                        _locus("locus", shown[-1], gains),
                        "Poles as both gains are multiplied by 0.05 to 20: from light to dark; "
                        "crosses are the design, the line is the limit of stability.",
                    ),
                    (
                        _steps("steps", shown, gains),
                        "A set-point that jumps by 1 kPa without ramp or feed-forward, and a "
                        "disturbing flow of 1 mL/s.",
                    ),
                ),
            ),
        ),
    )


def _shown(tuning: Tuning) -> tuple[Member, ...]:
    """The slowest, one in the middle, and the one with the least gain margin."""
    by_gain = sorted(tuning.single.members, key=lambda m: -m.margins.gain_db)
    chosen = (by_gain[0], by_gain[len(by_gain) // 2], by_gain[-1])
    return tuple(one.member for one in chosen)


def _name(member: Member) -> str:
    return f"{member.setpoint_kpa:g} kPa, {100 * member.volume:.0f} % volume"


def _margins_table(members: tuple[MemberMargins, ...]) -> Table:
    columns = [
        ("plant", ""),
        ("gain margin", "dB"),
        ("phase margin", "deg"),
        ("delay margin", "ms"),
        ("crossover", "rad/s"),
        ("phase crossover", "rad/s"),
        ("peak sensitivity", ""),
    ]
    rows = [
        (
            _name(one.member),
            f"{one.margins.gain_db:.1f}",
            f"{one.margins.phase_deg:.0f}",
            f"{1e3 * one.margins.delay_s:.1f}",
            f"{one.margins.crossover:.1f}",
            f"{one.margins.phase_crossover:.0f}",
            f"{one.margins.peak_sensitivity:.2f}",
        )
        for one in members
    ]
    return Table(columns, rows)


@styled
def _bode(name: str, members: tuple[Member, ...], gains: Gains) -> Chart:
    figure, (size, phase) = stacked(TALL, (1, 1))
    omega = frequencies()
    for number, member in enumerate(members):
        colour, line = COLOURS[f"series-{number + 1}"], MODEL_LINES[number]
        response = loop_response(member.model, gains)
        found = margins(member.model, gains)
        decibels = 20 * np.log10(np.abs(response))
        degrees = np.unwrap(np.angle(response)) * 180 / np.pi
        size.semilogx(omega, decibels, line, color=colour, lw=1.4, label=_name(member))
        phase.semilogx(omega, degrees, line, color=colour, lw=1.4)
        size.plot([found.phase_crossover] * 2, [0, -found.gain_db], "o-", color=colour, ms=3.5)
        phase.plot([found.crossover] * 2, [-180, found.phase_deg - 180], "o-", color=colour, ms=3.5)
    size.axhline(0, color=COLOURS["ink"], lw=0.8)
    phase.axhline(-180, color=COLOURS["ink"], lw=0.8)
    phase.set_ylim(-360, 0)
    size.set_ylim(-40, 60)
    size.set_ylabel("gain (dB)")
    phase.set_ylabel("phase (deg)")
    phase.set_xlabel("frequency (rad/s)")
    legend_below(figure)
    return finished(figure, name, "Bode plot of the open loop with its margins.")


@styled
def _nyquist(name: str, members: tuple[Member, ...], gains: Gains, peak: float) -> Chart:
    figure, axes = new_figure(TALL)
    for number, member in enumerate(members):
        response = loop_response(member.model, gains)
        axes.plot(
            response.real,
            response.imag,
            MODEL_LINES[number],
            color=COLOURS[f"series-{number + 1}"],
            lw=1.4,
            label=_name(member),
        )
    turn = np.linspace(0, 2 * np.pi, 200)
    axes.plot(
        -1 + np.cos(turn) / peak,
        np.sin(turn) / peak,
        "--",
        color=COLOURS["muted"],
        lw=1,
        label=f"sensitivity {peak:g}",
    )
    axes.plot(-1, 0, "+", color=COLOURS["ink"], ms=9)
    axes.set_xlim(-2.2, 0.6)
    axes.set_ylim(-2.0, 0.8)
    axes.set_aspect("equal")
    axes.set_xlabel("real part (1)")
    axes.set_ylabel("imaginary part (1)")
    legend_below(figure)
    return finished(figure, name, "Nyquist plot of the open loop near the point -1.")


@styled
def _locus(name: str, member: Member, gains: Gains) -> Chart:
    import control

    figure, axes = new_figure(SMALL)
    open_loop = loop(member.model, gains)

    def poles(factor: float) -> NDArray[np.complex128]:
        z = control.feedback(factor * open_loop, 1).poles()
        return np.asarray(np.log(z[np.abs(z) > 1e-6].astype(complex)) / TICK_S)

    for factor, shade in zip(LOCUS_FACTORS, np.linspace(0.12, 1, LOCUS_FACTORS.size), strict=True):
        s = poles(factor)
        axes.plot(s.real, s.imag, ".", color=COLOURS["series-1"], alpha=shade, ms=2)
    s = poles(1.0)
    axes.plot(s.real, s.imag, "x", color=COLOURS["series-2"], ms=7, mew=1.8)
    axes.axvline(0, color=COLOURS["ink"], lw=1)
    axes.set_xlim(-320, 60)
    axes.set_ylim(-20, 600)
    axes.set_xlabel("real part (1/s)")
    axes.set_ylabel("imaginary part (rad/s)")
    return finished(figure, name, f"Root locus of the plant at {_name(member)}.")


@styled
def _steps(name: str, members: tuple[Member, ...], gains: Gains) -> Chart:
    import control

    figure, (jump, push) = stacked(TALL, (1, 1))
    slowest = min(margins(member.model, gains).crossover for member in members)
    time_s = TICK_S * np.arange(round(STEP_PERIODS / slowest / TICK_S))
    shown = slice(None, None, math.ceil(time_s.size / MOST_POINTS))
    for number, member in enumerate(members):
        colour, line = COLOURS[f"series-{number + 1}"], MODEL_LINES[number]
        followed, disturbed = closed_loop(member.model, gains)
        step = control.step_response(followed, time_s).outputs
        jump.plot(time_s[shown], step[shown], line, color=colour, lw=1.4, label=_name(member))
        step = control.step_response(disturbed, time_s).outputs
        push.plot(time_s[shown], 1e3 * step[shown], line, color=colour, lw=1.4)
    jump.axhline(1, color=COLOURS["muted"], lw=0.8)
    jump.set_ylabel("pressure (kPa)")
    push.set_ylabel("pressure (Pa)")
    push.set_xlabel("time (s)")
    legend_below(figure)
    return finished(figure, name, "Responses to a jump of the set-point and to a disturbing flow.")
