"""Cross-sections of the bellow: a disc united with a polygon, area and first moment in closed form.

The polygon is split into triangles that all share the disc's centre; each triangle meets the disc
in at most one triangle and two circle sectors, whose integrals are elementary.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SectionIntegrals:
    """Area in m2 and first moment of the height z over the area in m3, one per disc radius."""

    area: Array
    moment: Array


def polygon_integrals(vertices: Array) -> tuple[float, float]:
    """Area and first moment of z of a counter-clockwise polygon, `vertices` (n, 2) as (y, z)."""
    y, z = vertices.T
    y_next, z_next = np.roll(y, -1), np.roll(z, -1)
    cross = y * z_next - y_next * z
    return float(cross.sum() / 2), float((cross * (z + z_next)).sum() / 6)


def disc_union(radius: Array, vertices: Array) -> SectionIntegrals:
    """Integrals over the union of discs about the origin with one polygon.

    `radius` has any shape, metres; `vertices` is (n, 2) as (y, z), counter-clockwise.
    """
    radius = np.asarray(radius, dtype=float)
    polygon_area, polygon_moment = polygon_integrals(vertices)
    common_area = np.zeros_like(radius)
    common_moment = np.zeros_like(radius)
    for start, end in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        area, moment = _disc_and_triangle(radius, start, end)
        common_area += area
        common_moment += moment
    return SectionIntegrals(
        area=np.pi * radius**2 + polygon_area - common_area,
        moment=polygon_moment - common_moment,
    )


def _disc_and_triangle(radius: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """Signed integrals over the disc cut with the triangle (origin, start, end)."""
    edge = end - start
    length = float(np.hypot(*edge))
    direction = edge / length
    distance = float(direction[0] * start[1] - direction[1] * start[0])  # signed, line to origin
    foot = -float(start @ direction)
    half_chord = np.sqrt(np.maximum(radius**2 - distance**2, 0.0))
    enter = np.clip(foot - half_chord, 0.0, length)
    leave = np.clip(foot + half_chord, 0.0, length)
    enter_y, enter_z = start[0] + enter * direction[0], start[1] + enter * direction[1]
    leave_y, leave_z = start[0] + leave * direction[0], start[1] + leave * direction[1]
    cross = enter_y * leave_z - leave_y * enter_z
    area = cross / 2
    moment = cross * (enter_z + leave_z) / 6
    for from_y, from_z, to_y, to_z in (
        (start[0], start[1], enter_y, enter_z),
        (leave_y, leave_z, end[0], end[1]),
    ):
        sector_area, sector_moment = _sector(radius, from_y, from_z, to_y, to_z)
        area = area + sector_area
        moment = moment + sector_moment
    return area, moment


def _sector(
    radius: Array, from_y: Array, from_z: Array, to_y: Array, to_z: Array
) -> tuple[Array, Array]:
    """Signed integrals over the circle sector between the directions of two points."""
    turn = np.arctan2(from_y * to_z - to_y * from_z, from_y * to_y + from_z * to_z)
    begin = np.arctan2(from_z, from_y)
    area = radius**2 * turn / 2
    moment = radius**3 / 3 * (np.cos(begin) - np.cos(begin + turn))
    return area, moment
