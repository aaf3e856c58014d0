"""Sections of a page: text, tables and figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rig.report.charts import Chart

Column = tuple[str, str]
"""Name and unit; the unit may be empty."""
Figure = tuple[Chart, str]
"""A chart and its caption."""


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
