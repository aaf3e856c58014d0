"""Meridian of the axisymmetric bellow as second-order quadrilaterals in (r, z).

Bellow of Auysakul, Booranawong, Vittayaphadung and Smithmaitrie (Actuators 12 (2023) 300): a soft
tube whose wall is N equal circular arcs that bulge outwards and meet in cusps, on a collar and
under a flat top. The inner contour is the outer one moved inwards by the wall thickness t, so that
t is measured along the radius, not normal to the wall.

Where the divided ratio is 2 the arcs are half circles: neighbouring ones touch tangentially, the
wall ends in an edge without thickness at every inner cusp, and the outer cusps are slits. The
Jacobian of the elements there is zero in those corners; it is positive at all quadrature points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from rig.mechanics.mesh.curved import CurvedHex, CurvedQuad
from rig.mechanics.mesh.lattice import Block, join, line, rectangle, revolved, transfinite
from rig.spec.actuator import BellowAxisymmetricGeometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AxisymmetricBellow:
    """Dimensions of the axisymmetric bellow, metres; parameters as in the paper's Table 1."""

    wall: float = 0.003
    """A: wall thickness t along the radius."""
    layers: int = 6
    """B: number N of bellows."""
    divided_ratio: float = 2.0
    """C: pitch over sagitta of an arc, d; 2 is a half circle."""
    radius: float = 0.020
    """Outer radius of collar, top and outer cusps."""
    height: float = 0.035
    """From the foot of the collar to the top."""
    collar: float = 0.005
    """Height of the collar."""

    @classmethod
    def of(cls, geometry: BellowAxisymmetricGeometry) -> AxisymmetricBellow:
        """The dimensions of a spec, which has checked that they describe a solid."""
        return cls(
            wall=geometry.wall_thickness,
            layers=geometry.bellow_number,
            divided_ratio=geometry.divided_ratio,
            radius=geometry.top_diameter / 2,
            height=geometry.height,
            collar=geometry.base_height,
        )

    @property
    def pitch(self) -> float:
        """Chord h of an arc: the height of one bellow, (height - collar - t) / N."""
        return (self.height - self.collar - self.wall) / self.layers

    @property
    def sagitta(self) -> float:
        """Rise s of an arc over its chord, h / d."""
        return self.pitch / self.divided_ratio

    @property
    def arc_radius(self) -> float:
        """Radius of an arc, (h^2 / 4 + s^2) / (2 s)."""
        return (self.pitch**2 / 4 + self.sagitta**2) / (2 * self.sagitta)

    @property
    def cavity_volume(self) -> float:
        """Volume of the cavity in m3, closed form (Pappus' theorem for the circular segments)."""
        inner = self.radius - self.wall
        tube = np.pi * inner**2 * (self.height - self.wall)
        return float(tube + self.layers * self._segment_of_revolution(inner))

    @property
    def soft_volume(self) -> float:
        """Volume of the solid in m3, closed form."""
        outside = np.pi * self.radius**2 * self.height
        outside += self.layers * self._segment_of_revolution(self.radius)
        return float(outside - self.cavity_volume)

    @property
    def start(self) -> float:
        """z of the clamped foot in m."""
        return 0.0

    @property
    def end(self) -> float:
        """z of the top's outer face in m."""
        return self.height

    @property
    def effective_length(self) -> float:
        """Length that lengthens in m: all layers."""
        return self.layers * self.pitch

    def soft_mass(self, density: float) -> float:
        """In kg, without the top; `density` in kg/m3."""
        return density * self.soft_volume - self.cap_mass(density)

    def cap_mass(self, density: float) -> float:
        """Of the top in kg."""
        return float(density * np.pi * self.radius**2 * self.wall)

    def contour(self, samples: int = 12) -> Array:
        """The outer surface from foot to top, (n, 2) as (z, r); arcs sampled."""
        half = np.arcsin(np.clip(self.pitch / (2 * self.arc_radius), -1.0, 1.0))
        turn = np.linspace(-half, half, samples)
        one = np.column_stack(
            (
                self.pitch / 2 + self.arc_radius * np.sin(turn),
                self.radius + self.sagitta - self.arc_radius * (1 - np.cos(turn)),
            )
        )
        steps = self.collar + self.pitch * np.arange(self.layers)
        arcs = one + np.stack([steps, np.zeros_like(steps)], axis=-1)[:, None]
        ends = np.array([[self.start, self.radius], [self.end, self.radius]])
        return np.concatenate((ends[:1], arcs.reshape(-1, 2), ends[1:]))

    def _segment_of_revolution(self, radius: float) -> float:
        """Volume between an arc and its chord at a radius, turned about the axis."""
        chord, arc = self.pitch, self.arc_radius
        half = np.arccos(np.clip((arc - self.sagitta) / arc, -1.0, 1.0))
        area = arc**2 * (half - np.sin(half) * np.cos(half))
        centroid = radius - (arc - self.sagitta) + chord**3 / (12 * area)
        return float(2 * np.pi * centroid * area)


@dataclass(frozen=True)
class AxisymmetricResolution:
    """Numbers of elements."""

    wall: int = 2
    """Through the wall."""
    half_arc: int = 3
    """Along half of an arc."""
    collar: int = 2
    """Along the collar."""
    top: int = 2
    """Through the top."""
    top_radius: int = 6
    """Along the radius of the top, without the wall."""

    @classmethod
    def level(cls, level: int) -> AxisymmetricResolution:
        """Coarse (0), medium (1) and fine (2 and more) meshes for studies of convergence."""
        n = level + 1
        return cls(wall=2 * n, half_arc=3 * n, collar=2 * n, top=2 * n, top_radius=6 * n)


@dataclass(frozen=True)
class AxisymmetricBellowMesh:
    """Meridian of the soft body, metres; first coordinate r, second z."""

    mesh: CurvedQuad
    """9-node quadrilaterals with the facet sets `clamped` (z = 0), `axis` (r = 0), `cavity`, `top`
    (z = height) and `outside` as boundaries; together they are the whole boundary."""
    top_centre: int
    """Node (column of `mesh.doflocs`) at r = 0, z = height."""
    shape: AxisymmetricBellow
    resolution: AxisymmetricResolution


def mesh_axisymmetric_bellow(
    shape: AxisymmetricBellow, resolution: AxisymmetricResolution | None = None
) -> AxisymmetricBellowMesh:
    """Mesh the meridian of an axisymmetric bellow; all nodes of the arcs lie on them."""
    n = resolution or AxisymmetricResolution()
    mesh, named = join(_blocks(shape, n, 0.0))
    r, z = mesh.doflocs
    return AxisymmetricBellowMesh(
        mesh=mesh.with_boundaries(named, boundaries_only=False),
        top_centre=int(np.argmin(r - z)),
        shape=shape,
        resolution=n,
    )


def mesh_bellow_quarter(
    shape: AxisymmetricBellow, resolution: AxisymmetricResolution, around: int, hole: float
) -> CurvedHex:
    """A quarter of the bellow, x >= 0 and y >= 0, as 27-node hexahedra, `around` of them round it.

    The top has a hole of radius `hole` in m on the axis, where hexahedra would degenerate.
    Boundaries as of the meridian, `axis` being the hole, and `y=0` and `x=0`.
    """
    blocks = [
        revolved(block, around, low="y=0", high="x=0") for block in _blocks(shape, resolution, hole)
    ]
    mesh, named = join(blocks)
    quarter: CurvedHex = mesh.with_boundaries(named, boundaries_only=False)
    return quarter


def _blocks(shape: AxisymmetricBellow, n: AxisymmetricResolution, hole: float) -> list[Block]:
    """The meridian from radius `hole` on."""
    inner, outer = shape.radius - shape.wall, shape.radius
    under = shape.height - shape.wall
    half = _half_layer(shape, n)
    layer = [half, half.mirrored(shape.pitch / 2, axis=1)]
    collar = rectangle((inner, 0.0), (outer, shape.collar), (n.wall, n.collar))
    rim = rectangle((inner, under), (outer, shape.height), (n.wall, n.top))
    disc = rectangle((hole, under), (inner, shape.height), (n.top_radius, n.top))
    return [
        Block(collar, {"i-": "cavity", "i+": "outside", "j-": "clamped"}),
        *(
            block.shifted(shape.collar + k * shape.pitch, axis=1)
            for k in range(shape.layers)
            for block in layer
        ),
        Block(rim, {"i+": "outside", "j+": "top"}),
        Block(disc, {"i-": "axis", "j-": "cavity", "j+": "top"}),
    ]


def _half_layer(shape: AxisymmetricBellow, n: AxisymmetricResolution) -> Block:
    """Wall from a cusp (z = 0) up to the widest point of the arc; first index outwards."""
    widest = np.arcsin(min(shape.pitch / (2 * shape.arc_radius), 1.0))
    angle = np.linspace(widest, 0.0, 2 * n.half_arc + 1)
    rise = shape.sagitta - shape.arc_radius * (1 - np.cos(angle))
    rise[0] = 0.0
    outer = np.stack([shape.radius + rise, shape.pitch / 2 - shape.arc_radius * np.sin(angle)], -1)
    outer[0, 1] = 0.0
    inner = outer - np.array([shape.wall, 0.0])
    low = line(inner[0], outer[0], n.wall)
    high = line(inner[-1], outer[-1], n.wall)
    nodes = _relaxed(transfinite(low, high, inner, outer))
    return Block(nodes, {"i-": "cavity", "i+": "outside"})


def _relaxed(nodes: Array, sweeps: int = 40) -> Array:
    """Lattice with the same boundary whose local coordinates are harmonic (Winslow's equations).

    Such a lattice does not fold over, even where its sides meet at angles of 0 and 180 degrees.
    """
    m, n = nodes.shape[:2]
    number = np.arange(m * n).reshape(m, n)
    inside = number[1:-1, 1:-1].ravel()
    rim = np.setdiff1d(number, inside)
    steps = {(0, 0): 0, (1, 0): 1, (-1, 0): 1, (0, 1): 2, (0, -1): 2}
    for _ in range(sweeps):
        u = (nodes[2:, 1:-1] - nodes[:-2, 1:-1]) / 2
        v = (nodes[1:-1, 2:] - nodes[1:-1, :-2]) / 2
        along_u, along_v = np.sum(v * v, axis=-1).ravel(), np.sum(u * u, axis=-1).ravel()
        mixed = -np.sum(u * v, axis=-1).ravel() / 2
        centre = -2 * (along_u + along_v)
        weights = [centre, along_u, along_v]
        rows, columns, values = [rim], [rim], [np.ones(rim.size)]
        for (di, dj), kind in steps.items():
            rows.append(inside)
            columns.append(inside + di * n + dj)
            values.append(weights[kind])
        for di in (1, -1):
            for dj in (1, -1):
                rows.append(inside)
                columns.append(inside + di * n + dj)
                values.append(di * dj * mixed)
        matrix = coo_array(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        ).tocsc()
        right = np.zeros((m * n, 2))
        right[rim] = nodes.reshape(-1, 2)[rim]
        nodes = np.asarray(spsolve(matrix, right)).reshape(m, n, 2)
    return nodes
