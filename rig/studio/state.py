"""What all pages of one server share."""

from __future__ import annotations

import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rig.spec.workspace import Workspace
from rig.studio.calculation import Calculation
from rig.studio.desk import Desk
from rig.studio.errors import StudioError
from rig.studio.replay import Replays
from rig.studio.seat import Seat
from rig.studio.works import report

MOST_CALCULATIONS = 2
MOST_VIEWS = 12
"""Computed pages that are kept; the oldest goes first."""


class Workshop:
    """Starts long work, not too much at once."""

    def __init__(self) -> None:
        self._running: list[Calculation] = []

    def start(self, work: Callable[..., Any], *arguments: Any) -> Calculation:
        """Begin; raises StudioError while enough is being computed."""
        self._running = [c for c in self._running if c.poll() == "running"]
        if len(self._running) >= MOST_CALCULATIONS:
            raise StudioError(
                f"{MOST_CALCULATIONS} calculations are going on already: wait for one or cancel it."
            )
        calculation = Calculation(work, *arguments)
        self._running.append(calculation)
        return calculation

    def close(self) -> None:
        """End everything."""
        for calculation in self._running:
            calculation.close()


class Views:
    """HTML pages that were computed, under addresses that nobody guesses."""

    def __init__(self) -> None:
        self._pages: OrderedDict[str, str] = OrderedDict()

    def keep(self, page: str) -> str:
        """Returns the address."""
        key = secrets.token_urlsafe(12)
        self._pages[key] = page
        while len(self._pages) > MOST_VIEWS:
            self._pages.popitem(last=False)
        return f"/views/{key}"

    def page(self, key: str) -> str | None:
        """The page of a key; None if it is gone."""
        return self._pages.get(key)


@dataclass(frozen=True)
class Studio:
    """One workspace, seen by several browsers."""

    workspace: Workspace
    workshop: Workshop = field(default_factory=Workshop)
    views: Views = field(default_factory=Views)
    replays: Replays = field(default_factory=Replays)
    desk: Desk = field(init=False)

    def __post_init__(self) -> None:
        desk = Desk(self.workspace, Seat(time.monotonic), self._report)
        object.__setattr__(self, "desk", desk)

    def _report(self, folder: Path) -> None:
        self.workshop.start(report, folder)

    def close(self) -> None:
        """Leave nothing running and nothing under pressure."""
        self.desk.close()
        self.workshop.close()
