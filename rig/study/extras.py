"""Packages that come with rig's extras."""

from __future__ import annotations

import importlib
from typing import Any

from rig.study.errors import StudyError


def package(name: str, extra: str) -> Any:
    """The module `name`; raises StudyError that names the extra where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise StudyError(
            f"{name} is not installed; install rig with its extra '{extra}': "
            f"pip install 'rig[{extra}]'."
        ) from None
