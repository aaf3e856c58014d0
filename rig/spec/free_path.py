"""Names for what must not overwrite anything."""

from __future__ import annotations

from itertools import count
from pathlib import Path


def first_free(path: Path, suffix: str = "") -> Path:
    """`path` with `suffix`, or with -2, -3, ... before it: the first that is not there yet."""
    names = (f"{path.name}{'' if n == 1 else f'-{n}'}{suffix}" for n in count(1))
    return next(free for name in names if not (free := path.with_name(name)).exists())
