"""What an experiment needs of a bench, real or simulated; how it keeps people informed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol

from rig.experiment.plan import Plan
from rig.experiment.program import TrialPlan
from rig.link.bus import FrameBus
from rig.record.documents import PartDocument, PointDocument, PointKey

Fixture = Literal["free", "blocked", "plugged"]
"""Tip free, tip against the load cell, or a plug in the tube instead of the actuator."""


class Camera(Protocol):
    """A camera on the side view."""

    def grab(self) -> tuple[float, bytes]:
        """Bench time in seconds and the JPEG of a frame taken now."""
        ...


class Bench(Protocol):
    """A bench, opened."""

    @property
    def bus(self) -> FrameBus:
        """The link to the board; bench time lives here."""
        ...

    @property
    def camera(self) -> Camera:
        """The camera on the side view."""
        ...

    def mount(self, fixture: Fixture) -> None:
        """Arrange the bench as `fixture` says; on a real bench, ask a person to."""
        ...

    def close(self) -> None:
        """Release everything."""
        ...


class Observer(Protocol):
    """Somebody who watches a run."""

    def began(self, plan: Plan, trials: Sequence[TrialPlan], done: int) -> None:
        """The run begins; `done` points and parts are there already."""
        ...

    def stage(self, text: str) -> None:
        """A step outside the points, as homing."""
        ...

    def warned(self, text: str) -> None:
        """Something is wrong, but the run goes on."""
        ...

    def point_began(self, key: PointKey) -> None:
        """A set-point was sent."""
        ...

    def point_done(self, point: PointDocument) -> None:
        """A point is safely on disk."""
        ...

    def part_done(self, part: PartDocument) -> None:
        """A part of a trial is safely on disk."""
        ...


class Nobody:
    """An observer that looks away."""

    def began(self, plan: Plan, trials: Sequence[TrialPlan], done: int) -> None:
        """Ignore."""

    def stage(self, text: str) -> None:
        """Ignore."""

    def warned(self, text: str) -> None:
        """Ignore."""

    def point_began(self, key: PointKey) -> None:
        """Ignore."""

    def point_done(self, point: PointDocument) -> None:
        """Ignore."""

    def part_done(self, part: PartDocument) -> None:
        """Ignore."""
