"""Curves as options of the chart library; colours are the style sheet's, so both modes work.

Line styles and marks tell series apart without colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rig.studio.curves import Array, Curve

DASHES = ("solid", "dashed", "dotted", [8, 3, 2, 3])
MARKS = ("circle", "rect", "triangle", "diamond")
SERIES = 5
"""Colours of the palette."""

Options = dict[str, Any]


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
        lines[0]["markLine"] = {
            "silent": True,
            "symbol": "none",
            "animation": False,
            "label": {"show": False},
            "lineStyle": {"color": "var(--muted)", "type": "solid", "width": 1},
            "data": [{"xAxis": round(at_kpa, 3)}],
        }
    return {
        "animation": False,
        "grid": {"left": 55, "right": 15, "top": 34, "bottom": 42},
        "legend": {
            "show": len(lines) > 1,
            "textStyle": {"color": "var(--ink)"},
            "icon": "none",
            "top": 0,
        },
        "tooltip": {"trigger": "axis"},
        "xAxis": _axis("pressure (kPa)", 26),
        "yAxis": _axis(quantity, 38),
        "series": lines,
    }


def _line(index: int, label: str, x: Array, y: Array) -> Options:
    colour = f"var(--series-{index % SERIES + 1})"
    return {
        "type": "line",
        "name": label,
        "data": [[round(float(a), 4), round(float(b), 4)] for a, b in zip(x, y, strict=True)],
        "showSymbol": index > 0,
        "symbol": MARKS[index % len(MARKS)],
        "symbolSize": 5,
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
