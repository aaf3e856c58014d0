"""Shape of the bending bellow: derived dimensions, undeformed profiles, volumes and masses.

Table I and Section II-A of the paper; solid and cavity as the toolbox builds them. Coordinates:
x along the revolving axis, cavity from x = 0 to L; z upwards to the crests; y across. Radii are
those of the inner surface, the wall lies outside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.convolution import HalfConvolution
from rig.mechanics.errors import MechanicsError
from rig.mechanics.section import SectionIntegrals, disc_union
from rig.spec.actuator import ActuatorSpec, BellowBendingGeometry

Array = NDArray[np.float64]

INLET_RADIUS = 1.5e-3
"""Radius of the air inlet through the near end wall, metres (toolbox: about 1.5 mm)."""

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(48)


def bending_geometry(actuator: ActuatorSpec, what: str) -> BellowBendingGeometry:
    """The actuator's geometry, of the only family that `what` (start of a sentence) is for.

    Raises MechanicsError for another one.
    """
    geometry = actuator.geometry
    if isinstance(geometry, BellowBendingGeometry):
        return geometry
    raise MechanicsError(
        f"{what} is for the family 'bellow-bending' only, but actuator '{actuator.name}' is a "
        f"'{geometry.family}'. `rig predict`, `characterise` and `export` work for every "
        "family."
    )


@dataclass(frozen=True)
class BellowShape:
    """All dimensions of the bending bellow, metres; names as in Table I of the paper."""

    effective_length: float
    """L."""
    bellow_number: int
    """N."""
    average_radius: float
    """rm, also half of the bottom width D."""
    inner_radius: float
    """ri, lowest cavity radius (troughs)."""
    outer_radius: float
    """ro, highest cavity radius (crests), also the distance Db from the axis to the floor."""
    crest_arc: float
    """r1 of the inner surface."""
    trough_arc: float
    """r2 of the inner surface."""
    flank: float
    """f = ro - ri - r1 - r2."""
    wall: float
    """t."""
    bottom_thickness: float
    """tb = 2 t."""
    cap_thickness: float
    """tc = t."""
    connector_thickness: float
    """tf."""

    @classmethod
    def of(cls, geometry: BellowBendingGeometry) -> BellowShape:
        """Derive every dimension from the independent parameters."""
        return _shape_of(geometry)

    @property
    def middle_surface(self) -> HalfConvolution:
        """The half convolution that the beam theory bends: R1 = r1 + t/2, R2 = r2 - t/2, f."""
        return HalfConvolution(
            crest_radius=self.crest_arc + self.wall / 2,
            trough_radius=self.trough_arc - self.wall / 2,
            flank=self.flank,
        )

    @property
    def half_pitch(self) -> float:
        """Axial length of a half convolution, L / (2 N)."""
        return self.effective_length / (2 * self.bellow_number)

    @property
    def underside(self) -> float:
        """Height z of the underside of the bottom layer, -(ro + tb)."""
        return -(self.outer_radius + self.bottom_thickness)

    @property
    def start(self) -> float:
        """x of the clamped face, -t."""
        return -self.wall

    @property
    def end(self) -> float:
        """x where the rigid end cap begins, L + t."""
        return self.effective_length + self.wall

    @property
    def gap(self) -> float:
        """Between the outsides of neighbouring flanks at rest."""
        return 2 * (self.trough_arc - self.wall)

    @property
    def half_width(self) -> float:
        """Half of the bottom layer's width."""
        return self.average_radius + self.wall

    @property
    def fibre_distance(self) -> float:
        """Between the underside and the crests of the cavity, 2 ro + tb."""
        return 2 * self.outer_radius + self.bottom_thickness

    @property
    def end_wall_top(self) -> float:
        """Highest z of the end walls and the end cap, ri + t."""
        return self.inner_radius + self.wall

    @property
    def tip(self) -> float:
        """x of the far face of the end cap, L + 2 t."""
        return self.effective_length + self.wall + self.cap_thickness

    def cavity_profile(self, samples: int = 16) -> Array:
        """Undeformed upper inner surface from x = 0 to L, (n, 2) as (x, z); arcs sampled."""
        return self._profile(0.0, samples)

    def outer_profile(self, samples: int = 16) -> Array:
        """Undeformed upper outer surface from x = 0 to L, (n, 2) as (x, z); arcs sampled."""
        return self._profile(self.wall, samples)

    def _profile(self, offset: float, samples: int) -> Array:
        angle = np.linspace(0.0, np.pi / 2, samples)
        trough, crest = self.trough_arc - offset, self.crest_arc + offset
        rising = np.column_stack(
            [
                np.concatenate(
                    [trough * np.sin(angle), self.half_pitch - crest * np.sin(angle[::-1])]
                ),
                np.concatenate(
                    [
                        self.inner_radius + self.trough_arc - trough * np.cos(angle),
                        self.outer_radius - self.crest_arc + crest * np.cos(angle[::-1]),
                    ]
                ),
            ]
        )
        falling = np.column_stack([2 * self.half_pitch - rising[::-1, 0], rising[::-1, 1]])
        one = np.concatenate([rising, falling[1:-1]])
        shifts = 2 * self.half_pitch * np.arange(self.bellow_number)
        repeated = np.concatenate([one + np.array([shift, 0.0]) for shift in shifts])
        return np.concatenate([repeated, [[self.effective_length, one[0, 1]]]])

    @cached_property
    def channel_section(self) -> Array:
        """Cross-section of the straight channel under the axis, (n, 2) as (y, z)."""
        roof, floor, knee = -self.wall, -self.outer_radius, self._channel_knee()
        right = [[self._channel_half_width(roof), roof]]
        if knee > floor:
            right += [[self.average_radius, knee], [self.average_radius, floor]]
        else:
            right += [[self._channel_half_width(floor), floor]]
        return _mirrored(right)

    @cached_property
    def solid_section(self) -> Array:
        """Outside of channel, bottom plate and end walls below the axis, (n, 2) as (y, z)."""
        outside = self.average_radius + self.wall
        return _mirrored(
            [
                [self.inner_radius + self.wall, 0.0],
                [outside, self._channel_shoulder()],
                [outside, self.underside],
            ]
        )

    def _channel_shoulder(self) -> float:
        """z where the channel's outside meets the circle of radius ro + t."""
        return -math.sqrt(
            (self.outer_radius + self.wall) ** 2 - (self.average_radius + self.wall) ** 2
        )

    def _channel_half_width(self, z: float) -> float:
        """Half width of the cavity's slanted channel side, parallel to the outside at t."""
        run, drop = self.average_radius - self.inner_radius, -self._channel_shoulder()
        slant = math.hypot(run, drop)
        start_y = self.inner_radius + self.wall * (1 - drop / slant)
        start_z = -self.wall * run / slant
        return start_y + (start_z - z) * run / drop

    def _channel_knee(self) -> float:
        """z where the slanted inner side reaches the half width rm."""
        run, drop = self.average_radius - self.inner_radius, -self._channel_shoulder()
        return (self._channel_half_width(0.0) - self.average_radius) * drop / run

    @cached_property
    def cavity_volume(self) -> float:
        """Volume of the undeformed cavity in m3: full revolve united with the channel."""
        return self.swept_volume(0.0, self.channel_section)

    @cached_property
    def soft_volume(self) -> float:
        """Volume of soft material in m3: bellow, channel, bottom layer and both end walls."""
        outside = self.swept_volume(self.wall, self.solid_section)
        walls = 2 * self.wall * self._end_section_area
        inlet = np.pi * INLET_RADIUS**2 * self.wall
        return outside + walls - inlet - self.cavity_volume

    @property
    def cap_volume(self) -> float:
        """Volume of the rigid end cap in m3."""
        return self.cap_thickness * self._end_section_area

    def soft_mass(self, density: float) -> float:
        """Mass of the soft material in kg, `density` in kg/m3."""
        return density * self.soft_volume

    def cap_mass(self, density: float) -> float:
        """Mass of the rigid end cap in kg, `density` of its material in kg/m3."""
        return density * self.cap_volume

    @property
    def cap_centre(self) -> Array:
        """Centre of mass of the end cap, (3,) in m."""
        end = self._end_section
        return np.array([self.tip - self.cap_thickness / 2, 0.0, float(end.moment / end.area)])

    @property
    def _end_section_area(self) -> float:
        return float(self._end_section.area)

    @property
    def _end_section(self) -> SectionIntegrals:
        return disc_union(np.array(self.end_wall_top), self.solid_section)

    def swept_volume(self, offset: float, section: Array) -> float:
        """Integral over x of the union of the revolved profile with a constant section.

        The flanks are normal to the axis and contribute nothing; the arcs are integrated by
        Gauss-Legendre quadrature over their angle.
        """
        angle = np.pi / 4 * (_GAUSS_NODES + 1)
        weight = np.pi / 4 * _GAUSS_WEIGHTS
        trough, crest = self.trough_arc - offset, self.crest_arc + offset
        radii = np.concatenate(
            [
                self.inner_radius + self.trough_arc - trough * np.cos(angle),
                self.outer_radius - self.crest_arc + crest * np.cos(angle),
            ]
        )
        widths = np.concatenate([trough * np.cos(angle) * weight, crest * np.cos(angle) * weight])
        return 2 * self.bellow_number * float(disc_union(radii, section).area @ widths)


@lru_cache(maxsize=256)
def _shape_of(geometry: BellowBendingGeometry) -> BellowShape:
    inner = geometry.radius_ratio * geometry.average_radius
    outer = 2 * geometry.average_radius - inner
    arc = geometry.arc_radius
    return BellowShape(
        effective_length=geometry.effective_length,
        bellow_number=geometry.bellow_number,
        average_radius=geometry.average_radius,
        inner_radius=inner,
        outer_radius=outer,
        crest_arc=arc,
        trough_arc=arc,
        # the constraint of eq. (1) allows equality; rounding must not make the flank negative
        flank=max(outer - inner - 2 * arc, 0.0),
        wall=geometry.wall_thickness,
        bottom_thickness=2 * geometry.wall_thickness,
        cap_thickness=geometry.wall_thickness,
        connector_thickness=geometry.frame_connector_thickness,
    )


def _mirrored(right: list[list[float]]) -> Array:
    """Counter-clockwise polygon from its right half, given from the top down."""
    side = np.array(right)
    return np.concatenate([side * [-1.0, 1.0], side[::-1]])
