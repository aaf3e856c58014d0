"""Structured second-order blocks: lattices of nodes, and one conforming mesh made of many.

A block of a x b x c hexahedra is an array (2a+1, 2b+1, 2c+1, 3): corners at even indices, the other
nodes of the 27-node element between them; likewise a block of quadrilaterals. Blocks that share a
face share its node positions; they are joined by position.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from skfem import ElementHex2, ElementQuad2, MeshHex, MeshQuad

from rig.mechanics.mesh.curved import CurvedHex, CurvedQuad

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Side = Literal["i-", "i+", "j-", "j+", "k-", "k+"]

JOIN_TOLERANCE = 1e-9
"""Nodes closer than this are one node, metres: a thousandth of a micrometre."""


@dataclass(frozen=True)
class Block:
    """A lattice of nodes, metres, with names for some of its sides."""

    nodes: Array
    """(2a+1, 2b+1, 2c+1, 3), or (2a+1, 2b+1, 2)."""
    names: dict[Side, str] = field(default_factory=dict)

    def shifted(self, by: float, axis: int = 0) -> Block:
        """The block moved along an axis by so many metres."""
        nodes = self.nodes.copy()
        nodes[..., axis] += by
        return Block(nodes, self.names)

    def mirrored(self, at: float, axis: int = 0) -> Block:
        """The block mirrored in the plane where the coordinate of an axis is `at`, metres."""
        nodes = self.nodes.copy()
        nodes[..., axis] = 2 * at - nodes[..., axis]
        return Block(nodes, self.names)


def revolved(block: Block, elements: int, *, low: str, high: str) -> Block:
    """A quarter turn about z of a plane block in (r, z), third index from y = 0 to x = 0.

    `low` and `high` name its sides there; those of the plane block keep their names.
    """
    angle = np.linspace(0.0, np.pi / 2, 2 * elements + 1)
    cosine, sine = np.cos(angle), np.sin(angle)
    cosine[-1] = 0.0
    r, z = np.moveaxis(block.nodes[..., None, :], -1, 0)
    nodes = np.stack(np.broadcast_arrays(r * cosine, r * sine, z), axis=-1)
    return Block(nodes, {**block.names, "k-": low, "k+": high})


def between(start: Array, end: Array, elements: int) -> Array:
    """Lattice points from one array of points straight to another, new axis before the last."""
    share = np.linspace(0.0, 1.0, 2 * elements + 1)[:, np.newaxis]
    return np.asarray(start[..., np.newaxis, :] * (1 - share) + end[..., np.newaxis, :] * share)


def line(start: Array, end: Array, elements: int) -> Array:
    """Lattice points on a straight line, (2 elements + 1, d)."""
    return between(np.asarray(start, dtype=float), np.asarray(end, dtype=float), elements)


def rectangle(
    low: tuple[float, float], high: tuple[float, float], elements: tuple[int, int]
) -> Array:
    """Lattice points of a rectangle between opposite corners, (2a + 1, 2b + 1, 2)."""
    first = line(np.array(low), np.array([high[0], low[1]]), elements[0])
    last = line(np.array([low[0], high[1]]), np.array(high), elements[0])
    return between(first, last, elements[1])


def transfinite(low: Array, high: Array, left: Array, right: Array) -> Array:
    """Patch between four curves that meet at their ends (Gordon and Hall), (m, n, d).

    `low` and `high` run along the first index (m, d), `left` joins their first points and `right`
    their last ones (n, d). Opposite curves have as many points.
    """
    u = np.linspace(0.0, 1.0, low.shape[0])[:, np.newaxis, np.newaxis]
    v = np.linspace(0.0, 1.0, left.shape[0])[np.newaxis, :, np.newaxis]
    return np.asarray(
        (1 - v) * low[:, np.newaxis]
        + v * high[:, np.newaxis]
        + (1 - u) * left[np.newaxis]
        + u * right[np.newaxis]
        - (1 - u) * (1 - v) * low[0]
        - u * (1 - v) * low[-1]
        - (1 - u) * v * high[0]
        - u * v * high[-1]
    )


def rounded_strip(
    arc: Array, foot: Array, columns: int, *, centre: Array
) -> tuple[list[Array], Array]:
    """Quarter of a disc on top of a strip, meshed without flat corners; patches and their foot.

    `arc` runs from the symmetry line (its highest point) round to the strip's side, (2n + 1, 2);
    its first `columns` elements stand over the core of the strip, the others beside it. `centre`
    is where the strip begins on the symmetry line, `foot` its cross line from there to the end of
    the arc, (2m + 1, 2) with m > columns: m - columns elements lie between core and arc. Returns
    three patches, first index across the strip or along the arc, second index downwards, and the
    points of the symmetry line from the top of the arc to `centre`.
    """
    ring = (foot.shape[0] - 1) // 2 - columns
    core = 2 * columns
    top, corner = arc[: core + 1], arc[core]
    share = min(1.1 * columns / (columns + ring), 0.85)
    inner = centre + share * (corner - centre)
    rows = (arc.shape[0] - 1) // 2 - columns
    on_axis = centre + columns / (columns + ring) * (arc[0] - centre)
    core_top = line(on_axis, inner, columns)
    axis_ring, axis_core = line(arc[0], on_axis, ring), line(on_axis, centre, rows)
    spoke = line(corner, inner, ring)
    core_side = line(inner, foot[core], rows)
    patches = [
        transfinite(top, core_top, axis_ring, spoke),
        transfinite(core_top, foot[: core + 1], axis_core, core_side),
        transfinite(spoke[::-1], foot[core:], core_side, arc[core:]),
    ]
    return patches, np.concatenate([axis_ring, axis_core[1:]])


# where the nodes of an element sit in the order of scikit-fem, vertices first: lattice offsets
_OFFSETS = {
    2: np.rint(2 * np.asarray(ElementQuad2().doflocs)).astype(int),
    3: np.rint(2 * np.asarray(ElementHex2().doflocs)).astype(int),
}


def join(blocks: Sequence[Block]) -> tuple[CurvedHex | CurvedQuad, dict[str, Indices]]:
    """One conforming second-order mesh of all blocks, and the facets of every named side.

    Blocks of points in space make hexahedra, blocks of points in a plane quadrilaterals.
    """
    dim = blocks[0].nodes.shape[-1]
    blocks = [_right_handed(block) for block in blocks]
    points = np.concatenate([block.nodes.reshape(-1, dim) for block in blocks])
    unique = _merged(points)
    sizes = [block.nodes[..., 0].size for block in blocks]
    starts = np.cumsum([0, *sizes])
    elements, sides = [], []
    for block, start, size in zip(blocks, starts, sizes, strict=False):
        index = unique[start : start + size].reshape(block.nodes.shape[:-1])
        elements.append(_elements(index))
        sides += [(name, _side_corners(index, side)) for side, name in block.names.items()]
    nodes = np.concatenate(elements)
    position = np.empty((unique.max() + 1, dim))
    position[unique] = points
    used, corners = np.unique(nodes[:, : 2**dim], return_inverse=True)
    vertex = np.full(position.shape[0], -1)
    vertex[used] = np.arange(used.size)
    first, second = (MeshHex, CurvedHex) if dim == 3 else (MeshQuad, CurvedQuad)
    mesh = second.from_mesh(
        first(
            np.ascontiguousarray(position[used].T),
            np.ascontiguousarray(corners.reshape(-1, 2**dim).T),
            sort_t=False,
        )
    )
    mesh.doflocs[:, mesh.dofs.element_dofs.T] = position[nodes].transpose(2, 0, 1)
    facet_of = {tuple(key): number for number, key in enumerate(np.sort(mesh.facets.T, axis=1))}
    named: dict[str, list[int]] = {}
    for name, facets in sides:
        keys = np.sort(vertex[facets], axis=1)
        named.setdefault(name, []).extend(facet_of[tuple(key)] for key in keys)
    return mesh, {name: np.unique(facets) for name, facets in named.items()}


def _elements(index: Indices) -> Indices:
    """Node numbers of every element of a lattice in scikit-fem's order, (elements, 9 or 27)."""
    cells = [np.arange(0, size - 1, 2) for size in index.shape]
    origin = np.stack(np.meshgrid(*cells, indexing="ij"), axis=-1).reshape(-1, 1, index.ndim)
    at = origin + _OFFSETS[index.ndim]
    return np.asarray(index[tuple(np.moveaxis(at, -1, 0))])


def _side_corners(index: Indices, side: Side) -> Indices:
    """Node numbers of the corners of every facet on one side of a lattice, (facets, 2 or 4)."""
    face = np.moveaxis(index, "ijk".index(side[0]), 0)[0 if side[1] == "-" else -1]
    if face.ndim == 1:
        return np.stack([face[:-1:2], face[2::2]], axis=-1)
    face = face[::2, ::2]
    quads = [face[:-1, :-1], face[1:, :-1], face[1:, 1:], face[:-1, 1:]]
    return np.stack([quad.ravel() for quad in quads], axis=-1)


_FLIPPED: dict[Side, Side] = {"i-": "i+", "i+": "i-"}


def _right_handed(block: Block) -> Block:
    """The block, its first index reversed if its elements are left-handed as they are."""
    dim = block.nodes.shape[-1]
    corner = block.nodes[(slice(None, None, 2),) * dim]
    cell = (slice(-1),) * dim
    edges = np.stack([np.diff(corner, axis=axis, append=0)[cell] for axis in range(dim)], axis=-1)
    if np.linalg.det(edges).sum() > 0:
        return block
    names = {_FLIPPED.get(side, side): name for side, name in block.names.items()}
    return Block(block.nodes[::-1], names)


def _merged(points: Array) -> Indices:
    """For every point the number of the distinct one it is."""
    pairs = cKDTree(points).query_pairs(JOIN_TOLERANCE, output_type="ndarray")
    size = points.shape[0]
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1])
