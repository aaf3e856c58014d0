"""Measurements as rows: the columns that `rig measure` promises to scripts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rig.vision.measure import AngleMeasurement

COLUMNS = ("file", "frame", "time_s", "angle_deg", "u95_deg", "quality", "accepted", "reason")
COVERAGE_FACTOR = 2.0  # expanded uncertainty for about 95 % (GUM)


@dataclass(frozen=True)
class Row:
    """One frame, or one file that gave none (`frame` is then None)."""

    file: Path
    frame: int | None
    time_s: float | None
    angle_deg: float | None
    u95_deg: float | None
    quality: float
    accepted: bool
    reason: str

    def cells(self) -> tuple[str, ...]:
        """Text of the columns, as in the CSV file: empty where there is no value."""
        return (
            str(self.file),
            "" if self.frame is None else str(self.frame),
            "" if self.time_s is None else f"{self.time_s:.6f}",
            "" if self.angle_deg is None else f"{self.angle_deg:.4f}",
            "" if self.u95_deg is None else f"{self.u95_deg:.4f}",
            f"{self.quality:.3f}",
            "true" if self.accepted else "false",
            self.reason,
        )


def row_of(
    file: Path, frame: int | None, time_s: float | None, measurement: AngleMeasurement
) -> Row:
    """The row of a measured frame."""
    return Row(
        file,
        frame,
        time_s,
        measurement.angle_deg,
        COVERAGE_FACTOR * measurement.u_deg if measurement.accepted else None,
        measurement.quality,
        measurement.accepted,
        measurement.reason,
    )


def unreadable_row(file: Path, reason: str) -> Row:
    """The row of a file that gave no frame."""
    return Row(file, None, None, None, None, 0.0, False, reason)
