"""The state of a finite element model: immutable, so that a failed step costs nothing to undo."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.rotation import rotation_vector

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PointState:
    """Unknowns of one solid that are eliminated before the global system is solved."""

    pressure: Array
    """Coefficients of discontinuous pressures in Pa, (elements, m); m = 0 where continuous."""
    strain: Array | None = None
    """Independent right Cauchy-Green tensor at quadrature points, (3, 3, elements, q); None
    where strain and stress follow from the displacements."""
    stress: Array | None = None
    """Independent second Piola-Kirchhoff stress in Pa, (3, 3, elements, q), with `strain`."""
    history: Array | None = None
    """What a flowing material went through up to the last accepted step, (components, elements,
    q), in its own terms; None of others."""


@dataclass(frozen=True)
class Pose:
    """Where a rigid body is: its reference point moved by `shift`, turned by `rotation`."""

    shift: Array = field(default_factory=lambda: np.zeros(3))
    """Displacement of the reference point in m, (3,)."""
    rotation: Array = field(default_factory=lambda: np.eye(3))
    """Rotation matrix, (3, 3)."""
    turn: Array | None = None
    """All spins that led there added up in rad, (3,); None for the rotation's own vector."""

    @property
    def angles(self) -> Array:
        """Rotation vector in rad, (3,), past half a turn, too, where it turned about one axis."""
        return rotation_vector(self.rotation) if self.turn is None else self.turn


@dataclass(frozen=True)
class State:
    """Everything that a step starts from and ends with."""

    x: Array
    """Displacements in m and continuous pressures in Pa, (n,)."""
    points: tuple[PointState, ...]
    """One for each solid."""
    poses: tuple[Pose, ...] = ()
    """One for each rigid body."""
    memories: tuple[Array, ...] = ()
    """What each interface knows of the path up to the last accepted step, in its own terms."""
    pressure: float = 0.0
    """Pressure of the cavity in Pa."""
    dead: float = 0.0
    """Factor on dead loads: gravity, tractions."""
    motion: float = 0.0
    """Factor on prescribed displacements."""

    def with_x(self, x: Array) -> State:
        """The same with other displacements."""
        return replace(self, x=x)
