"""What the finite element models need to know of the shape of an actuator that bends."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.mesh.curved import CurvedHex, CurvedTet

Array = NDArray[np.float64]


class BendingShape(Protocol):
    """Dimensions in metres: x along the axis, z up from the side that bending shortens."""

    @property
    def start(self) -> float:
        """x of the clamped face."""
        ...

    @property
    def end(self) -> float:
        """x where the rigid cap begins."""
        ...

    @property
    def tip(self) -> float:
        """x of the cap's far face."""
        ...

    @property
    def underside(self) -> float:
        """z of the side that bending shortens."""
        ...

    @property
    def half_width(self) -> float:
        """Half of the underside's width."""
        ...

    @property
    def fibre_distance(self) -> float:
        """Between the underside and the fibre whose elongation is the displacement."""
        ...

    @property
    def wall(self) -> float:
        """Thinnest wall."""
        ...

    @property
    def gap(self) -> float:
        """Between facing outsides of neighbouring folds at rest, 0 without folds."""
        ...

    @property
    def cap_centre(self) -> Array:
        """Centre of mass of the cap, (3,)."""
        ...

    def cap_mass(self, density: float) -> float:
        """In kg, `density` of its material in kg/m3."""
        ...


class BendingBody(Protocol):
    """Half of the soft body, y >= 0, meshed."""

    @property
    def mesh(self) -> CurvedHex | CurvedTet:
        """With the boundaries `clamped`, `cap`, `symmetry`, `cavity` and `outside`."""
        ...

    @property
    def shape(self) -> BendingShape:
        """Its dimensions."""
        ...
