"""Half (y >= 0) or, across z = 0, too, a quarter of a row of chambers as second-order hexahedra.

All edges of all cross sections run through the whole row as lines of the lattice, so that the
cells of neighbouring segments share their faces: each cell is solid, cavity or outside.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.chambers import ChamberRow, Rectangle
from rig.mechanics.mesh.curved import CurvedHex
from rig.mechanics.mesh.lattice import Block, Side, join

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_SAME = 1e-9
"""Edges closer than this are one line, metres."""


@dataclass(frozen=True)
class RowResolution:
    """How many elements a cell has, the space between two neighbouring lines of the lattice."""

    along: float
    """Largest size along the row, metres."""
    across: float
    """Largest size across it, metres."""
    through: int = 2
    """Elements along the row, at least, through walls across it: with one, bulging walls are a
    fifth too soft."""


@dataclass(frozen=True)
class ChamberRowMesh:
    """A half or a quarter of the soft body, metres; x along the row, z up from the layer."""

    mesh: CurvedHex
    """27-node hexahedra with the facet sets `clamped` (x = 0), `cap` (x = end), `symmetry`
    (y = 0), `floor` (z = 0 of a quarter, else none), `cavity` and `outside` as boundaries;
    together they are the whole boundary."""
    layer: Indices
    """Elements of the inextensible layer."""
    shape: ChamberRow


def mesh_chamber_row(
    shape: ChamberRow, resolution: RowResolution, *, quarter: bool = False
) -> ChamberRowMesh:
    """Mesh the soft body; `quarter` leaves out what is below z = 0, a plane of symmetry."""
    mesh, named = join(list(_blocks(shape, resolution, quarter)))
    boundary = mesh.boundary_facets()
    corner = mesh.p[:, mesh.facets[:, boundary]]

    def on(axis: int, value: float) -> Indices:
        return np.asarray(boundary[np.all(np.abs(corner[axis] - value) < _SAME, axis=0)])

    sets = {
        "clamped": on(0, shape.start),
        "cap": on(0, shape.end),
        "symmetry": on(1, 0.0),
        "cavity": named["cavity"],
    }
    if quarter:
        sets["floor"] = on(2, 0.0)
    sets["outside"] = np.setdiff1d(boundary, np.concatenate(list(sets.values())))
    highest = mesh.p[2, mesh.t].max(axis=0)
    return ChamberRowMesh(
        mesh=mesh.with_boundaries(sets, boundaries_only=False),
        layer=np.flatnonzero(highest < shape.underside + shape.layer + _SAME),
        shape=shape,
    )


def _blocks(shape: ChamberRow, resolution: RowResolution, quarter: bool) -> Iterator[Block]:
    y, z = _lines(shape, quarter)
    x = shape.starts()
    solid, hollow = _cells(shape, y, z)
    walls = np.diff(x) < shape.wall * (1 + _SAME)
    least = (np.where(walls, resolution.through, 1), np.ones(y.size - 1), np.ones(z.size - 1))
    sizes = resolution.along, resolution.across, resolution.across
    nodes = [
        [_row(a, b, size, int(n)) for (a, b), n in zip(pairwise(lines), counts, strict=True)]
        for lines, size, counts in zip((x, y, z), sizes, least, strict=True)
    ]
    padded = np.pad(hollow, 1)
    for cell in np.argwhere(solid):
        i, j, k = (int(index) for index in cell)
        names: dict[Side, str] = {}
        sides: tuple[tuple[Side, Side], ...] = (("i-", "i+"), ("j-", "j+"), ("k-", "k+"))
        for axis, pair in enumerate(sides):
            for side, step in zip(pair, (-1, 1), strict=True):
                beside = cell + 1
                beside[axis] += step
                if padded[tuple(beside)]:
                    names[side] = "cavity"
        lattice = np.meshgrid(nodes[0][i], nodes[1][j], nodes[2][k], indexing="ij")
        yield Block(np.stack(lattice, axis=-1), names)


def _lines(shape: ChamberRow, quarter: bool) -> tuple[Array, Array]:
    """Edges of all cross sections across the row, and up, in the part that is meshed."""
    sections = [s.outline for s in shape.segments]
    sections += [s.cavity for s in shape.segments if s.cavity is not None]
    across = [0.0, *(r.half_width for r in sections)]
    up = [v for r in sections for v in (r.low, r.high)]
    if shape.layer:
        up.append(shape.underside + shape.layer)
    if quarter:
        up = [0.0, *(v for v in up if v > 0)]
    return _distinct(across), _distinct(up)


def _distinct(values: list[float]) -> Array:
    ordered = np.sort(values)
    return np.asarray(ordered[np.append(True, np.diff(ordered) > _SAME)])


def _cells(shape: ChamberRow, y: Array, z: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which cells (segments, across, up) are solid, and which are cavity."""
    middle = np.meshgrid((y[:-1] + y[1:]) / 2, (z[:-1] + z[1:]) / 2, indexing="ij")

    def inside(section: Rectangle | None) -> NDArray[np.bool_]:
        if section is None:
            return np.zeros(middle[0].shape, dtype=bool)
        across, up = middle
        return np.asarray((across < section.half_width) & (up > section.low) & (up < section.high))

    outline = np.stack([inside(s.outline) for s in shape.segments])
    hollow = np.stack([inside(s.cavity) for s in shape.segments])
    return outline & ~hollow, hollow


def _row(start: float, end: float, size: float, least: int) -> Array:
    """Lattice points from one line to the next, two for each element of at most `size`."""
    elements = max(least, int(np.ceil((end - start) / size - 1e-9)))
    return np.linspace(start, end, 2 * elements + 1)
