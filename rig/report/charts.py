"""Charts as inline SVG that takes its colours from the page, so that light and dark both work.

Drawn by matplotlib with stand-in colours that become CSS variables; the same data give the same
bytes. Markers, line styles and direct labels tell series apart without colour.
"""

from __future__ import annotations

import functools
import html
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ParamSpec

import matplotlib as mpl
import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rig.report.data import Trace

Array = NDArray[np.float64]
Arguments = ParamSpec("Arguments")

COLOURS = {
    "ink": "#0b0c01",
    "muted": "#0b0c02",
    "grid": "#0b0c03",
    "series-1": "#0b0c04",
    "series-2": "#0b0c05",
    "series-3": "#0b0c06",
    "series-4": "#0b0c07",
    "series-5": "#0b0c08",
}
"""CSS variable to the colour that stands in for it while matplotlib draws."""
MODEL_LINES = ("-", "--", "-.", ":")
STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "rig",
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.linewidth": 0.7,
    "axes.edgecolor": COLOURS["muted"],
    "grid.color": COLOURS["grid"],
    "axes.labelcolor": COLOURS["ink"],
    "text.color": COLOURS["ink"],
    "xtick.color": COLOURS["muted"],
    "ytick.color": COLOURS["muted"],
    "xtick.labelcolor": COLOURS["ink"],
    "ytick.labelcolor": COLOURS["ink"],
    "path.simplify_threshold": 0.4,
}
SMALL = (5.6, 3.9)
WIDE = (11.2, 3.3)
TALL = (5.6, 5.0)
MAX_COLUMNS = 900
"""Columns of a decimated trace."""


@dataclass(frozen=True)
class Chart:
    """An inline SVG and what it shows in words."""

    svg: str
    alt: str


@dataclass(frozen=True)
class Branch:
    """Measured means of one branch; arrays (n,)."""

    label: str
    pressure_kpa: Array
    mean: Array
    u95: Array


@dataclass(frozen=True)
class Line:
    """A curve of a model; arrays (n,)."""

    label: str
    pressure_kpa: Array
    value: Array


@dataclass(frozen=True)
class Residuals:
    """Differences, as model minus experiment, with expanded uncertainty; arrays (n,)."""

    label: str
    pressure_kpa: Array
    error: Array
    expanded: Array


def styled(draw: Callable[Arguments, Chart]) -> Callable[Arguments, Chart]:
    """Draw in our style whatever matplotlib is configured to on this machine."""

    @functools.wraps(draw)
    def styled(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Chart:
        with mpl.style.context(STYLE, after_reset=True):
            return draw(*args, **kwargs)

    return styled


@styled
def response_chart(
    name: str,
    axis_label: str,
    branches: Sequence[Branch],
    repeats: tuple[Array, Array],
    lines: Sequence[Line],
    alt: str,
) -> Chart:
    """A quantity against pressure: uncertainty band, means, single repeats, model curves."""
    figure, axes = new_figure(SMALL)
    axes.plot(*repeats, ".", color=COLOURS["series-1"], alpha=0.35, ms=3.5, zorder=2)
    labels: list[_EndLabel] = []
    for branch, is_down in zip(branches, (False, True), strict=False):
        colour = COLOURS["series-1" if not is_down else "series-5"]
        if not is_down:
            axes.fill_between(
                branch.pressure_kpa,
                branch.mean - branch.u95,
                branch.mean + branch.u95,
                color=colour,
                alpha=0.22,
                linewidth=0,
            )
        axes.errorbar(
            branch.pressure_kpa,
            branch.mean,
            branch.u95,
            fmt="v" if is_down else "o",
            ls=":" if is_down else "-",
            lw=1.2,
            color=colour,
            ms=5,
            mfc="none" if is_down else colour,
            capsize=2.5,
            elinewidth=1,
            zorder=4,
            label=branch.label,
        )
        if not is_down and branch.pressure_kpa.size:
            end = branch.pressure_kpa.size - 1
            labels.append(_end_label("experiment", branch.pressure_kpa, branch.mean, end, colour))
    for number, line in enumerate(lines):
        colour = _model_colour(number)
        axes.plot(line.pressure_kpa, line.value, MODEL_LINES[number % 4], color=colour, lw=2)
        labels.append(
            _end_label(line.label, line.pressure_kpa, line.value, len(line.value) - 1, colour)
        )
    if len(branches) > 1:
        axes.legend(loc="upper left", frameon=False)
    axes.set_xlabel("pressure (kPa)")
    axes.set_ylabel(axis_label)
    _place_labels(axes, labels)
    return finished(figure, name, alt)


@styled
def comparison_chart(name: str, axis_label: str, branches: Sequence[Branch], alt: str) -> Chart:
    """The same quantity of several runs against pressure, with bars of 95 %."""
    figure, axes = new_figure(SMALL)
    for number, branch in enumerate(branches):
        axes.errorbar(
            branch.pressure_kpa,
            branch.mean,
            branch.u95,
            fmt="osD^v"[number % 5],
            ls=("-", *MODEL_LINES)[number % 5],
            lw=1.2,
            color=COLOURS[f"series-{number % 5 + 1}"],
            ms=5,
            capsize=2.5,
            elinewidth=1,
            label=branch.label,
        )
    axes.set_xlabel("pressure (kPa)")
    axes.set_ylabel(axis_label)
    legend_below(figure)
    return finished(figure, name, alt)


@styled
def residual_chart(
    name: str, axis_label: str, residuals: Sequence[Residuals], alt: str, *, legend: bool = False
) -> Chart:
    """Differences against pressure with bars of their expanded uncertainty.

    Labels stand at the curves' ends, or with `legend` below, where long ones have room.
    """
    figure, axes = new_figure(SMALL)
    axes.axhline(0, color=COLOURS["ink"], lw=1)
    labels = []
    for number, one in enumerate(residuals):
        colour = _model_colour(number)
        shift = 0.06 * (number - (len(residuals) - 1) / 2)
        axes.errorbar(
            one.pressure_kpa + shift,
            one.error,
            one.expanded,
            fmt="sD^v"[number % 4],
            ls=MODEL_LINES[number % 4],
            lw=1.2,
            color=colour,
            ms=5,
            capsize=2.5,
            elinewidth=1.2,
            label=one.label,
        )
        labels.append(
            _end_label(one.label, one.pressure_kpa, one.error, len(one.error) - 1, colour)
        )
    axes.set_xlabel("pressure (kPa)")
    axes.set_ylabel(axis_label)
    if legend:
        legend_below(figure)
    else:
        _place_labels(axes, labels)
    return finished(figure, name, alt)


@styled
def repeats_chart(
    name: str,
    axis_label: str,
    deviations: Mapping[int, tuple[Array, Array]],
    sd: float,
    alt: str,
) -> Chart:
    """Deviation of each repeat from the mean of its pressure, with one standard deviation."""
    figure, axes = new_figure(SMALL)
    axes.axhline(0, color=COLOURS["ink"], lw=1)
    for sign in (-1, 1):
        axes.axhline(sign * sd, color=COLOURS["muted"], lw=1, ls=(0, (5, 3)))
    for number, (repeat, (kpa, deviation)) in enumerate(deviations.items()):
        axes.plot(
            kpa,
            deviation,
            marker=f"${repeat}$",
            ms=7,
            ls="-",
            lw=0.6,
            alpha=0.9,
            color=COLOURS[f"series-{number % 5 + 1}"],
        )
    axes.set_xlabel("pressure (kPa)")
    axes.set_ylabel(axis_label)
    return finished(figure, name, alt)


@styled
def trace_chart(name: str, trace: Trace, alt: str) -> Chart:
    """Pressure and set-point over the whole run; extremes survive the decimation."""
    figure, axes = new_figure(WIDE)
    if trace.time_s.size:
        minutes, low, high = envelope(trace.time_s / 60, trace.pressure_kpa)
        axes.fill_between(
            minutes, low, high, color=COLOURS["series-1"], lw=0.8, label="measured pressure"
        )
        minutes, low, high = envelope(trace.time_s / 60, trace.setpoint_kpa)
        axes.step(
            np.repeat(minutes, 2),
            np.column_stack([low, high]).ravel(),
            color=COLOURS["series-2"],
            lw=0.9,
            ls="--",
            label="set-point",
        )
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, frameon=False, borderpad=0)
        axes.set_xlim(0, float(minutes[-1]))
    axes.set_xlabel("bench time (min)")
    axes.set_ylabel("pressure (kPa)")
    return finished(figure, name, alt)


@styled
def step_chart(
    name: str,
    trace: Trace,
    started_s: float,
    target_kpa: float,
    tolerance_kpa: float,
    settling_time_s: float | None,
    alt: str,
) -> Chart:
    """One step of the pressure loop with its tolerance band and settling time."""
    figure, axes = new_figure(SMALL)
    since = trace.time_s - started_s
    axes.axhspan(
        target_kpa - tolerance_kpa,
        target_kpa + tolerance_kpa,
        color=COLOURS["series-3"],
        alpha=0.25,
        lw=0,
        label=f"tolerance ±{tolerance_kpa:g} kPa",
    )
    axes.step(
        since,
        trace.setpoint_kpa,
        where="post",
        ls="--",
        lw=1.2,
        color=COLOURS["series-2"],
        label="set-point",
    )
    axes.plot(since, trace.pressure_kpa, lw=1.6, color=COLOURS["series-1"], label="measured")
    if settling_time_s is not None:
        axes.axvline(settling_time_s, color=COLOURS["ink"], lw=1, ls=":")
        axes.annotate(
            f"settled after {settling_time_s:.2f} s",
            (settling_time_s, 0.45),
            xycoords=("data", "axes fraction"),
            xytext=(5, 0),
            textcoords="offset points",
        )
    axes.legend(loc="lower right", frameon=False)
    axes.set_xlabel("time since the set-point (s)")
    axes.set_ylabel("pressure (kPa)")
    return finished(figure, name, alt)


def envelope(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Middle x, least and largest y of at most MAX_COLUMNS pieces of a trace."""
    pieces = np.linspace(0, x.size, min(MAX_COLUMNS, x.size) + 1).astype(int)
    starts = np.unique(pieces[:-1])
    middle = (x[starts] + np.append(x[starts[1:] - 1], x[-1])) / 2
    return middle, np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)


@dataclass(frozen=True)
class _EndLabel:
    text: str
    x: float
    y: float
    colour: str


def _end_label(text: str, x: Array, y: Array, index: int, colour: str) -> _EndLabel:
    return _EndLabel(text, float(x[index]), float(y[index]), colour)


def _place_labels(axes: Axes, labels: Sequence[_EndLabel]) -> None:
    """Write labels at the right ends of their curves, moved apart where they would overlap."""
    low, high = axes.get_ylim()
    gap = 0.062 * (high - low)
    y = -np.inf
    for label in sorted(labels, key=lambda one: one.y):
        y = max(label.y, y + gap)
        axes.annotate(
            label.text,
            (label.x, label.y),
            xytext=(1.015, (y - low) / (high - low)),
            textcoords="axes fraction",
            color=label.colour,
            va="center",
            weight="bold",
            annotation_clip=False,
        )
    axes.set_ylim(low, high)


def legend_below(figure: Figure, columns: int = 1) -> None:
    """A legend outside of the axes, where long labels have room."""
    figure.legend(loc="outside lower left", ncols=columns, frameon=False)


def _model_colour(number: int) -> str:
    """Series 1 is the experiment; models, and runs held against the first, follow."""
    return COLOURS[f"series-{number % 4 + 2}"]


def new_figure(size: tuple[float, float]) -> tuple[Figure, Axes]:
    """A figure of `size` in inches with one set of axes."""
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    axes.tick_params(length=3)
    return figure, axes


def stacked(size: tuple[float, float], heights: tuple[int, ...]) -> tuple[Figure, tuple[Axes, ...]]:
    """A figure with axes above each other on one abscissa, of these relative heights."""
    figure = Figure(figsize=size, layout="constrained")
    all_axes = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    for axes in all_axes:
        axes.tick_params(length=3)
    return figure, tuple(all_axes)


def finished(figure: Figure, name: str, alt: str) -> Chart:
    """The drawn figure as a chart; `name` keeps its ids apart from those of others on a page."""
    buffer = io.StringIO()
    figure.savefig(
        buffer,
        format="svg",
        transparent=True,
        metadata={"Date": None, "Creator": None, "Format": None, "Type": None},
    )
    return Chart(_inline(buffer.getvalue(), name, alt), alt)


def _inline(svg: str, name: str, alt: str) -> str:
    """The bare <svg> element with ids of its own, page colours and a title."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>\s*", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = re.sub(r"url\(#", f"url(#{name}-", svg)
    svg = re.sub(r'xlink:href="#', f'xlink:href="#{name}-', svg)
    for variable, stand_in in COLOURS.items():
        svg = svg.replace(stand_in, f"var(--{variable})")
    # Drop the size in points: the page decides; the view box keeps the shape.
    head, rest = svg.split(">", 1)
    head = re.sub(r'\s(?:width|height)="[^"]*"', "", head)
    label = html.escape(alt, quote=True)
    return f'{head} role="img" aria-label="{label}"><title>{label}</title>{rest.strip()}'
