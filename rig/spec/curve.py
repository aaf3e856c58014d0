"""Set-points over time, given in a protocol or in a CSV file beside it.

The CSV has a header, `time_s,pressure_kpa` or `time_s,volume_ml`, and one line for each corner of a
broken line, in ascending time from 0.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from io import StringIO
from pathlib import Path

from pydantic import Field, model_validator

from rig.spec.base import SpecModel, require
from rig.spec.errors import Problem, SpecError
from rig.spec.quantity import Duration, Pressure, Volume

MAX_CORNERS = 10_000
HEADERS = {"pressure_kpa": "pressures", "volume_ml": "volumes"}
"""Second column of the CSV, and the field of `Curve` that it fills."""


class Curve(SpecModel):
    """A broken line of pressures or of plunger volumes; `file` stands for the CSV that has it."""

    file: str | None = Field(None, description="CSV beside the protocol, instead of corners")
    times: tuple[Duration, ...] = Field(
        (), max_length=MAX_CORNERS, description="of the corners, ascending from 0"
    )
    pressures: tuple[Pressure, ...] = Field(
        (),
        max_length=MAX_CORNERS,
        description="gauge pressure at each time; empty for a curve of volumes",
    )
    volumes: tuple[Volume, ...] = Field(
        (),
        max_length=MAX_CORNERS,
        description="of the plunger at each time; empty for a curve of pressures",
    )

    @model_validator(mode="after")
    def _one_broken_line(self) -> Curve:
        if self.file is not None:
            inline = self.times or self.pressures or self.volumes
            require(not inline, "both a file and corners are given; expected one of them")
            return self
        require(
            bool(self.pressures) != bool(self.volumes),
            "expected 'file', or 'times' with either 'pressures' or 'volumes'",
        )
        count = len(self.pressures) + len(self.volumes)
        require(
            len(self.times) == count >= 2,
            f"there are {len(self.times)} times and {count} values; expected as many, at least two",
        )
        ascending = all(b > a for a, b in zip(self.times, self.times[1:], strict=False))
        require(ascending and self.times[0] == 0, "expected times that ascend from 0 s")
        require(min(*self.pressures, *self.volumes) >= 0, "expected no value below zero")
        return self


def read_curve(path: Path) -> Curve:
    """The curve in a CSV file; raises SpecError that names the first line that is wrong."""

    def wrong(line: int, message: str) -> SpecError:
        return SpecError([Problem(path, message, line=line, column=1)])

    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = f"cannot be read: {error}; expected a CSV of set-points"
        raise SpecError([Problem(path, why)]) from error
    rows = csv.reader(StringIO(text))
    header = [name.strip() for name in next(rows, [])]
    if len(header) != 2 or header[0] != "time_s" or header[1] not in HEADERS:
        raise wrong(
            1,
            f"the header is '{','.join(header)}'; expected time_s,pressure_kpa or time_s,volume_ml",
        )
    scale = 1e3 if header[1] == "pressure_kpa" else 1e-6
    times: list[float] = []
    values: list[float] = []
    for row in rows:
        line = rows.line_num
        if not any(cell.strip() for cell in row):
            continue
        time_s, value = _numbers(row, wrong, line)
        if (time_s <= times[-1]) if times else (time_s != 0):
            raise wrong(line, f"the time is {time_s:g} s; expected times that ascend from 0 s")
        if value < 0:
            raise wrong(line, f"{header[1]} is {value:g}; expected no value below zero")
        if len(times) == MAX_CORNERS:
            raise wrong(line, f"expected at most {MAX_CORNERS} lines of set-points")
        times.append(time_s)
        values.append(value * scale)
    if len(times) < 2:
        raise wrong(rows.line_num, f"there are {len(times)} set-points; expected at least two")
    return Curve.model_validate({"times": times, HEADERS[header[1]]: _texts(header[1], values)})


def _numbers(
    row: list[str], wrong: Callable[[int, str], SpecError], line: int
) -> tuple[float, float]:
    if len(row) != 2:
        raise wrong(line, f"there are {len(row)} columns; expected 2")
    try:
        numbers = float(row[0]), float(row[1])
    except ValueError:
        raise wrong(line, f"'{','.join(row)}' is no pair of numbers; expected as 1.5,4.2") from None
    if not all(map(math.isfinite, numbers)):
        raise wrong(line, f"'{','.join(row)}' is not finite; expected as 1.5,4.2")
    return numbers


def _texts(header: str, values: list[float]) -> list[str]:
    unit = "Pa" if header == "pressure_kpa" else "m**3"
    return [f"{value!r} {unit}" for value in values]
