"""A page of sections with tables and figures, for results that are no characterisation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rig.report.build import write_text
from rig.report.errors import ReportError
from rig.report.page import environment
from rig.report.sheet_parts import Section


@dataclass(frozen=True)
class Sheet:
    """The page."""

    title: str
    eyebrow: str
    headline: tuple[str, ...]
    sections: tuple[Section, ...]
    banners: tuple[Banner, ...] = ()


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
