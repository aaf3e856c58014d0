"""What drives a step: the pressure itself, or a quantity for which the pressure is unknown.

With the volume or a displacement prescribed, the pressure follows from equilibrium and may fall:
limit points are passed (Batoz & Dhatt, Int. J. Numer. Methods Eng. 14 (1979) 1262).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.model import Assembly, Model
from rig.mechanics.fe.state import State

Array = NDArray[np.float64]


class Situation(NamedTuple):
    """Where a controlled quantity is asked for."""

    model: Model
    state: State
    assembly: Assembly


@dataclass(frozen=True)
class Slope:
    """Derivatives of a controlled quantity."""

    x: Array
    """By the displacements, (n,)."""
    freedoms: Array
    """By the freedoms of rigid bodies beyond what their nodes' displacements say."""
    pressure: float
    """By the pressure, per Pa."""


class Control(Protocol):
    """A quantity that takes prescribed values."""

    @property
    def name(self) -> str:
        """What it is called."""
        ...

    @property
    def unit(self) -> str:
        """Its unit."""
        ...

    def value(self, at: Situation, /) -> float:
        """Its value at a at.state."""
        ...

    def slope(self, at: Situation, /) -> Slope | None:
        """Its derivatives; None where it is the pressure itself."""
        ...


@dataclass(frozen=True)
class PressureControl:
    """The pressure of the cavity in Pa."""

    name: str = "pressure"
    unit: str = "Pa"

    def value(self, at: Situation, /) -> float:
        """The pressure in Pa."""
        return at.state.pressure

    def slope(self, _at: Situation, /) -> None:
        """No unknown pressure."""
        return


@dataclass(frozen=True)
class VolumeControl:
    """The volume of the cavity in m3."""

    name: str = "volume"
    unit: str = "m3"

    def value(self, at: Situation, /) -> float:
        """The volume in m3."""
        return at.assembly.volume

    def slope(self, at: Situation, /) -> Slope:
        """Its derivative by the displacements."""
        return Slope(at.assembly.volume_slope, np.zeros(at.model.body_size), 0.0)


@dataclass(frozen=True)
class DisplacementControl:
    """A weighted sum of displacements in m: the degrees of freedom `dofs` times `weights`."""

    dofs: tuple[int, ...]
    weights: tuple[float, ...] = (1.0,)
    name: str = "displacement"
    unit: str = "m"

    def value(self, at: Situation, /) -> float:
        """The sum in m."""
        return float(np.dot(at.state.x[list(self.dofs)], self.weights))

    def slope(self, at: Situation, /) -> Slope:
        """The weights."""
        x = np.zeros(at.model.size)
        np.add.at(x, list(self.dofs), self.weights)
        return Slope(x, np.zeros(at.model.body_size), 0.0)


@dataclass(frozen=True)
class AngleControl:
    """The rotation in rad of one rigid body about one axis."""

    motion: str = "about_y"
    body: int = 0
    name: str = "angle"
    unit: str = "rad"

    def value(self, at: Situation, /) -> float:
        """The component of the rotation vector in rad."""
        angles = at.state.poses[self.body].angles
        return float(angles[("about_x", "about_y", "about_z").index(self.motion)])

    def slope(self, at: Situation, /) -> Slope:
        """One for the spin about the axis: exact while the body turns about that axis only."""
        freedoms = np.zeros(at.model.body_size)
        before = sum(b.size for b in at.model.bodies[: self.body])
        freedoms[before + at.model.bodies[self.body].free.index(self.motion)] = 1.0
        return Slope(np.zeros(at.model.size), freedoms, 0.0)
