"""Which commit the native firmware was built from."""

from __future__ import annotations

import subprocess
from functools import lru_cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]


@lru_cache(maxsize=1)
def firmware_revision() -> int:
    """First six hexadecimal digits of the commit as a number; 0 where it is not known."""
    shipped = PACKAGE / "_library" / "REVISION"
    if shipped.is_file():
        return _number(shipped.read_text(encoding="ascii"))
    try:
        answer = subprocess.run(
            ["git", "rev-parse", "HEAD"],
            cwd=PACKAGE,
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return 0
    return _number(answer.stdout)


def _number(commit: str) -> int:
    try:
        return int(commit.strip()[:6], 16)
    except ValueError:
        return 0
