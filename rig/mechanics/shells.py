"""A round soft core inside a slit shell: dimensions, volumes, masses, where slits and bridges are.

x runs along the core from the end of the gripped solid end at the connector, x = 0, to that at the
tip; z up from the side that bending shortens; the core's axis is y = z = 0. Angles round the core
are counted from its lowest line, z = -R, so that y = r sin, z = -r cos.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from rig.spec.shells import (
    ShellReinforcedBendingGeometry,
    ShellReinforcedGeometry,
    ShellReinforcedLinearGeometry,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Span:
    """A piece of the shell along x, metres."""

    start: float
    end: float
    bridges: tuple[tuple[float, float], ...]
    """Where it is there, in rad from the lowest line, within the half y >= 0: (0, pi) in a ring,
    less in a slit."""


@dataclass(frozen=True)
class SlitShell:
    """Core and shell, metres."""

    chamber_radius: float
    core_radius: float
    shell_thickness: float
    chamber_length: float
    end_length: float
    cap_thickness: float
    spans: tuple[Span, ...]
    """Half slit, ring, slit, ..., ring, half slit, over the whole chamber."""
    bonded: float
    """Angle in rad from the lowest line up to which the shell is bonded to the core; 0 where it
    slides all round."""

    @classmethod
    def of(cls, geometry: ShellReinforcedGeometry) -> SlitShell:
        """The shape of a geometry."""
        match geometry:
            case ShellReinforcedBendingGeometry():
                bonded = geometry.strip_width / 2 / geometry.core_radius
                patterns: tuple[tuple[tuple[float, float], ...], ...] = (((0.0, bonded),),)
            case ShellReinforcedLinearGeometry():
                bonded, half = 0.0, geometry.bridge_width / 2 / geometry.core_radius
                patterns = (
                    ((0.0, half), (pi - half, pi)),
                    ((pi / 2 - half, pi / 2 + half),),
                )
        return cls(
            chamber_radius=geometry.cavity_radius,
            core_radius=geometry.core_radius,
            shell_thickness=geometry.shell_thickness,
            chamber_length=geometry.chamber_length,
            end_length=geometry.end_length,
            cap_thickness=geometry.end_cap_thickness,
            spans=_spans(geometry, patterns),
            bonded=bonded,
        )

    @property
    def start(self) -> float:
        """x where the connector's grip ends in m."""
        return 0.0

    @property
    def end(self) -> float:
        """x where the rigid cap's grip begins in m."""
        return self.chamber_length

    @property
    def effective_length(self) -> float:
        """Length that bends or lengthens in m."""
        return self.chamber_length

    @property
    def tip(self) -> float:
        """x of the cap's far face in m."""
        return self.end + self.end_length + self.cap_thickness

    @property
    def radius(self) -> float:
        """Outside of the shell in m."""
        return self.core_radius + self.shell_thickness

    @property
    def underside(self) -> float:
        """Lowest z in m."""
        return -self.radius

    @property
    def height(self) -> float:
        """From the lowest to the highest z in m."""
        return 2 * self.radius

    @property
    def half_width(self) -> float:
        """Largest |y| in m."""
        return self.radius

    @property
    def wall(self) -> float:
        """Of the core in m."""
        return self.core_radius - self.chamber_radius

    @property
    def gap(self) -> float:
        """The outside has no folds."""
        return 0.0

    @property
    def fibre_distance(self) -> float:
        """Between the underside and the chamber's roof in m, whose lengths are compared."""
        return self.chamber_radius - self.underside

    @property
    def cavity_volume(self) -> float:
        """In m3, undeformed."""
        return pi * self.chamber_radius**2 * self.chamber_length

    @property
    def core_volume(self) -> float:
        """Of the soft core in m3, gripped ends included."""
        whole = pi * self.core_radius**2 * (self.chamber_length + 2 * self.end_length)
        return whole - self.cavity_volume

    @property
    def shell_volume(self) -> float:
        """In m3."""
        area = self.radius**2 - self.core_radius**2
        # both halves: a circle's area per rad is half of its radius squared
        return sum(
            area * (s.end - s.start) * (high - low) for s in self.spans for low, high in s.bridges
        )

    def soft_mass(self, density: float) -> float:
        """Of core and shell between the grips in kg, the shell taken as dense as the core's
        `density` in kg/m3: it is 4 % of the volume."""
        ends = 2 * pi * self.core_radius**2 * self.end_length
        return density * (self.core_volume - ends + self.shell_volume)

    @property
    def cap_centre(self) -> Array:
        """Centre of mass of the cap, (3,) in m."""
        return np.array([self.tip - self.cap_thickness / 2, 0.0, 0.0])

    def cap_mass(self, density: float) -> float:
        """In kg, of a disc as wide as the shell, `density` of its material in kg/m3."""
        return density * self.cap_thickness * pi * self.radius**2


def _spans(
    geometry: ShellReinforcedGeometry, patterns: tuple[tuple[tuple[float, float], ...], ...]
) -> tuple[Span, ...]:
    whole = ((0.0, pi),)
    width, ring, slits = geometry.slit_width, geometry.ring_width, geometry.slit_number + 2
    spans, x = [], 0.0
    for number in range(slits):
        at_the_end = number in (0, slits - 1)
        cut = width / 2 if at_the_end else width
        spans.append(Span(x, x + cut, patterns[number % len(patterns)]))
        x += cut
        if number < slits - 1:
            spans.append(Span(x, x + ring, whole))
            x += ring
    return tuple(spans)
