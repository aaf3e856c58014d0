"""Meridian of the joint bellow as second-order quadrilaterals in (r, z).

Joint bellow of Guo et al. (Biocybern. Biomed. Eng. 40 (2020) 1359): a wall of equal thickness in
N equal V-shaped bellows between two discs. Half a bellow is an arc at the trough, a straight flank
and an arc at the crest, tangent to each other. Elements are equally long along it and their number
is a multiple of five: the paper's ten latitudes of a bellow, A at the trough to J, are nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.mechanics.mesh.curved import CurvedQuad
from rig.mechanics.mesh.lattice import Block, join, rectangle
from rig.spec.actuator import BellowJointGeometry

Array = NDArray[np.float64]

LATITUDES = 10
"""Points of interest over one bellow."""
_FIFTHS = LATITUDES // 2
_SAMPLES = 2001


@dataclass(frozen=True)
class JointBellow:
    """Dimensions of the joint bellow in metres; radii and lengths of the middle of the wall."""

    bellows: int
    pitch: float
    trough_radius: float
    crest_radius: float
    rounding: float
    wall: float
    end_thickness: float
    """Of the discs; the lower one's inner face is at z = 0."""

    @classmethod
    def of(cls, geometry: BellowJointGeometry) -> JointBellow:
        """The dimensions of a spec, which has checked that they describe a solid."""
        return cls(
            bellows=geometry.bellow_number,
            pitch=geometry.pitch,
            trough_radius=geometry.trough_radius,
            crest_radius=geometry.crest_radius,
            rounding=geometry.rounding,
            wall=geometry.wall_thickness,
            end_thickness=geometry.end_thickness,
        )

    @property
    def length(self) -> float:
        """All bellows, without the discs."""
        return self.bellows * self.pitch

    @property
    def flank(self) -> float:
        """Length of the straight part of half a bellow."""
        depth = self.crest_radius - self.trough_radius
        between = np.hypot(depth - 2 * self.rounding, self.pitch / 2)
        return float(np.sqrt(between**2 - 4 * self.rounding**2))

    @property
    def flank_angle(self) -> float:
        """Angle in rad between flank and axis, below a right one."""
        depth = self.crest_radius - self.trough_radius
        lean = np.arctan2(depth - 2 * self.rounding, self.pitch / 2)
        return float(lean + np.arctan2(2 * self.rounding, self.flank))

    @property
    def meridian(self) -> float:
        """Length along half a bellow."""
        return 2 * self.rounding * self.flank_angle + self.flank

    def half(self, along: ArrayLike, offset: float) -> Array:
        """Points (..., 2) as (r, z) of the lowest half bellow at fractions (...) of its meridian
        from the trough, `offset` metres outwards of the middle of the wall."""
        s = np.asarray(along, dtype=float) * self.meridian
        arc = self.rounding * self.flank_angle
        sine, cosine = np.sin(self.flank_angle), np.cos(self.flank_angle)
        first = np.clip(s, 0.0, arc) / self.rounding
        straight = np.clip(s - arc, 0.0, self.flank)
        last = self.flank_angle - np.clip(s - arc - self.flank, 0.0, arc) / self.rounding
        # from the direction of the axis to that of the flank, and back
        r = self.rounding * (1 - np.cos(first)) + straight * sine
        r = self.trough_radius + r + self.rounding * (np.cos(last) - cosine)
        z = self.rounding * np.sin(first) + straight * cosine
        z = z + self.rounding * (sine - np.sin(last))
        turn = np.where(s < arc, first, last)
        return np.stack([r + offset * np.cos(turn), z - offset * np.sin(turn)], axis=-1)

    def latitudes(self, side: Literal["outside", "cavity"]) -> Array:
        """Points of interest A to J of every bellow on one face of the wall, (bellows, 10, 2).

        A is at the trough, F at the crest; equally far apart along the wall. B to E are on the
        lower flank, G to J on the upper one.
        """
        offset = self.wall / 2 if side == "outside" else -self.wall / 2
        up = self.half(np.arange(_FIFTHS + 1) / _FIFTHS, offset)
        down = up[-2:0:-1] * [1.0, -1.0] + [0.0, self.pitch]
        one = np.concatenate([up, down])
        steps = self.pitch * np.arange(self.bellows)
        return np.asarray(one + np.stack([np.zeros_like(steps), steps], axis=-1)[:, None])

    @property
    def start(self) -> float:
        """z of the lower disc's outer face in m, which is clamped."""
        return -self.end_thickness

    @property
    def end(self) -> float:
        """z of the upper disc's outer face in m."""
        return self.length + self.end_thickness

    @property
    def effective_length(self) -> float:
        """Length that lengthens in m: all bellows."""
        return self.length

    @property
    def cavity_volume(self) -> float:
        """In m3, by trapezoids of the sampled inner contour; within 1e-5."""
        half = self.half(np.linspace(0.0, 1.0, _SAMPLES), -self.wall / 2)
        one = float(np.trapezoid(np.pi * half[:, 0] ** 2, half[:, 1]))
        return 2 * self.bellows * one

    def soft_mass(self, density: float) -> float:
        """Of the wall in kg, without the discs; `density` in kg/m3."""
        return density * self.soft_volume - 2 * self.cap_mass(density)

    def cap_mass(self, density: float) -> float:
        """Of a disc in kg."""
        return float(
            density * np.pi * (self.trough_radius + self.wall / 2) ** 2 * self.end_thickness
        )

    def contour(self, samples: int = 20) -> Array:
        """The outer surface from disc to disc, (n, 2) as (z, r); arcs sampled."""
        up = self.half(np.linspace(0.0, 1.0, samples), self.wall / 2)
        down = up[-2:0:-1] * [1.0, -1.0] + [0.0, self.pitch]
        steps = self.pitch * np.arange(self.bellows)
        shift = np.stack([np.zeros_like(steps), steps], axis=-1)[:, None]
        bellows = (np.concatenate([up, down]) + shift).reshape(-1, 2)[:, ::-1]
        rim = bellows[0, 1]
        return np.concatenate(([[self.start, rim]], bellows, [[self.end, rim]]))

    @property
    def soft_volume(self) -> float:
        """Volume of the solid in m3, closed form (Pappus): wall and discs."""
        # the centroid of a strip about a curve is off the curve's by t^2 / 12 of its turning,
        # outwards at crests and inwards at troughs: over half a bellow that cancels
        middle = (self.trough_radius + self.crest_radius) / 2
        wall = 2 * np.pi * middle * self.meridian * self.wall
        disc = np.pi * (self.trough_radius + self.wall / 2) ** 2 * self.end_thickness
        return float(2 * (self.bellows * wall + disc))


@dataclass(frozen=True)
class JointResolution:
    """Numbers of elements. With the default ones stress at troughs and crests is within 2 % of that
    on twice as fine a mesh, displacement within 0.1 %; docs/validation/guo2020.md."""

    wall: int = 3
    """Through the wall."""
    fifth: int = 4
    """Along a fifth of half a bellow: from one latitude to the next."""
    end: int = 2
    """Through a disc."""
    end_radius: int = 6
    """Along the radius of a disc, without the wall."""

    @classmethod
    def resolving(cls, shape: JointBellow) -> JointResolution:
        """The default numbers, with as many more along the meridian as two elements of every arc
        ask for: where one element holds a whole arc, the wall's volume is up to 1 % too small."""
        arc = shape.rounding * shape.flank_angle
        return cls(fifth=max(cls.fifth, ceil(2 * shape.meridian / (_FIFTHS * arc))))


@dataclass(frozen=True)
class JointBellowMesh:
    """Meridian of the whole bellow, metres; first coordinate r, second z."""

    mesh: CurvedQuad
    """9-node quadrilaterals with the facet sets `clamped` (lower disc's outer face), `axis`
    (r = 0), `cavity`, `top` (upper disc's outer face) and `outside`: the whole boundary."""
    shape: JointBellow
    resolution: JointResolution


def mesh_joint_bellow(
    shape: JointBellow, resolution: JointResolution | None = None
) -> JointBellowMesh:
    """Mesh the meridian of a joint bellow; the nodes of its faces lie on them.

    Without a resolution the arcs are resolved, however sharp they are.
    """
    n = resolution or JointResolution.resolving(shape)
    half = half_bellow(shape, n)
    bellow = [half, half.mirrored(shape.pitch / 2, axis=1)]
    inner, outer = (shape.trough_radius + side * shape.wall / 2 for side in (-1, 1))
    low = [
        Block(
            rectangle((inner, -shape.end_thickness), (outer, 0.0), (n.wall, n.end)),
            {"i+": "outside", "j-": "clamped"},
        ),
        Block(
            rectangle((0.0, -shape.end_thickness), (inner, 0.0), (n.end_radius, n.end)),
            {"i-": "axis", "j-": "clamped", "j+": "cavity"},
        ),
    ]
    high = [
        Block(
            block.mirrored(shape.length / 2, axis=1).nodes,
            {s: "top" if name == "clamped" else name for s, name in block.names.items()},
        )
        for block in low
    ]
    blocks = [
        *low,
        *(block.shifted(k * shape.pitch, axis=1) for k in range(shape.bellows) for block in bellow),
        *high,
    ]
    mesh, named = join(blocks)
    return JointBellowMesh(mesh.with_boundaries(named, boundaries_only=False), shape, n)


def half_bellow(shape: JointBellow, n: JointResolution) -> Block:
    """Wall from a trough (z = 0) to the crest above it; first index outwards."""
    along = np.linspace(0.0, 1.0, 2 * _FIFTHS * n.fifth + 1)
    through = np.linspace(-shape.wall / 2, shape.wall / 2, 2 * n.wall + 1)
    nodes = np.stack([shape.half(along, float(offset)) for offset in through])
    # where bellows meet, their nodes do
    nodes[:, 0, 1], nodes[:, -1, 1] = 0.0, shape.pitch / 2
    return Block(nodes, {"i-": "cavity", "i+": "outside"})
