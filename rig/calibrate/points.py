"""Points of a calibration as tables: what is kept while they are taken, and read back for a fit."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.calibrate.errors import CalibrateError
from rig.spec.student import widening

Array = NDArray[np.float64]
Row = dict[str, float | str]
"""Numbers by column; `kind` says what kind of point it is."""


def of_kind(rows: Sequence[Row], *kinds: str) -> list[Row]:
    """Rows whose kind is one of `kinds`."""
    return [row for row in rows if row["kind"] in kinds]


def column(rows: Sequence[Row], name: str) -> Array:
    """A column as numbers (n,)."""
    return np.array([float(row[name]) for row in rows], dtype=np.float64)


def table(
    rows: Sequence[Row], columns: Sequence[str], kinds: Sequence[str]
) -> tuple[tuple[float, ...], ...]:
    """Rows as evidence of a calibration keeps them: 1 under its kind, 0 else, then the numbers."""
    return tuple(
        (
            *(float(row["kind"] == kind) for kind in kinds),
            *(float(row[name]) for name in columns),
        )
        for row in rows
    )


def read_points(path: Path, columns: Sequence[str]) -> list[Row]:
    """Rows of a CSV file with a column `kind` and numbers in `columns`; empty cells count as 0.

    Raises CalibrateError that names the line.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise CalibrateError(f"{path}: cannot be read as text: {error}") from None
    reader = csv.DictReader(StringIO(text))
    missing = [name for name in ("kind", *columns) if name not in (reader.fieldnames or ())]
    if missing:
        raise CalibrateError(
            f"{path}: the column {' and '.join(missing)} is missing; expected the header "
            f"{','.join(('kind', *columns))}."
        )
    rows: list[Row] = []
    for line, cells in enumerate(reader, start=2):
        row: Row = {"kind": (cells["kind"] or "").strip()}
        for name in columns:
            try:
                value = float(cells[name] or 0)
            except ValueError:
                value = float("nan")
            if not np.isfinite(value):
                raise CalibrateError(
                    f"{path}, line {line}: {name} is '{cells[name]}'; expected a number."
                )
            row[name] = value
        rows.append(row)
    return rows


def above_zero(rows: Sequence[Row], name: str) -> tuple[Array, float]:
    """Readings of the loaded points (n,) above the zero, and how far a zero moves, in their unit.

    `rows` are points of kind zero, up and down in the order of time; the zero between two zeros is
    interpolated. The second value is the standard uncertainty of a zero that was found one cycle
    earlier. Raises CalibrateError if there is no zero.
    """
    readings = column(rows, name)
    empty = np.array([row["kind"] == "zero" for row in rows], dtype=bool)
    if not empty.any():
        raise CalibrateError(
            "no reading of the unloaded instrument is among the points; give at least one row of "
            "kind zero."
        )
    order = np.arange(len(rows), dtype=np.float64)
    zero = np.interp(order[~empty], order[empty], readings[empty])
    return readings[~empty] - zero, root_mean_square_widened(np.diff(readings[empty]))


def root_mean_square_widened(values: Array) -> float:
    """Standard uncertainty from a few departures from zero, widened as `LinearFit.u` is."""
    if values.size == 0:
        return 0.0
    return widening(values.size) * float(np.sqrt(np.mean(values**2)))
