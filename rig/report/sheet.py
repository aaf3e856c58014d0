"""A page of sections with tables and figures, for results that are no characterisation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rig.report.build import write_text
from rig.report.charts import Chart
from rig.report.errors import ReportError
from rig.report.page import environment

Column = tuple[str, str]
"""Name and unit; the unit may be empty."""
Figure = tuple[Chart, str]
"""A chart and its caption."""


@dataclass(frozen=True)
class Sheet:
    """The page."""

    title: str
    eyebrow: str
    headline: tuple[str, ...]
    sections: tuple[Section, ...]
    banners: tuple[Banner, ...] = ()


@dataclass(frozen=True)
class Section:
    """A part of the page."""

    title: str
    text: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()


@dataclass(frozen=True)
class Table:
    """Cells as text; the first of a row is its head."""

    columns: Sequence[Column]
    rows: Sequence[Sequence[str]]
    caption: str = ""


@dataclass(frozen=True)
class Banner:
    """Something nobody may overlook."""

    kind: Literal["good", "bad", "note"]
    title: str
    text: str


def write_sheet(path: Path, sheet: Sheet) -> None:
    """Write one offline HTML page; raises ReportError if the file cannot be written."""
    text = environment().get_template("sheet.html.j2").render(sheet=sheet)
    try:
        write_text(path, text)
    except OSError as error:
        raise ReportError(f"{path}: the page cannot be written: {error.strerror}.") from error
