"""Curves as options of the chart library; colours are the style sheet's, so both modes work.

Line styles and marks tell series apart without colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.studio.curves import Array, Curve

DASHES = ("solid", "dashed", "dotted", [8, 3, 2, 3])
MARKS = ("circle", "rect", "triangle", "diamond")
SERIES = 5
"""Colours of the palette."""

MOST_POINTS = 1200
"""Of a line over time; a screen has no more columns."""

Options = dict[str, Any]


@dataclass(frozen=True)
class Trace:
    """A line to draw, (n,) each; readings that lie far apart are drawn as marks."""

    label: str
    x: Array
    y: Array
    marks: bool = False


def traces_options(traces: Sequence[Trace], x_name: str, y_name: str, end: float) -> Options:
    """Lines over each other from 0 to `end`; `moved` puts a cursor on them."""
    lines = [
        _line(index, trace.label, *thinned(trace.x, trace.y)) | _marked(trace.marks)
        for index, trace in enumerate(traces)
    ]
    options = _chart(lines, x_name, y_name)
    options["xAxis"] |= {"min": 0, "max": end}
    options["xAxis"]["axisLabel"]["showMaxLabel"] = False  # an odd number beside a round one
    return options


def moved(at: float) -> Options:
    """What changes in a chart of traces when something else is looked at."""
    return {"series": [{"markLine": _cursor(at)}]}


def thinned(x: Array, y: Array, most: int = MOST_POINTS) -> tuple[Array, Array]:
    """At most about `most` points of a line; the lowest and highest of each stretch stay."""
    if x.size <= most:
        return x, y
    size = -(-x.size // (most // 2))
    starts = range(0, x.size, size)
    kept = [
        start + i
        for start in starts
        for i in sorted(
            {int(y[start : start + size].argmin()), int(y[start : start + size].argmax())}
        )
    ]
    chosen = np.array(kept)
    return x[chosen], y[chosen]


def response_options(
    curves: Sequence[Curve], values: Sequence[Array | None], quantity: str, at_kpa: float | None
) -> Options:
    """A quantity of each curve against pressure, with a line at the pressure that is looked at."""
    lines = [
        _line(index, curve.label, curve.pressure_kpa, value)
        for index, (curve, value) in enumerate(zip(curves, values, strict=True))
        if value is not None
    ]
    if lines and at_kpa is not None:
        lines[0]["markLine"] = _cursor(at_kpa)
    return _chart(lines, "pressure (kPa)", quantity)


def _chart(lines: list[Options], x_name: str, y_name: str) -> Options:
    return {
        "animation": False,
        "grid": {"left": 55, "right": 15, "top": 34, "bottom": 42},
        "legend": {
            "show": len(lines) > 1,
            "type": "scroll",
            "textStyle": {"color": "var(--ink)"},
            "pageTextStyle": {"color": "var(--ink)"},
            "pageIconColor": "var(--accent)",
            "pageIconInactiveColor": "var(--muted)",
            "itemWidth": 34,
            "top": 0,
        },
        "tooltip": {"trigger": "axis"},
        "xAxis": _axis(x_name, 26),
        "yAxis": _axis(y_name, 38),
        "series": lines,
    }


def _cursor(at: float) -> Options:
    return {
        "silent": True,
        "symbol": "none",
        "animation": False,
        "label": {"show": False},
        "lineStyle": {"color": "var(--muted)", "type": "solid", "width": 1},
        "data": [{"xAxis": round(at, 3)}],
    }


def _marked(marks: bool) -> Options:
    return {"showSymbol": marks} | ({"lineStyle": {"width": 0}} if marks else {})


def _line(index: int, label: str, x: Array, y: Array) -> Options:
    colour = f"var(--series-{index % SERIES + 1})"
    return {
        "type": "line",
        "name": label,
        "data": [[round(float(a), 4), round(float(b), 4)] for a, b in zip(x, y, strict=True)],
        "showSymbol": index > 0,
        "symbol": MARKS[index % len(MARKS)],
        "symbolSize": 6,
        "clip": False,  # a mark at zero pressure may lie a hair before it
        "lineStyle": {"color": colour, "width": 2, "type": DASHES[index % len(DASHES)]},
        "itemStyle": {"color": colour},
        "emphasis": {"disabled": True},
    }


def _axis(name: str, gap: int) -> Options:
    return {
        "type": "value",
        "name": name,
        "nameLocation": "middle",
        "nameGap": gap,
        "nameTextStyle": {"color": "var(--ink)"},
        "axisLabel": {"color": "var(--ink)"},
        "axisLine": {"lineStyle": {"color": "var(--muted)"}},
        "splitLine": {"lineStyle": {"color": "var(--grid)"}},
    }
