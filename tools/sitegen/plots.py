"""Plots drawn from the tables that the pages hold, so that the two cannot differ."""

from __future__ import annotations

import io
import re

from matplotlib.figure import Figure

Table = dict[str, list[float]]


def read_table(page: str, heading: str) -> Table:
    """The first table below the heading that begins so; rows that are not all numbers are left out.

    Raises ValueError if there is none.
    """
    _, found, rest = page.partition(f"## {heading}")
    lines = [line for line in rest.split("\n## ")[0].splitlines() if line.startswith("|")]
    if not found or len(lines) < 3:
        raise ValueError(f"no table below the heading '{heading}'")
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    number = re.compile(r"-?\d+(\.\d+)?")
    rows = [row for row in cells[2:] if all(number.fullmatch(cell) for cell in row)]
    return {name: [float(row[i]) for row in rows] for i, name in enumerate(cells[0])}


def curves(table: Table, x_label: str, y_label: str) -> str:
    """SVG of every column against the first; the first of them as marks."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    (_, x), *columns = table.items()
    for (name, y), line in zip(columns, ("o", "-", "--", "-.", ":"), strict=False):
        axes.plot(x, y, line, label=name)
    axes.set(xlabel=x_label, ylabel=y_label)
    axes.legend()
    axes.grid(alpha=0.3)
    return svg(figure)


def svg(figure: Figure) -> str:
    """The figure's SVG element, the same for the same figure."""
    target = io.StringIO()
    figure.savefig(target, format="svg", metadata={"Date": None, "Creator": None})
    return re.sub(r"^.*?(?=<svg)", "", target.getvalue(), flags=re.DOTALL)
