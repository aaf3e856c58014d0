"""Measurements as rows: the columns that `rig measure` promises to scripts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Column:
    """A number that a frame gives."""

    name: str
    """In files, with its unit."""
    heading: str
    """On the terminal."""
    unit: str
    shown: int
    """Decimals on the terminal."""
    kept: int
    """Decimals in files."""


ANGLE = (
    Column("angle_deg", "angle", "deg", 2, 4),
    Column("u95_deg", "u95", "deg", 2, 4),
    Column("quality", "quality", "", 2, 3),
)
DISPLACEMENT = (
    Column("displacement_mm", "displacement", "mm", 3, 5),
    Column("u95_mm", "u95", "mm", 3, 5),
)
BACKBONE = (
    Column("bend_angle_deg", "bend angle", "deg", 2, 4),
    Column("u95_bend_angle_deg", "u95", "deg", 2, 4),
    Column("radius_mm", "radius", "mm", 2, 4),
    Column("u95_radius_mm", "u95", "mm", 2, 4),
    Column("curvature_per_m", "curvature", "1/m", 3, 5),
    Column("u95_curvature_per_m", "u95", "1/m", 3, 5),
    Column("residual_mm", "residual", "mm", 4, 5),
    Column("u95_residual_mm", "u95", "mm", 4, 5),
)
"""Of each table the first column is the quantity, and the second its expanded uncertainty."""


def header(columns: Sequence[Column]) -> tuple[str, ...]:
    """First line of a file of rows."""
    return ("file", "frame", "time_s", *(c.name for c in columns), "accepted", "reason")


@dataclass(frozen=True)
class Row:
    """One frame, or one file that gave none (`frame` is then None)."""

    file: Path
    frame: int | None
    time_s: float | None
    values: tuple[float | None, ...]
    """By column; None where there is none."""
    accepted: bool
    reason: str

    def cells(self, columns: Sequence[Column]) -> tuple[str, ...]:
        """Text as in the CSV file: empty where there is no value."""
        return (
            str(self.file),
            "" if self.frame is None else str(self.frame),
            "" if self.time_s is None else f"{self.time_s:.6f}",
            *(
                "" if value is None else f"{value:.{column.kept}f}"
                for column, value in zip(columns, self.values, strict=True)
            ),
            "true" if self.accepted else "false",
            self.reason,
        )

    def shown(self, columns: Sequence[Column]) -> tuple[str, ...]:
        """Text of the values as on the terminal: none of what was rejected."""
        return tuple(
            "" if value is None or not self.accepted else f"{value:.{column.shown}f}"
            for column, value in zip(columns, self.values, strict=True)
        )
