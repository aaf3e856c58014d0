"""Tables that verbs write to files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from rig.errors import RigError


def write_csv(path: Path, header: Sequence[str], lines: Iterable[Sequence[str]]) -> None:
    """Write a table as CSV; raises RigError where the file cannot be written."""
    import csv

    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(header)
            writer.writerows(lines)
    except OSError as error:
        raise RigError(
            f"The table cannot be written to {path}: {error.strerror}. Name a file in an existing "
            "folder that you may write to."
        ) from None
