"""A run's points, deformations and pressure as CSV tables; units stand in them."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from rig.record.errors import RecordError
from rig.record.reader import RunReader

TRACE_PERIOD_S = 0.5
"""Pressure is given as mean, least and largest of pieces this long; the log has every sample."""
KEY_COLUMNS = ("experiment", "repeat", "direction", "target_kpa")


def write_tables(reader: RunReader, folder: Path) -> tuple[Path, ...]:
    """Write points.csv, deformations.csv, pressure.csv, and looks.csv if there were trials.

    Returns their paths.

    Raises RecordError if the folder cannot be written.
    """
    looks = ((folder / "looks.csv", LOOK_COLUMNS, _looks(reader)),) if reader.parts() else ()
    return (
        _write(folder / "points.csv", POINT_COLUMNS, _points(reader)),
        _write(folder / "deformations.csv", DEFORMATION_COLUMNS, _deformations(reader)),
        _write(folder / "pressure.csv", PRESSURE_COLUMNS, _pressure(reader)),
        *(_write(*table) for table in looks),
    )


POINT_COLUMNS = (
    *KEY_COLUMNS,
    "started_s",
    "settled_s",
    "measured_from_s",
    "measured_to_s",
    "pressure_kpa",
    "pressure_sd_kpa",
    "pressure_u_kpa",
    "value",
    "value_sd",
    "value_u",
    "unit",
    "readings",
    "rejected",
)
DEFORMATION_COLUMNS = (
    *KEY_COLUMNS,
    *("frame", "value", "u", "unit", "quality", "accepted", "reason"),
)
LOOK_COLUMNS = (
    *("trial", "kind", "repeat", "part", "time_s", "pressure_kpa", "plunger_ml"),
    *("value", "u", "unit", "accepted", "reason"),
)
PRESSURE_COLUMNS = ("time_s", "pressure_mean_kpa", "pressure_min_kpa", "pressure_max_kpa")


def _points(reader: RunReader) -> Iterable[Sequence[object]]:
    for p in reader.points():
        yield (
            *(p.key.experiment, p.key.repeat, p.key.direction, p.key.target_kpa),
            *(_time(p.started_s), _time(p.settled_s)),
            *(_time(p.measured_from_s), _time(p.measured_to_s)),
            *(_number(p.pressure_kpa), _number(p.pressure_sd_kpa), _number(p.pressure_u_kpa)),
            *(_number(p.value), _number(p.value_sd), _number(p.value_u)),
            *(p.unit, p.readings, "; ".join(p.rejected)),
        )


def _deformations(reader: RunReader) -> Iterable[Sequence[object]]:
    for r in reader.deformation_readings():
        yield (
            *(r.key.experiment, r.key.repeat, r.key.direction, r.key.target_kpa),
            *(r.frame, _number(r.value), _number(r.u), r.unit, _number(r.quality)),
            *(r.accepted, r.reason),
        )


def _looks(reader: RunReader) -> Iterable[Sequence[object]]:
    """Deformations of trials with pressure and plunger (from where the part began) at that time."""
    pressure = reader.telemetry("PRESSURE")
    parts = {part.key: part for part in reader.parts()}
    for look in reader.looks():
        part = parts.get(look.key)
        if part is None:  # of a part that was not completed
            continue
        now_s = part.from_s + look.time_s
        kpa = float(np.interp(now_s, pressure["time_s"], pressure["pressure_kpa"]))
        ml = float(np.interp(now_s, pressure["time_s"], pressure["plunger_ml"]))
        yield (
            *(look.key.trial, look.key.kind, look.key.repeat, look.key.part, _time(look.time_s)),
            *(_number(kpa), _number(ml - part.plunger_from_ml)),
            *(_number(look.value), _number(look.u), look.unit, look.accepted, look.reason),
        )


def _pressure(reader: RunReader) -> Iterable[Sequence[object]]:
    telemetry = reader.telemetry("PRESSURE")
    time_s = telemetry["time_s"]
    if not time_s.size:
        return
    order = np.argsort(time_s, kind="stable")
    piece = np.floor(time_s[order] / TRACE_PERIOD_S).astype(np.int64)
    starts = np.flatnonzero(np.diff(piece, prepend=piece[0] - 1))
    pressure = telemetry["pressure_kpa"][order]
    counts = np.diff(np.append(starts, piece.size))
    means = np.add.reduceat(pressure, starts) / counts
    low, high = np.minimum.reduceat(pressure, starts), np.maximum.reduceat(pressure, starts)
    for row in zip(piece[starts] * TRACE_PERIOD_S, means, low, high, strict=True):
        yield (f"{row[0]:.1f}", *(f"{value:.4f}" for value in row[1:]))


def _time(seconds: float | None) -> str:
    return "" if seconds is None else f"{seconds:.3f}"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"


def _write(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> Path:
    try:
        with path.open("w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(header)
            writer.writerows(rows)
    except OSError as error:
        raise RecordError(f"{path}: the table cannot be written: {error.strerror}.") from error
    return path
