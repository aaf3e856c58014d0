"""Solids as closed surfaces of triangles, by the boolean operations of the manifold library."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.cad.construct import Arc, Combined, Line, Prism, Revolved, Solid
from rig.mechanics.cad.errors import CadError

Array = NDArray[np.float64]

_MILLIMETRE = 1e3

# rows take the revolved solid (profile's radius, its normal, axis) to x, y, z
_PLACED = {
    "x": np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0]]),
    "z": np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]),
}


def triangulate(solid: Solid, tolerance: float = 1e-5) -> Array:
    """Closed surface of a solid, (triangles, 3, 3) in metres, normals outwards.

    Chords leave circles by at most `tolerance` in metres. Raises CadError where the library
    `manifold3d` is missing or the solid is empty.
    """
    kernel = _kernel()
    body = _Evaluation(kernel, tolerance * _MILLIMETRE).evaluate(solid)
    if body.status() != kernel.Error.NoError or body.is_empty():
        raise CadError(
            "The solid has no closed surface: its dimensions leave nothing of it, or make it "
            "touch itself. Check the geometry with `rig check`."
        )
    surface = body.to_mesh64()
    corners = np.asarray(surface.vert_properties)[:, :3][np.asarray(surface.tri_verts)]
    return np.asarray(corners / _MILLIMETRE)


def _kernel() -> Any:
    try:
        return importlib.import_module("manifold3d")
    except ImportError as error:
        raise CadError(
            "Triangulated solids need the library manifold3d, which is not installed. Install it "
            "with `pip install manifold3d`, or all of CAD with `pip install 'rig[cad]'`."
        ) from error


class _Evaluation:
    """Makes manifolds, in millimetres: the library's tolerances suit sizes around 1."""

    def __init__(self, kernel: Any, tolerance: float) -> None:
        self._kernel = kernel
        self._tolerance = tolerance

    def evaluate(self, solid: Solid) -> Any:
        if isinstance(solid, Revolved):
            return self._revolved(solid)
        if isinstance(solid, Prism):
            return self._prism(solid)
        return self._combined(solid)

    def _combined(self, solid: Combined) -> Any:
        union = self._kernel.OpType.Add
        body = self._kernel.Manifold.batch_boolean([self.evaluate(s) for s in solid.added], union)
        if solid.removed:
            holes = [self.evaluate(s) for s in solid.removed]
            body = body - self._kernel.Manifold.batch_boolean(holes, union)
        return body

    def _revolved(self, solid: Revolved) -> Any:
        points = self._sampled(solid.profile)
        axial, radial = points.T
        closed = np.concatenate(
            [[[0.0, axial[0]]], np.stack([radial, axial], axis=-1), [[0.0, axial[-1]]]]
        )
        # the profile runs along the axis at positive radius: counter-clockwise in (radius, axis)
        section = self._kernel.CrossSection([closed[_distinct(closed)]])
        # multiples of four keep the planes of symmetry
        steps = 4 * self._steps(float(radial.max()), math.pi / 2)
        return section.revolve(steps).transform(_PLACED[solid.axis])

    def _prism(self, solid: Prism) -> Any:
        section = np.array(solid.section) * _MILLIMETRE
        start, end = solid.start * _MILLIMETRE, solid.end * _MILLIMETRE
        swept = self._kernel.CrossSection([section]).extrude(end - start)
        # (y, z, height) to (x, y, z)
        turned = [[0.0, 0.0, 1.0, start], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
        return swept.transform(np.array(turned))

    def _sampled(self, profile: tuple[Line | Arc, ...]) -> Array:
        points = [np.array(profile[0].start)[np.newaxis] * _MILLIMETRE]
        for piece in profile:
            if isinstance(piece, Line):
                points.append(np.array(piece.end)[np.newaxis] * _MILLIMETRE)
            else:
                points.append(self._sampled_arc(piece)[1:])
        return np.concatenate(points)

    def _sampled_arc(self, arc: Arc) -> Array:
        start, middle, end = (np.array(p) * _MILLIMETRE for p in (arc.start, arc.middle, arc.end))
        centre = circle_centre(start, middle, end)
        radius = float(np.hypot(*(start - centre)))
        first, turn = _sweep(start - centre, middle - centre, end - centre)
        steps = 2 * self._steps(radius, abs(turn) / 2)
        angle = first + turn * np.linspace(0.0, 1.0, steps + 1)
        points = centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        points[0], points[-1] = start, end
        return np.asarray(points)

    def _steps(self, radius: float, angle: float) -> int:
        """Chords for an arc of this radius (mm) and angle within the tolerance."""
        sag = min(self._tolerance / max(radius, 1e-12), 1.0)
        return max(2, math.ceil(angle / (2 * math.acos(1 - sag))))


def circle_centre(first: Array, second: Array, third: Array) -> Array:
    """Centre of the circle through three points in a plane, (2,)."""
    rows = 2 * np.array([second - first, third - first])
    right = np.array([second @ second - first @ first, third @ third - first @ first])
    return np.asarray(np.linalg.solve(rows, right))


def _sweep(start: Array, middle: Array, end: Array) -> tuple[float, float]:
    """Angle of the first of three directions, and the turn by way of the second to the third."""
    angles = [math.atan2(p[1], p[0]) for p in (start, middle, end)]
    turn = (angles[2] - angles[0]) % (2 * math.pi)
    if (angles[1] - angles[0]) % (2 * math.pi) > turn:
        turn -= 2 * math.pi
    return angles[0], turn


def _distinct(points: Array) -> NDArray[np.bool_]:
    """Which points differ from the one before, the first from the last."""
    return np.asarray(np.abs(points - np.roll(points, 1, axis=0)).max(axis=1) > 1e-9)
