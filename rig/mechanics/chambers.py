"""A row of rectangular chambers as a stack of segments along x: dimensions, volumes, masses.

Every segment has a rectangular outline and, where there is one, a rectangular cavity. The soft
body stands from x = 0, clamped, to x = `end`, where a rigid cap closes it; y = 0 is its plane of
symmetry, z = 0 the underside of actuators that bend, the axis of those that lengthen.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.spec.chambers import (
    BellowRectangularGeometry,
    MultiChamberBendingGeometry,
    MultiChamberLinearGeometry,
)

Array = NDArray[np.float64]
ChamberGeometry = (
    BellowRectangularGeometry | MultiChamberBendingGeometry | MultiChamberLinearGeometry
)


@dataclass(frozen=True)
class Rectangle:
    """Part of a cross section, metres: |y| up to `half_width`, z from `low` to `high`."""

    half_width: float
    low: float
    high: float

    @property
    def area(self) -> float:
        """In m2, both halves."""
        return 2 * self.half_width * (self.high - self.low)


@dataclass(frozen=True)
class Segment:
    """A piece of the row with one cross section."""

    length: float
    """Along x in m."""
    outline: Rectangle
    cavity: Rectangle | None
    """None where it is solid."""


@dataclass(frozen=True)
class ChamberRow:
    """The whole body."""

    segments: tuple[Segment, ...]
    cap_thickness: float
    """Of the rigid cap in m; it has the last segment's outline."""
    wall: float
    """Thinnest wall along the row in m; where chambers are thinner than walls, a chamber."""
    gap: float
    """Between facing outer walls of neighbours at rest in m; 0 where there are none."""
    layer: float = 0.0
    """Thickness of the inextensible layer under the cavity in m; 0 without one."""

    @classmethod
    def of(cls, geometry: ChamberGeometry) -> ChamberRow:
        """The segments of a geometry."""
        match geometry:
            case BellowRectangularGeometry():
                return _bellows(geometry)
            case MultiChamberBendingGeometry():
                return _block(geometry, geometry.layer_thickness)
            case MultiChamberLinearGeometry():
                return _block(geometry, None)

    @property
    def start(self) -> float:
        """x of the clamped face in m."""
        return 0.0

    @property
    def end(self) -> float:
        """x where the rigid cap begins in m."""
        return float(sum(s.length for s in self.segments))

    @property
    def effective_length(self) -> float:
        """Length that bends in m: all of the soft body."""
        return self.end - self.start

    @property
    def tip(self) -> float:
        """x of the cap's far face in m."""
        return self.end + self.cap_thickness

    @property
    def underside(self) -> float:
        """Lowest z in m."""
        return min(s.outline.low for s in self.segments)

    @property
    def height(self) -> float:
        """From the lowest to the highest z in m."""
        return max(s.outline.high for s in self.segments) - self.underside

    @property
    def half_width(self) -> float:
        """Largest |y| in m."""
        return max(s.outline.half_width for s in self.segments)

    @property
    def fibre_distance(self) -> float:
        """Between the underside and the chambers' roof in m, whose lengths are compared."""
        return max(s.cavity.high for s in self.segments if s.cavity is not None) - self.underside

    @property
    def cavity_volume(self) -> float:
        """In m3, undeformed."""
        return sum(s.length * s.cavity.area for s in self.segments if s.cavity is not None)

    @property
    def soft_volume(self) -> float:
        """Of the soft body in m3, layer included."""
        return sum(s.length * s.outline.area for s in self.segments) - self.cavity_volume

    @property
    def cap_centre(self) -> Array:
        """Centre of mass of the cap, (3,) in m."""
        last = self.segments[-1].outline
        return np.array([self.end + self.cap_thickness / 2, 0.0, (last.low + last.high) / 2])

    def cap_mass(self, density: float) -> float:
        """In kg, `density` of its material in kg/m3."""
        return density * self.cap_thickness * self.segments[-1].outline.area

    def soft_mass(self, density: float) -> float:
        """In kg, `density` of the soft material in kg/m3."""
        return density * self.soft_volume

    def starts(self) -> Array:
        """x where the segments begin, and where the last one ends, (n + 1,) in m."""
        return np.cumsum([0.0, *(s.length for s in self.segments)])


def _bellows(g: BellowRectangularGeometry) -> ChamberRow:
    t, layer = g.wall_thickness, g.strain_limiting_thickness
    bellow = Rectangle(g.bellow_width / 2, 0.0, g.bellow_height)
    chamber = Rectangle(g.bellow_width / 2 - t, layer, g.bellow_height - t)
    spacer = Rectangle(g.spacer_width / 2, 0.0, g.spacer_height)
    channel = Rectangle(g.spacer_width / 2 - t, layer, g.spacer_height - t)

    def row() -> Iterator[Segment]:
        yield Segment(t, spacer, None)
        yield Segment(next(g.groups()).spacer_length, spacer, channel)
        for group in g.groups():
            for _ in range(group.bellow_number):
                yield Segment(g.face_thickness, bellow, channel)
                yield Segment(group.bellow_length, bellow, chamber)
                yield Segment(g.face_thickness, bellow, channel)
                yield Segment(group.spacer_length, spacer, channel)
        yield Segment(t, spacer, None)

    return ChamberRow(
        tuple(row()),
        cap_thickness=g.end_length - t,
        wall=min(t, g.face_thickness),
        gap=min(group.spacer_length for group in g.groups()),
    )


def _block(
    g: MultiChamberBendingGeometry | MultiChamberLinearGeometry, layer: float | None
) -> ChamberRow:
    t = g.wall_thickness
    # the bending one stands on its layer, the linear one is symmetric about its axis
    middle = 0.0 if layer is None else layer + t + g.chamber_height / 2
    low = -(t + g.chamber_height / 2) if layer is None else 0.0
    block = Rectangle(g.chamber_width / 2 + t, low, middle + g.chamber_height / 2 + t)

    def around_axis(height: float, width: float) -> Rectangle:
        return Rectangle(width / 2, middle - height / 2, middle + height / 2)

    chamber = around_axis(g.chamber_height, g.chamber_width)
    passage = around_axis(g.passage_height, g.passage_width)

    def row() -> Iterator[Segment]:
        yield Segment(t, block, None)
        for number in range(g.chamber_number):
            if number:
                yield Segment(t, block, passage)
            yield Segment(g.chamber_length, block, chamber)
        yield Segment(t, block, None)

    return ChamberRow(
        tuple(row()),
        cap_thickness=g.end_cap_thickness,
        wall=min(t, g.chamber_length),
        gap=0.0,
        layer=layer or 0.0,
    )
