"""What is wrong with a file, all of it at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rig.errors import RigError


@dataclass(frozen=True)
class Problem:
    """One thing wrong at one place of one file."""

    path: Path
    message: str
    """What was wrong and what was expected."""
    field: str = ""
    """Dotted path inside the file, as `geometry.wall_thickness`; empty for the whole file."""
    line: int | None = None
    """From 1; None where there is no place, as for a missing file."""
    column: int | None = None

    def __str__(self) -> str:
        place = str(self.path)
        if self.line is not None:
            place += f":{self.line}:{self.column}"
        field = f" {self.field}:" if self.field else ""
        return f"{place}:{field} {self.message}"


class SpecError(RigError):
    """One or more problems in specs; `str` has one line for each."""

    exit_code = 2

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))
