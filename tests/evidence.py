"""Figures that tests compute and the documentation shows: written by one, read by the other.

A test hands over a table; it is compared with the one in `docs/validation/evidence`, which the site
draws. `pytest --evidence` writes them anew instead.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

from tools.sitegen.evidence import FOLDER, read_evidence

ROOT = Path(__file__).resolve().parents[1]
DIGITS = 5
"""Significant ones that are written."""

Table = Mapping[str, Sequence[float | str]]
"""Columns by their names, with units; all of one length."""


@dataclass(frozen=True)
class Evidence:
    """What one test has to show."""

    by: str
    """The test, as pytest names it."""
    renewing: bool

    def __call__(
        self,
        name: str,
        title: str,
        table: Table,
        *,
        plot: Literal["none", "lines", "marks", "loglog"] = "none",
        quantity: str = "",
        rel: float = 0.0,
        abs: float = 0.0,
    ) -> None:
        """Compare `table` with the site's, number by number, or write it.

        `quantity` names the vertical axis; columns are drawn against the first.
        """
        path = ROOT / FOLDER / f"{name}.csv"
        head = {"title": title, "by": self.by, "plot": plot, "quantity": quantity}
        if self.renewing:
            path.write_text(_text(head, table), encoding="utf-8")
            return
        renew = f"if it is right as it is now: pytest --evidence {self.by}"
        assert path.is_file(), f"{path} is not there yet; {renew}"
        written_head, written = read_evidence(path.read_text(encoding="utf-8"))
        assert written_head == head, renew
        assert list(written) == list(table), renew
        for column, values in table.items():
            expected = [
                value if isinstance(value, str) else pytest.approx(value, rel=rel, abs=abs)
                for value in written[column]
            ]
            assert list(values) == expected, f"{name}, {column}; {renew}"


def _text(head: Mapping[str, str], table: Table) -> str:
    target = io.StringIO()
    target.writelines(f"# {key}: {value}\n" for key, value in head.items())
    rows = csv.writer(target, lineterminator="\n")
    rows.writerow(table)
    rows.writerows(
        [v if isinstance(v, str) else f"{v:.{DIGITS}g}" for v in row]
        for row in zip(*table.values(), strict=True)
    )
    return target.getvalue()
