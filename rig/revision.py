"""Which commit this installation of rig is."""

from __future__ import annotations

import subprocess
from functools import lru_cache
from pathlib import Path

import rig

PACKAGE = Path(__file__).resolve().parent


@lru_cache(maxsize=1)
def commit() -> str | None:
    """The commit that the wheel was built from, or that is checked out; None if neither is known.

    Asks git only where the package lies in a checkout of its own: a virtual environment inside
    some other repository must not answer with that one's commit.
    """
    shipped = PACKAGE / "_library" / "REVISION"
    if shipped.is_file():
        known = shipped.read_text(encoding="ascii").strip()
        return known if known.strip("0") else None
    if not (PACKAGE.parent / ".git").exists():
        return None
    try:
        answer = subprocess.run(
            ["git", "rev-parse", "HEAD"], cwd=PACKAGE, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return answer.stdout.strip()


def version_line() -> str:
    """`rig 0.1.0 (commit 0123456789ab)`."""
    known = commit()
    return f"rig {rig.__version__} ({f'commit {known[:12]}' if known else 'commit unknown'})"
