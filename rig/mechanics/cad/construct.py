"""Constructive description of solids, independent of the kernel that evaluates it; metres.

`facets` turns it into triangles for printing, `brep` into exact surfaces for STEP and meshing.
"""

from __future__ import annotations

from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True)
class Line:
    """Straight piece of a profile, points as (axial, radial)."""

    start: Point
    end: Point


@dataclass(frozen=True)
class Arc:
    """Circular piece of a profile through three points, (axial, radial)."""

    start: Point
    middle: Point
    end: Point


@dataclass(frozen=True)
class Revolved:
    """Solid under a profile turned about an axis.

    The profile runs in the axial direction and does not cross the axis; straight radial lines
    from its ends to the axis close it.
    """

    profile: tuple[Line | Arc, ...]
    axis: str = "x"
    """`x`, or `z` with the profile's axial direction upwards."""


@dataclass(frozen=True)
class Prism:
    """Polygon (y, z), counter-clockwise, swept along x from `start` to `end`."""

    section: tuple[Point, ...]
    start: float
    end: float


@dataclass(frozen=True)
class Combined:
    """Union of the solids in `added` without those in `removed`."""

    added: tuple[Solid, ...]
    removed: tuple[Solid, ...] = ()


Solid = Revolved | Prism | Combined


@dataclass(frozen=True)
class Part:
    """One body of an actuator: printed of one material, or bought."""

    name: str
    solid: Solid
    is_soft: bool
