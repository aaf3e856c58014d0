"""Coordinates in which the steps of Newton's method and extrapolations go straight.

A slender body that bends turns its far parts by large angles. A straight step in Cartesian
coordinates stretches them; the next iterations do little but take that back. In coordinates that
bend with the body the same step only turns them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Discretisation
from rig.mechanics.fe.rigid import RigidBody
from rig.mechanics.fe.state import Pose, State

Array = NDArray[np.float64]
Placement = tuple[Array, tuple[Pose, ...]]
"""Displacements and continuous pressures, (n,), with the poses of the rigid bodies."""

_NEARLY_STRAIGHT = 1e-4
"""Angle in rad below which quotients are replaced by their series."""


class Coordinates(Protocol):
    """How a model is moved."""

    def moved(self, state: State, dx: Array, poses: tuple[Pose, ...]) -> Placement:
        """`state` after the step `dx`, (n,), while bodies turned to `poses`, shifted linearly.

        Equal to the straight step to first order.
        """
        ...

    def blended(
        self, states: Sequence[State], weights: Array, poses: tuple[Pose, ...]
    ) -> Placement:
        """The weighted sum of states, whose weights sum to one, with bodies turned to `poses`."""
        ...


class Cartesian:
    """Straight lines in space."""

    def moved(self, state: State, dx: Array, poses: tuple[Pose, ...]) -> Placement:
        """The sum."""
        return state.x + dx, poses

    def blended(
        self, states: Sequence[State], weights: Array, poses: tuple[Pose, ...]
    ) -> Placement:
        """The weighted sum."""
        return blend(weights, [s.x for s in states]), poses


class Bending:
    """Coordinates of a body along x that its only rigid body, at the far end, bends about y.

    Its axis becomes an arc of the curvature kappa that the end's rotation says: with a = kappa s,
    the point at s along it and z above it is at

        x = x0 + s sinc(a) + z sin(a),     z' = z0 - s (1 - cos a) / a + z cos(a)

    (the bend of Barr, Comput. Graph. 18 (1984) 21, per unit of its own curvature). Steps are
    straight in (s, y, z) and kappa. Any curvature makes coordinates, so that nothing depends on how
    well an arc describes the body, but for the number of iterations.
    """

    def __init__(
        self,
        discretisation: Discretisation,
        body: RigidBody,
        start: float,
        end: float,
        height: float,
    ) -> None:
        """The axis is at z = `height`, the inner side of the bend, from x = `start` to `end`, m."""
        self._size = discretisation.displacement_size
        # the reference point of the body moves like a node
        self._reference = np.vstack((discretisation.nodes, body.centre))
        self._start, self._length, self._height = start, end - start, height

    def moved(self, state: State, dx: Array, poses: tuple[Pose, ...]) -> Placement:
        """Straight in the bent coordinates."""
        before, after = self._curvature(state.poses), self._curvature(poses)
        flat = self._flat(state, before)
        step = np.append(dx[: self._size], poses[0].shift - state.poses[0].shift).reshape(-1, 3)
        moved = self._bent(flat + self._flat_step(flat, before, step, after - before), after, poses)
        return np.concatenate((moved[0], (state.x + dx)[self._size :])), moved[1]

    def blended(
        self, states: Sequence[State], weights: Array, poses: tuple[Pose, ...]
    ) -> Placement:
        """The weighted sum of the bent coordinates."""
        flat = blend(weights, [self._flat(s, self._curvature(s.poses)) for s in states])
        x, shifted = self._bent(flat, self._curvature(poses), poses)
        return np.concatenate((x, blend(weights, [s.x[self._size :] for s in states]))), shifted

    def _curvature(self, poses: tuple[Pose, ...]) -> float:
        return float(poses[0].angles[1]) / self._length

    def _flat(self, state: State, curvature: float) -> Array:
        """(s, y, z) of all nodes and the body's reference point, (nodes + 1, 3), in m."""
        moved = self._reference + np.append(state.x[: self._size], state.poses[0].shift).reshape(
            -1, 3
        )
        along, up = moved[:, 0] - self._start, moved[:, 2] - self._height
        radius = np.hypot(1 + curvature * up, curvature * along)
        angle = np.arctan2(curvature * along, 1 + curvature * up)
        # near half a turn of the end some nodes are beyond it
        turns = curvature * (self._reference[:, 0] - self._start) - angle
        angle = angle + 2 * np.pi * np.round(turns / (2 * np.pi))
        straight = np.abs(angle) < _NEARLY_STRAIGHT**2
        s = np.where(straight, along / (1 + curvature * up), angle / (curvature or 1.0))
        z = (2 * up + curvature * (up**2 + along**2)) / (radius + 1)
        return np.column_stack((s, moved[:, 1], z))

    def _bent(self, flat: Array, curvature: float, poses: tuple[Pose, ...]) -> Placement:
        s, y, z = flat.T
        angle = curvature * s
        x = self._start + s * np.sinc(angle / np.pi) + z * np.sin(angle)
        up = self._height - s * _versine(angle) + z * np.cos(angle)
        moved = np.column_stack((x, y, up)) - self._reference
        return moved[:-1].reshape(-1), (replace(poses[0], shift=moved[-1]), *poses[1:])

    @staticmethod
    def _flat_step(flat: Array, curvature: float, step: Array, change: float) -> Array:
        """Change of (s, y, z) that makes the Cartesian `step` while the curvature changes."""
        s, _, z = flat.T
        angle = curvature * s
        cosine, sine = np.cos(angle), np.sin(angle)
        near = np.abs(angle) < _NEARLY_STRAIGHT
        safe = np.where(near, 1.0, angle)
        sinc_slope = np.where(near, -angle / 3, (cosine - np.sinc(angle / np.pi)) / safe)
        versine_slope = np.where(near, 0.5, (np.sinc(angle / np.pi) - _versine(angle) / safe))
        x = step[:, 0] - change * s * (s * sinc_slope + z * cosine)
        up = step[:, 2] + change * s * (s * versine_slope + z * sine)
        return np.column_stack(
            ((cosine * x - sine * up) / (1 + curvature * z), step[:, 1], sine * x + cosine * up)
        )


def blend(weights: Array, parts: Sequence[Array]) -> Array:
    """The weighted sum of arrays of one shape."""
    total = np.zeros_like(parts[0])
    for weight, part in zip(weights, parts, strict=True):
        total += weight * part
    return total


def _versine(angle: Array) -> Array:
    """(1 - cos a) / a, without cancellation."""
    return np.asarray(angle / 2 * np.sinc(angle / (2 * np.pi)) ** 2)
