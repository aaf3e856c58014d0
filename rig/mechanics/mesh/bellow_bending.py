"""Half of the bending bellow (y >= 0) as structured second-order hexahedra.

Geometry of `rig.mechanics.bellow`. The soft body is one thick shell; every half convolution has
the same pieces, which share their faces node by node:

- the crown: wall of the revolved bellow, swept from the top (angle 0) down to the crease where it
  meets the slanted side of the channel;
- the side: slanted and vertical wall of the channel between the creases of neighbouring crowns,
  from the trough's crease down to the heel;
- the heel: corner block between side and floor; and the floor.

Each end is closed by a wall: the section of the trough with its cavity filled, t thick.

Two things differ from the toolbox's solid. The air inlet is left out. And the channel's slanted
inner side runs straight up into the bellow's inner surface, where the toolbox ends the channel by
a flat roof at z = -t: this leaves out the small ribs under the roof, at the troughs between
z = -t and 0, so that the wall is t thick there, too. `rib_volume` says how much that is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.bellow import BellowShape
from rig.mechanics.mesh.curved import CurvedHex
from rig.mechanics.mesh.lattice import (
    Block,
    between,
    join,
    line,
    rounded_strip,
    transfinite,
)
from rig.spec.actuator import BellowBendingGeometry

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class BendingResolution:
    """Numbers of elements. Columns run down the side, rows along the actuator's axis."""

    wall: int = 2
    """Through the wall of crown and side. With one, angles come out 1.7 % too large."""
    floor: int = 1
    """Through the floor plate, which is twice as thick."""
    end_wall: int = 1
    """Through the end walls."""
    crown: int = 6
    """From the top round to the crease."""
    trough_columns: int = 1
    """Along the part of the trough's arc over the middle of the side's neck."""
    trough_ring: int = 1
    """Between the middle of the neck and the trough's crease."""
    trough_rows: int = 1
    """Along the rest of the trough's arc."""
    flank: int = 1
    """Along the flank."""
    crest_rows: int = 1
    """Along the lower half of the crest's arc."""
    crest_columns: int = 1
    """Along the upper half of the crest's arc."""
    side: int = 1
    """Rows of the slanted side below the middle of the crest's crease."""
    heel: int = 1
    """Rows of the vertical side."""
    plate: int = 3
    """Across the half floor."""

    @classmethod
    def level(cls, level: int) -> BendingResolution:
        """Coarse (0), medium (1) and fine (2 and more) meshes for studies of convergence."""
        n = level + 1
        return cls(
            wall=n,
            floor=n,
            end_wall=n,
            crown=6 * n,
            trough_columns=n,
            trough_ring=n,
            trough_rows=n,
            flank=n,
            crest_rows=n,
            crest_columns=n,
            side=n,
            heel=n,
            plate=3 * n,
        )


@dataclass(frozen=True)
class BendingBellowMesh:
    """Half of the soft body, metres; x along the axis, y >= 0, z up to the crests."""

    mesh: CurvedHex
    """27-node hexahedra with the facet sets `clamped` (x = -t), `cap` (x = L + t), `symmetry`
    (y = 0), `cavity` and `outside` as boundaries; together they are the whole boundary."""
    shape: BellowShape
    resolution: BendingResolution


def mesh_bending_bellow(
    geometry: BellowBendingGeometry, resolution: BendingResolution | None = None
) -> BendingBellowMesh:
    """Mesh the soft body of the bending bellow; all nodes of curved surfaces lie on them."""
    resolution = resolution or BendingResolution()
    shape = BellowShape.of(geometry)
    mesh, named = join(_Builder(shape, resolution).blocks())
    boundary = mesh.boundary_facets()
    corner = mesh.p[:, mesh.facets[:, boundary]]
    length, wall = shape.effective_length, shape.wall

    def on(axis: int, value: float) -> Indices:
        return np.asarray(boundary[np.all(np.abs(corner[axis] - value) < 1e-9, axis=0)])

    sets = {
        "clamped": on(0, -wall),
        "cap": on(0, length + wall),
        "symmetry": on(1, 0.0),
        "cavity": named["cavity"],
    }
    sets["outside"] = np.setdiff1d(boundary, np.concatenate(list(sets.values())))
    return BendingBellowMesh(
        mesh=mesh.with_boundaries(sets, boundaries_only=False),
        shape=shape,
        resolution=resolution,
    )


@dataclass(frozen=True)
class _Outline:
    """One face of the channel's side wall below the crown: slanted, then vertical; (y, z)."""

    start: Array
    """Where the trough's circle meets the slanted part: distance 0 along the outline."""
    kink: Array
    end: Array

    @property
    def kink_at(self) -> float:
        """Distance of the kink along the outline."""
        return float(np.hypot(*(self.kink - self.start)))

    @property
    def end_at(self) -> float:
        """Length of the outline."""
        return self.kink_at + float(np.hypot(*(self.end - self.kink)))

    def place(self, distance: Array) -> Array:
        """Points (..., 2) as (y, z) at distances along the outline."""
        stops = [0.0, self.kink_at, self.end_at]
        corners = np.stack([self.start, self.kink, self.end])
        return np.stack([np.interp(distance, stops, corners[:, axis]) for axis in (0, 1)], axis=-1)

    def at_radius(self, radius: Array) -> Array:
        """Distance along the slanted part at which circles about the axis cross it."""
        direction = (self.kink - self.start) / self.kink_at
        along = float(self.start @ direction)
        inside = along**2 + radius**2 - float(self.start @ self.start)
        return np.asarray(np.sqrt(np.maximum(inside, 0.0)) - along)


@dataclass(frozen=True)
class _Face:
    """Inner or outer face of the wall of half a convolution, trough (x = 0) to crest (x = h)."""

    x: Array
    """Along the meridian's lattice."""
    radius: Array
    outline: _Outline
    crease: Array
    """(n, 2): the meridian's points on the channel's side as (x, distance along the outline)."""
    row_at: float
    """Distance along the outline of the row of nodes at (or next to) the kink."""

    def angle(self) -> Array:
        """Angle from the top at which the crown ends, along the meridian."""
        y, z = self.outline.place(self.crease[:, 1]).T
        return np.asarray(np.arctan2(y, z))


class _Builder:
    """Blocks of one mesh."""

    def __init__(self, shape: BellowShape, resolution: BendingResolution) -> None:
        self.shape = shape
        self.n = resolution
        self.flank = resolution.flank if shape.flank > 1e-6 * shape.outer_radius else 0
        self.outer = self._face(shape.wall, _outer_outline(shape))
        self.inner = self._face(0.0, _inner_outline(shape))

    def blocks(self) -> list[Block]:
        """All blocks of the half model."""
        pitch = 2 * self.shape.half_pitch
        cell = self._cell()
        half = cell + [block.mirrored(self.shape.half_pitch) for block in cell]
        ends = self._end_wall()
        return [
            *(block.shifted(pitch * k) for k in range(self.shape.bellow_number) for block in half),
            *ends,
            *(block.mirrored(self.shape.effective_length / 2) for block in ends),
        ]

    # --- the meridian ---------------------------------------------------------------------------

    @property
    def _arcs(self) -> tuple[int, int]:
        """Elements along the arcs of trough and crest."""
        return (
            self.n.trough_columns + self.n.trough_rows,
            self.n.crest_rows + self.n.crest_columns,
        )

    def _face(self, offset: float, outline: _Outline) -> _Face:
        shape = self.shape
        in_trough, in_crest = self._arcs
        trough, crest = shape.trough_arc - offset, shape.crest_arc + offset
        alpha = np.linspace(0.0, np.pi / 2, 2 * in_trough + 1)
        beta = np.linspace(0.0, np.pi / 2, 2 * in_crest + 1)
        flank = np.linspace(0.0, 1.0, 2 * self.flank + 1)[1:-1]
        low, high = shape.inner_radius + shape.trough_arc, shape.outer_radius - shape.crest_arc
        skip = 1 if self.flank == 0 else 0  # without a flank both arcs share a point
        x = np.concatenate(
            [
                trough * np.sin(alpha),
                np.full(flank.size, trough),
                shape.half_pitch - crest * np.cos(beta[skip:]),
            ]
        )
        radius = np.concatenate(
            [
                low - trough * np.cos(alpha),
                low + flank * (high - low),
                high + crest * np.sin(beta[skip:]),
            ]
        )
        distance = outline.at_radius(radius)
        distance[0] = 0.0
        # a kink right at the heel has no room for a row below it: it falls inside an element
        kink, end = outline.kink_at, outline.end_at
        has_room = end - kink > 0.15 * shape.wall
        return _Face(
            x=x,
            radius=radius,
            outline=outline,
            crease=np.stack([x, distance], axis=-1),
            row_at=kink if has_room else end - 0.3 * (end - float(distance[-1])),
        )

    # --- pieces of half a convolution -----------------------------------------------------------

    def _cell(self) -> list[Block]:
        """Crown, side, heel and floor from x = 0 (trough) to the crest."""
        patches_out, patches_in = self._side(self.outer), self._side(self.inner)
        blocks = [self._crown()]
        for outside, inside in zip(patches_out, patches_in, strict=True):
            wall = between(_on_side(self.inner, inside), _on_side(self.outer, outside), self.n.wall)
            blocks.append(Block(wall, {"k-": "cavity"}))
        foot = self._foot_x()
        heel = self._heel()
        floor = self._floor()
        blocks.append(Block(_extruded(heel, foot)))
        blocks.append(Block(_extruded(floor, foot), {"i+": "cavity"}))
        return blocks

    def _crown(self) -> Block:
        share = np.linspace(0.0, 1.0, 2 * self.n.crown + 1)
        end_in, end_out = self.inner.angle(), self.outer.angle()
        mean = (end_in + end_out) / 2
        faces = []
        for face, end in ((self.inner, end_in), (self.outer, end_out)):
            # both faces advance together and part only towards the crease
            angle = mean[:, None] * share + (end - mean)[:, None] * share**3
            radius = face.radius[:, None]
            x = np.broadcast_to(face.x[:, None], angle.shape)
            faces.append(np.stack([x, radius * np.sin(angle), radius * np.cos(angle)], axis=-1))
        faces[0][:, 0, 1] = faces[1][:, 0, 1] = 0.0
        return Block(between(faces[0], faces[1], self.n.wall), {"k-": "cavity"})

    def _foot_x(self) -> Array:
        """Lattice of x along the lower end of the side, the same inside and outside."""
        neck = self.n.trough_columns + self.n.trough_ring
        knee = self._knee_index
        knee_x = (self.inner.x[knee] + self.outer.x[knee]) / 2
        half = self.shape.half_pitch
        return np.concatenate(
            [
                line(np.array([0.0]), np.array([knee_x]), neck)[:, 0],
                line(np.array([knee_x]), np.array([half]), self.n.crest_columns)[1:, 0],
            ]
        )

    @property
    def _knee_index(self) -> int:
        """Lattice index of the crease's point between the crest's rows and columns."""
        return 2 * (self._arcs[0] + self.flank + self.n.crest_rows)

    def _side(self, face: _Face) -> list[Array]:
        """Patches of the side's face in (x, distance along the outline)."""
        n, crease = self.n, face.crease
        neck = n.trough_columns + n.trough_ring
        arc = crease[: 2 * self._arcs[0] + 1]
        centre = np.array([0.0, arc[-1, 1]])
        foot = line(centre, arc[-1], neck)
        patches, _ = rounded_strip(arc, foot, n.trough_columns, centre=centre)

        start, knee = 2 * self._arcs[0], self._knee_index
        straight = crease[start : knee + 1]
        share = np.linspace(0.0, 1.0, 2 * neck + 1)[:, np.newaxis]
        # rows sink towards the trough where the crease slants, to open the angle at the knee
        over = np.maximum(straight[:, 0] - straight[0, 0], 0.0)
        slope = min(0.3, 0.4 * (face.row_at - straight[-1, 1]) / over[-1])
        sink = slope * (1 - share) * over
        strip = np.stack([share * straight[:, 0], straight[:, 1] + sink], axis=-1)
        patches.append(strip)

        foot_x = self._foot_x()
        end = face.outline.end_at
        bottom = np.stack([foot_x, np.full(foot_x.size, end)], axis=-1)
        right = self._right_row(face)
        row_x = (strip[-1, -1, 0] + bottom[2 * neck, 0]) / 2
        row = np.array([[0.0, face.row_at], [row_x, face.row_at]])
        above = line(row[0], row[1], neck)
        patches.append(
            transfinite(
                strip[:, -1],
                above,
                line(strip[0, -1], row[0], n.side),
                line(strip[-1, -1], row[1], n.side),
            )
        )
        patches.append(
            transfinite(
                above,
                bottom[: 2 * neck + 1],
                line(row[0], bottom[0], n.heel),
                line(row[1], bottom[2 * neck], n.heel),
            )
        )
        beside = line(row[1], right, n.crest_columns)
        patches.append(
            transfinite(
                crease[knee:],
                beside,
                line(strip[-1, -1], row[1], n.side),
                line(crease[-1], right, n.side),
            )
        )
        patches.append(
            transfinite(
                beside,
                bottom[2 * neck :],
                line(row[1], bottom[2 * neck], n.heel),
                line(right, bottom[-1], n.heel),
            )
        )
        return patches

    def _right_row(self, face: _Face) -> Array:
        """The row at the kink where it reaches the crest's plane of symmetry."""
        crest, end = float(face.crease[-1, 1]), face.outline.end_at
        lowest = crest + (end - crest) * self.n.side / (self.n.side + self.n.heel)
        room = 0.3 * (end - crest)
        at = face.row_at if face.row_at - crest > room else lowest
        return np.array([self.shape.half_pitch, at])

    def _heel(self) -> Array:
        """Corner block between side and floor in (y, z); first index outwards, second down."""
        inside, outside = self.inner.outline.end, self.outer.outline.end
        bottom = self.shape.underside
        below, far = np.array([inside[0], bottom]), np.array([outside[0], bottom])
        return between(
            line(inside, outside, self.n.wall), line(below, far, self.n.wall), self.n.floor
        )

    def _floor(self) -> Array:
        """Floor plate in (y, z); first index up, second from the plane of symmetry outwards."""
        inside, bottom = self.inner.outline.end, self.shape.underside
        low = line(np.array([0.0, bottom]), np.array([inside[0], bottom]), self.n.plate)
        high = line(np.array([0.0, inside[1]]), inside, self.n.plate)
        return between(low, high, self.n.floor).transpose(1, 0, 2)

    # --- end walls ------------------------------------------------------------------------------

    def _end_wall(self) -> list[Block]:
        """Near end wall from x = -t to 0: the trough's section with its cavity filled."""
        x = np.linspace(-self.shape.wall, 0.0, 2 * self.n.end_wall + 1)
        crown = self._crown().nodes[0, ..., 1:]
        down_in, down_out = self._left(self.inner), self._left(self.outer)
        side = between(
            self.inner.outline.place(down_in), self.outer.outline.place(down_out), self.n.wall
        )
        frame = [crown, side, self._heel(), self._floor()]
        fill = [
            Block(_extruded(patch, x), {"k+": "cavity"})
            for patch in self._fill(crown[:, 0], side[:, 0])
        ]
        return [Block(_extruded(section, x)) for section in frame] + fill

    def _left(self, face: _Face) -> Array:
        """Distances along the outline of the side's nodes at x = 0, from the top down."""
        patches = self._side(face)
        # ring, core, strip, above and below the kink
        columns = [patches[i][0, :, 1] for i in (0, 1, 3, 4, 5)]
        return np.concatenate([columns[0], *(column[1:] for column in columns[1:])])

    def _fill(self, arc: Array, side: Array) -> list[Array]:
        """Section of the trough's cavity: patches in (y, z) inside its arc, side and floor."""
        floor = self._floor()[-1]
        core = max(1, min(self.n.plate - 1, self.n.crown // 2))
        centre = np.array([0.0, arc[-1, 1]])
        foot = line(centre, arc[-1], self.n.plate)
        patches, _ = rounded_strip(arc, foot, core, centre=centre)
        axis = np.stack([np.zeros(side.shape[0]), side[:, 1]], axis=-1)
        patches.append(transfinite(foot, floor, axis, side))
        return patches


def _on_side(face: _Face, patch: Array) -> Array:
    """A patch in (x, distance along the outline) as points (x, y, z)."""
    section = face.outline.place(patch[..., 1])
    return np.concatenate([patch[..., :1], section], axis=-1)


def _extruded(section: Array, x: Array) -> Array:
    """Lattice of a section (m, n, 2) as (y, z) repeated at every x, the new index last."""
    shape = (*section.shape[:2], x.size, 3)
    nodes = np.empty(shape)
    nodes[..., 0] = x
    nodes[..., 1:] = section[:, :, np.newaxis]
    return nodes


def _outer_outline(shape: BellowShape) -> _Outline:
    start, shoulder, _ = _right_half(shape.solid_section)
    # the side ends at the height of the floor, or below the shoulder if that is even lower
    end = min(-shape.outer_radius, shoulder[1] - shape.wall / 2)
    return _Outline(start=start, kink=shoulder, end=np.array([shoulder[0], end]))


def _inner_outline(shape: BellowShape) -> _Outline:
    roof, *knee, end = _right_half(shape.channel_section)
    below = knee[0] if knee else end
    direction = (below - roof) / np.hypot(*(below - roof))
    foot = roof - (roof @ direction) * direction
    start = foot + math.sqrt(shape.inner_radius**2 - float(foot @ foot)) * direction
    return _Outline(start=start, kink=below, end=end)


def _right_half(section: Array) -> Array:
    """Corners of a mirrored section with y > 0, from the top down."""
    return section[: section.shape[0] // 2 - 1 : -1]


def rib_volume(geometry: BellowBendingGeometry) -> float:
    """Volume in m3 of the ribs under the channel's roof that the mesh leaves out, both halves.

    Where the troughs are lower than the roof (ri < t) that includes the web between bellow and
    channel that the toolbox's solid has there.
    """
    shape = BellowShape.of(geometry)
    outline = _inner_outline(shape)
    knee = [outline.kink] if outline.kink_at < outline.end_at else []
    right = np.stack([outline.end, *knee, outline.start])
    section = np.concatenate([right, right[::-1] * [-1.0, 1.0]])
    return shape.swept_volume(0.0, section) - shape.cavity_volume
