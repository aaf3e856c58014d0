"""Files of the workspace, and of nowhere else."""

from __future__ import annotations

from pathlib import Path

from rig.studio.errors import StudioError


def inside(root: Path, *parts: str) -> Path:
    """The file or folder `parts` beneath `root`, links followed; raises StudioError otherwise."""
    try:
        path = root.joinpath(*parts).resolve()
        found = path.is_relative_to(root.resolve()) and path.exists()
    except (OSError, ValueError):  # a name that no file system takes
        found = False
    if not found:
        raise StudioError(f"'{'/'.join(parts)[:80]}' is not there in this workspace.")
    return path
