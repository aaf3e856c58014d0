"""Which commit the native firmware was built from."""

from __future__ import annotations

from functools import lru_cache

from rig.revision import commit


@lru_cache(maxsize=1)
def firmware_revision() -> int:
    """First six hexadecimal digits of the commit as a number; 0 where it is not known."""
    try:
        return int((commit() or "0")[:6], 16)
    except ValueError:
        return 0
