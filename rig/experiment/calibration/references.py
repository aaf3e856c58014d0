"""References that instruments are compared with, and the bench that they are brought to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from rig.calibrate.dead_weight import Piston
from rig.calibrate.points import Row
from rig.experiment.bench import Fixture
from rig.link.bus import FrameBus

Idle = Callable[[], object]
"""To be called again and again while a person is waited for: it keeps the board's watchdog calm."""
Taken = Callable[[Row], None]
"""Told of every point as soon as it is taken."""
Stage = Callable[[str], None]
"""Told what the bench is about to do, and at the end whether it is safe."""


@dataclass(frozen=True)
class Standard:
    """What a reference is, and how well its scale is known."""

    name: str
    u: float
    """Relative standard uncertainty of its scale, common to all readings."""


class References(Protocol):
    """A reference gauge, masses and a balance beside the bench; a person on a real one.

    Each method returns when that is done; meanwhile it calls `idle`.
    """

    def gauge_kpa(self, about_kpa: float, idle: Idle) -> float:
        """What the reference gauge shows now, in kPa; about `about_kpa`."""
        ...

    def floating_g(self, piston: Piston, about_kpa: float, idle: Idle) -> float:
        """Masses in grams with which the piston of a dead-weight tester floats now.

        The bench holds about `about_kpa` meanwhile; masses are added until the piston neither rises
        nor sinks.
        """
        ...

    def place(self, mass_g: float, idle: Idle) -> None:
        """Have exactly this mass on the load cell, in grams; 0 takes everything off."""
        ...

    def fill(self, idle: Idle) -> None:
        """Have the syringe filled with water and its outlet over an empty vessel on the balance."""
        ...

    def water_g(self, idle: Idle) -> float:
        """What the balance shows now, in grams."""
        ...


class CalibrationBench(Protocol):
    """A bench, opened for calibration."""

    @property
    def bus(self) -> FrameBus:
        """The link to the board; bench time lives here."""
        ...

    @property
    def references(self) -> References:
        """What is beside the bench."""
        ...

    def mount(self, fixture: Fixture, idle: Idle) -> None:
        """Plug the tube, or free the load cell; on a real bench, ask a person to.

        Returns when that is done; meanwhile it calls `idle`.
        """
        ...

    def close(self) -> None:
        """Release everything."""
        ...
