"""What the tests found, as a page: tables, drawn, that `tests/evidence.py` writes and checks."""

from __future__ import annotations

import csv
from pathlib import Path

FOLDER = Path("docs/validation/evidence")
INTRODUCTION = """# What the tests found

Each table was written by the test named below it (`pytest --evidence`), which computes it again in
every run of the gate and fails where the site shows something else.
"""

Head = dict[str, str]
Columns = dict[str, list[float | str]]


def read_evidence(text: str) -> tuple[Head, Columns]:
    """The head (`title`, `by`, `plot`, `quantity`) and the columns; text stays text."""
    lines = text.splitlines()
    head = dict(line[2:].split(": ", 1) for line in lines if line.startswith("# "))
    names, *rows = csv.reader(line for line in lines if not line.startswith("# "))
    return head, {name: [_value(row[i]) for row in rows] for i, name in enumerate(names)}


def evidence_pages(root: Path) -> dict[str, str | bytes]:
    """The page and its drawings, by place below `docs/`."""
    sections, pages = [INTRODUCTION], dict[str, str | bytes]()
    for path in sorted((root / FOLDER).glob("*.csv")):
        head, columns = read_evidence(path.read_text(encoding="utf-8"))
        section = f"## {head['title']}\n\n"
        if head["plot"] != "none":
            picture = f"images/evidence/{path.stem}.svg"
            pages[picture] = _drawn(head, columns)
            section += f"![{head['title']}](../{picture})\n\n"
        sections.append(f"{section}{_table(columns)}\n\nBy `{head['by']}`.\n")
    return pages | {"validation/results.md": "\n".join(sections)}


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _table(columns: Columns) -> str:
    rows = [
        [v if isinstance(v, str) else f"{v:g}" for v in row]
        for row in zip(*columns.values(), strict=True)
    ]
    lines = [list(columns), ["---"] * len(columns), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _drawn(head: Head, columns: Columns) -> str:
    """SVG of every column against the first."""
    from matplotlib.figure import Figure  # not for the tests that only read

    from .plots import svg

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    (x_name, x), *series = columns.items()
    for (name, y), mark in zip(series, "osv^Dx", strict=False):
        axes.plot(x, y, f"{mark}-" if head["plot"] != "marks" else mark, label=name)
    if head["plot"] == "loglog":
        axes.set(xscale="log", yscale="log")
    axes.set(xlabel=x_name, ylabel=head["quantity"])
    axes.legend()
    axes.grid(alpha=0.3)
    return svg(figure)
