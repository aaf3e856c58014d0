"""Readers of test data: raw files of testing machines with a block of parameters, and plain CSV.

A file is text with one table, its columns separated by semicolons, commas or tabs. The row of
headings names each quantity with its unit in brackets, as `Engineering Stress (MPa)`; above it may
stand rows of parameters, as `Specimen Cross-section (cm^2);0.18`. Force and extension are turned
into stress and stretch with the cross-section and the gauge length from there. A column `Specimen`
tells several specimens in one table apart.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.fitting.errors import FittingError, TestDataError
from rig.fitting.specimen import Array, Specimen
from rig.mechanics.hyperelastic import Mode
from rig.spec.quantity import to_si

Row = tuple[int, list[str]]
"""Line number from 1, and the cells."""

MAX_BYTES = 50_000_000
_SEPARATORS = (";", "\t", ",")
_LARGEST_STRAIN = 30.0
"""Beyond 3000 % no elastomer goes: a larger number is a percentage without its unit."""
_AGREE = 0.02
"""Engineering and true stress of one row may differ by so much more than rounding explains."""
_MAY_DISAGREE = 0.05
"""Share of rows that may."""
_BACKWARDS = 0.01
"""Of the range of strains; more is unloading, less is noise of the extensometer."""


class Measures(StrEnum):
    """Which columns to take where a file has both."""

    ENGINEERING = "engineering"
    TRUE = "true"


@dataclass(frozen=True)
class _Quantity:
    pattern: str
    si: str
    example: str


_QUANTITIES = {
    "specimen": _Quantity(r"specimen|sample", "", "Specimen"),
    "time": _Quantity(r"time", "s", "Time (s)"),
    "stretch": _Quantity(r"stretch( ratio)?|extension ratio", "", "Stretch (-)"),
    "true strain": _Quantity(r"(true|log(arithmic)?|hencky) strain", "", "True Strain (-)"),
    "strain": _Quantity(r"((engineering|nominal|tensile) )?strain", "", "Engineering Strain (%)"),
    "true stress": _Quantity(r"(true|cauchy) stress", "Pa", "True Stress (MPa)"),
    "stress": _Quantity(
        r"((engineering|nominal|tensile) )?stress", "Pa", "Engineering Stress (MPa)"
    ),
    "force": _Quantity(r"force|load", "N", "Force (N)"),
    "extension": _Quantity(r"extension|displacement|elongation", "m", "Extension (mm)"),
}
_ELONGATIONS = ("stretch", "strain", "true strain", "extension")
_LOADS = ("stress", "true stress", "force")
_NO_UNIT = {"", "-", "1", "mm/mm", "m/m"}


@dataclass(frozen=True)
class Column:
    """A recognised column: where it stands and what turns it into SI."""

    index: int
    heading: str
    factor: float


@dataclass(frozen=True)
class Table:
    """A file's parameters, columns and rows."""

    path: Path
    parameters: dict[str, tuple[str, str]]
    """Lower-case name without its unit, to unit and value as written."""
    columns: dict[str, Column]
    rows: tuple[Row, ...]

    def values(self, quantity: str) -> Array:
        """A column in SI; raises TestDataError at the line that has no finite number."""
        column = self.columns[quantity]
        return np.array([self._number(line, cells, column) for line, cells in self.rows])

    def _number(self, line: int, cells: list[str], column: Column) -> float:
        text = cells[column.index].strip() if column.index < len(cells) else ""
        try:
            value = float(text) * column.factor
        except ValueError:
            why = f"'{text}' is no number" if text else "nothing"
            if re.fullmatch(r"[+-]?\d+,\d+", text):
                why = f"'{text}' has a decimal comma; write a decimal point"
            raise TestDataError(
                f"{self.path}:{line}: {why} in the column '{column.heading}'; expected a number "
                f"in every row. Correct or delete the row."
            ) from None
        if not math.isfinite(value):
            raise TestDataError(
                f"{self.path}:{line}: '{text}' in the column '{column.heading}' is not a finite "
                f"number. Delete the row if the machine had nothing to say there."
            )
        return value

    def parameter(self, names: Iterable[str], si: str) -> float | None:
        """The first of the named parameters that there is, in SI; None if there is none."""
        for name in names:
            if name in self.parameters:
                unit, text = self.parameters[name]
                try:
                    return to_si(f"{text} {unit}".strip(), si)
                except ValueError as error:
                    raise TestDataError(
                        f"{self.path}: the parameter '{name}' is wrong: {error}."
                    ) from None
        return None


def read_specimens(
    path: Path, mode: Mode, measures: Measures | None = None
) -> tuple[Specimen, ...]:
    """The specimens in one file; `measures` None takes engineering ones where there are both.

    Raises TestDataError, with file and line, for headings or units that are missing or unknown,
    cells that are no numbers, strains that cannot be or go back and forth, parameters that
    contradict each other, and FittingError for too few points.
    """
    table = read_table(path, _ELONGATIONS, _LOADS)
    stretch, by_what = _stretch(table, measures)
    stress = _nominal_stress(table, measures, stretch)
    notes = _disagreement(table, stretch)
    wrong = np.flatnonzero(stretch <= 0)
    if wrong.size:
        raise TestDataError(
            f"{path}:{table.rows[wrong[0]][0]}: a stretch of {stretch[wrong[0]]:.4g} cannot be "
            f"({by_what}): expected lengths above 0, strains above -1. Is the unit of the strain "
            f"right?"
        )
    if float(np.max(np.abs(stretch - 1))) > _LARGEST_STRAIN:
        raise TestDataError(
            f"{path}: strains up to {np.max(stretch) - 1:.4g} ({by_what}) are beyond any "
            f"elastomer. If the column is in percent, say so in its heading: 'Strain (%)'."
        )
    material = table.parameters.get("material", ("", ""))[1]
    found = []
    for name, rows in _by_specimen(table):
        x, y, rearranged = _ascending(table, rows, stretch, stress)
        own = [f"{name}: {rearranged}"] if rearranged else []
        found.append(Specimen(name, mode, x, y, path.name, material, tuple(own)))
    whole_file = tuple(f"{path.name}: {note}" for note in notes)
    return (replace(found[0], notes=(*whole_file, *found[0].notes)), *found[1:])


def read_table(path: Path, *wanted: tuple[str, ...]) -> Table:
    """Parameters and table of a file; at least one column out of each group of `wanted`."""
    lines = _text(path).splitlines()
    for separator in _SEPARATORS:
        rows = [
            (number, [cell.strip() for cell in cells])
            for number, cells in enumerate(csv.reader(lines, delimiter=separator), 1)
        ]
        for at, (_, cells) in enumerate(rows):
            names = [_recognised(cell)[0] for cell in cells]
            if all(any(name in names for name in group) for group in wanted):
                return _assembled(path, rows[:at], rows[at], rows[at + 1 :])
    examples = " and ".join(
        " or ".join(f"'{_QUANTITIES[name].example}'" for name in group) for group in wanted
    )
    raise TestDataError(
        f"{path}: no row of headings was found; expected one that names the columns with their "
        f"units, with {examples}, separated by semicolons, commas or tabs."
    )


def _assembled(path: Path, above: list[Row], heading: Row, below: list[Row]) -> Table:
    line, cells = heading
    columns: dict[str, Column] = {}
    for index, cell in enumerate(cells):
        name, unit = _recognised(cell)
        if not name:
            continue
        if name in columns:
            raise TestDataError(
                f"{path}:{line}: the columns '{columns[name].heading}' and '{cell}' are the same "
                f"quantity; keep one, or one file for each specimen."
            )
        columns[name] = Column(index, cell, _factor(path, line, cell, name, unit))
    rows = tuple(row for row in below if any(row[1]))
    if not rows:
        raise TestDataError(f"{path}:{line}: there are headings, but no rows of data below them.")
    parameters = {}
    for _, (first, *rest) in ((n, c) for n, c in above if c and c[0]):
        name, unit = _split_heading(first)
        parameters[name] = (unit, rest[0] if rest else "")
    return Table(path, parameters, columns, rows)


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise TestDataError(f"{path}: larger than {MAX_BYTES} bytes; no tensile test is.")
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise TestDataError(f"{path}: not UTF-8 text; export the data as CSV in UTF-8.") from None
    except OSError as error:
        raise TestDataError(
            f"{path}: cannot be read: {error.strerror}; expected a text file of test data."
        ) from None


def _split_heading(cell: str) -> tuple[str, str]:
    """Lower-case name and unit of `Engineering Stress (MPa)`."""
    match = re.fullmatch(r"\s*([^(\[]*?)\s*(?:[(\[]\s*([^)\]]*?)\s*[)\]])?\s*", cell)
    if match is None:
        return cell.strip().lower(), ""
    return " ".join(match[1].replace("_", " ").lower().split()), match[2] or ""


def _recognised(cell: str) -> tuple[str, str]:
    """Name of the quantity in _QUANTITIES and unit; the name is empty for other headings."""
    name, unit = _split_heading(cell)
    for known, quantity in _QUANTITIES.items():
        if re.fullmatch(quantity.pattern, name):
            return known, unit
    return "", unit


def _factor(path: Path, line: int, cell: str, name: str, unit: str) -> float:
    quantity = _QUANTITIES[name]
    if quantity.si == "" and unit in _NO_UNIT:
        return 1.0
    if not unit:
        raise TestDataError(
            f"{path}:{line}: the column '{cell}' has no unit; expected it in brackets, as "
            f"'{quantity.example}'."
        )
    try:
        return to_si(f"1 {unit}", quantity.si)
    except ValueError as error:
        raise TestDataError(
            f"{path}:{line}: the column '{cell}': {error}; expected a heading as "
            f"'{quantity.example}'."
        ) from None


def _nominal_stress(table: Table, measures: Measures | None, stretch: Array) -> Array:
    columns = table.columns
    true_first = measures is Measures.TRUE
    order = ("true stress", "stress") if true_first else ("stress", "true stress")
    chosen = next((name for name in (*order, "force") if name in columns), "force")
    if true_first and chosen != "true stress":
        raise TestDataError(
            f"{table.path}: true measures were asked for, but there is no column "
            f"'{_QUANTITIES['true stress'].example}'."
        )
    values = table.values(chosen)
    if chosen == "stress":
        return values
    if chosen == "true stress":
        return values / stretch  # the volume is kept: area shrinks by the stretch
    return values / _cross_section(table)


def _stretch(table: Table, measures: Measures | None) -> tuple[Array, str]:
    order = ["stretch", "strain", "true strain", "extension"]
    if measures is Measures.TRUE:
        order = ["true strain"]
    chosen = next((name for name in order if name in table.columns), None)
    if chosen is None:
        raise TestDataError(
            f"{table.path}: true measures were asked for, but there is no column "
            f"'{_QUANTITIES['true strain'].example}'."
        )
    values, heading = table.values(chosen), f"column '{table.columns[chosen].heading}'"
    match chosen:
        case "stretch":
            return values, heading
        case "strain":
            return 1 + values, heading
        case "true strain":
            return np.exp(np.minimum(values, 50.0)), heading
    length = table.parameter(("gauge length", "specimen length", "length"), "m")
    if length is None or length <= 0:
        raise TestDataError(
            f"{table.path}: there is an extension, but no strain: expected the length at rest "
            f"above the table, as 'Gauge Length (mm);33'."
        )
    return 1 + values / length, heading


def _cross_section(table: Table) -> float:
    thickness = table.parameter(("specimen thickness", "thickness"), "m")
    width = table.parameter(("specimen width", "width"), "m")
    area = table.parameter(
        ("specimen cross-section", "cross-section", "cross section", "area"), "m**2"
    )
    product = thickness * width if thickness is not None and width is not None else None
    if area is not None and product is not None and abs(area - product) > 0.02 * product:
        raise TestDataError(
            f"{table.path}: a cross-section of {area * 1e6:.4g} mm2 contradicts thickness times "
            f"width, {product * 1e6:.4g} mm2. Are their units right?"
        )
    result = area if area is not None else product
    if result is None or result <= 0:
        raise TestDataError(
            f"{table.path}: there is a force, but no stress: expected the area at rest above the "
            f"table, as 'Specimen Cross-section (mm^2);18'."
        )
    return result


def _disagreement(table: Table, stretch: Array) -> list[str]:
    """What to tell of a file whose engineering and true stresses are not those of one test."""
    if not {"stress", "true stress"} <= table.columns.keys():
        return []
    nominal, true = table.values("stress"), table.values("true stress")
    slack = 1e-5 * float(np.max(np.abs(true)))
    odd = np.abs(nominal * stretch - true) > _AGREE * np.abs(true) + slack
    if odd.mean() > _MAY_DISAGREE:
        line = table.rows[int(np.argmax(odd))][0]
        raise TestDataError(
            f"{table.path}:{line}: engineering and true stress are not those of one test: "
            f"{nominal[odd][0]:.4g} Pa at a stretch of {stretch[odd][0]:.4g} is a true stress of "
            f"{(nominal * stretch)[odd][0]:.4g} Pa, the file says {true[odd][0]:.4g} Pa, and so "
            f"in {int(odd.sum())} of {odd.size} rows. Are the units of the two columns mixed up?"
        )
    if not odd.any():
        return []
    lines = ", ".join(str(table.rows[i][0]) for i in np.flatnonzero(odd)[:5])
    return [f"engineering and true stress disagree in {int(odd.sum())} rows (line {lines})."]


def _by_specimen(table: Table) -> Iterator[tuple[str, NDArray[np.intp]]]:
    stem = table.path.stem
    column = table.columns.get("specimen")
    if column is None:
        yield stem, np.arange(len(table.rows))
        return
    names = np.array(
        [cells[column.index] if column.index < len(cells) else "" for _, cells in table.rows]
    )
    for name in dict.fromkeys(names.tolist()):
        if not name:
            line = table.rows[int(np.argmax(names == ""))][0]
            raise TestDataError(
                f"{table.path}:{line}: nothing in the column '{column.heading}'; expected the name "
                f"of the specimen in every row."
            )
        yield f"{stem} {name}", np.flatnonzero(names == name)


def _ascending(
    table: Table, rows: NDArray[np.intp], stretch: Array, stress: Array
) -> tuple[Array, Array, str]:
    """Stretch and stress of one specimen, sorted; a note if that changed anything."""
    x, y = stretch[rows], stress[rows]
    back = np.maximum.accumulate(x) - x
    limit = _BACKWARDS * float(np.ptp(x))
    if np.any(back > limit):
        at = int(np.argmax(back > limit))
        raise TestDataError(
            f"{table.path}:{table.rows[rows[at]][0]}: the strain goes back by {back[at]:.4g}; "
            f"expected one loading. Cut the file to its loading, or give each specimen a name in "
            f"a column 'Specimen'."
        )
    order = np.argsort(x, kind="stable")
    moved = int(np.sum(order != np.arange(x.size)))
    note = f"{moved} rows were sorted by strain." if moved else ""
    if np.ptp(x) == 0:
        raise FittingError(f"{table.path}: all strains are the same; there is no curve.")
    return x[order], y[order], note
