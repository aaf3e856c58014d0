"""Rigid obstacles as signed distances: plane, cylinder, sphere; what contact needs of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Distance(NamedTuple):
    """An obstacle seen from points (n, dim) of space."""

    gap: Array
    """Distance from the surface in m, negative inside, (n,)."""
    normal: Array
    """Its gradient: away from the obstacle, of unit length, (n, dim)."""
    curvature: Array
    """Its second derivative in 1/m, (n, dim, dim)."""


class Obstacle(Protocol):
    """Anything rigid with a signed distance."""

    def distance(self, points: Array, /) -> Distance:
        """The obstacle as seen from points (n, dim) in m."""
        ...


@dataclass(frozen=True)
class Plane:
    """The half space behind a plane, in two or three dimensions."""

    point: Sequence[float]
    """Some point of the plane in m."""
    normal: Sequence[float]
    """Out of the obstacle; of any length."""

    def distance(self, points: Array, /) -> Distance:
        """Flat: no curvature."""
        n = np.asarray(self.normal, dtype=float)
        n = n / np.linalg.norm(n)
        gap = (points - np.asarray(self.point)) @ n
        dim = points.shape[1]
        return Distance(gap, np.broadcast_to(n, points.shape), np.zeros((len(points), dim, dim)))


@dataclass(frozen=True)
class Sphere:
    """A ball; in the plane a disc, in axisymmetry a ball with its centre on the axis."""

    centre: Sequence[float]
    """In m."""
    radius: float
    """In m."""

    def distance(self, points: Array, /) -> Distance:
        """Not defined at the centre itself."""
        return _round(points - np.asarray(self.centre), np.eye(points.shape[1]), self.radius)


@dataclass(frozen=True)
class Cylinder:
    """An endless cylinder in space. In plane strain it is a `Sphere`: a disc."""

    point: Sequence[float]
    """Some point of its axis in m."""
    axis: Sequence[float]
    """Along it; of any length."""
    radius: float
    """In m."""

    def distance(self, points: Array, /) -> Distance:
        """Not defined on the axis itself."""
        along = np.asarray(self.axis, dtype=float)
        along = along / np.linalg.norm(along)
        across = np.eye(3) - np.outer(along, along)
        return _round((points - np.asarray(self.point)) @ across, across, self.radius)


def _round(arm: Array, across: Array, radius: float) -> Distance:
    length = np.linalg.norm(arm, axis=1)
    n = arm / length[:, None]
    curvature = (across - n[:, :, None] * n[:, None, :]) / length[:, None, None]
    return Distance(length - radius, n, curvature)
