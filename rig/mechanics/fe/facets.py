"""Facets of a mesh as curved surfaces of their own: places and normals from their own nodes.

Each facet is a quadratic Lagrange patch over the unit square, triangle or interval. That is exact:
shape functions of nodes that are not on a facet vanish there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import skfem
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Discretisation, Integers

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Facets:
    """Some facets, each with the same order of nodes over its own coordinates s in [0, 1]."""

    nodes: Integers
    """(facets, a)."""
    places: Array
    """Undeformed nodes in m, (facets, a, dim)."""
    outward: Array
    """1 or -1: the sign that turns the product of the tangents outwards, (facets,)."""
    triangular: bool

    @staticmethod
    def of(discretisation: Discretisation, facets: Integers) -> Facets:
        """`facets` are those of the mesh, on its boundary."""
        d = discretisation
        elements = d.mesh.f2t[0, facets]
        local = np.argmax(d.mesh.t2f[:, elements] == facets, axis=0)
        places = np.asarray(d.element.doflocs)
        orders = np.stack(
            [
                _nodes_in_order(places, places[list(corners)])
                for corners in d.mesh.elem.refdom.facets
            ]
        )
        nodes = np.take_along_axis(d.connectivity[elements], orders[local], axis=1)
        triangular = isinstance(d.mesh, skfem.MeshTet1)
        found = Facets(nodes, d.nodes[nodes], np.ones(len(nodes)), triangular)
        middle = np.full((1, d.dim - 1), 1 / 3 if triangular else 1 / 2)
        at, normals = found.at(np.zeros(d.size), middle)
        # the mean of a thin curved element's nodes may be beyond the facet
        centre = d.mesh.elem.refdom.p.mean(axis=1, keepdims=True)
        away = at[:, 0] - d.mesh.mapping().F(centre, tind=elements)[..., 0].T
        outward = np.sign(np.einsum("fi,fi->f", normals[:, 0], away))
        return Facets(nodes, found.places, outward, triangular)

    @property
    def dim(self) -> int:
        """Dimensions of space."""
        return int(self.places.shape[2])

    @property
    def outline(self) -> tuple[int, ...]:
        """Which of the nodes are corners, one after the other round the facet."""
        if self.triangular:
            return (0, 5, 2)
        return (0, 2) if self.dim == 2 else (0, 6, 8, 2)

    def part(self, which: Integers) -> Facets:
        """Some of these facets."""
        return Facets(self.nodes[which], self.places[which], self.outward[which], self.triangular)

    def now(self, x: Array) -> Array:
        """Nodes for the displacements in x, (facets, a, dim)."""
        return np.asarray(self.places + x[self.dim * self.nodes[..., None] + np.arange(self.dim)])

    def shapes(self, s: Array) -> tuple[Array, Array]:
        """Shape functions at s (..., dim - 1): values (..., a) and slopes (..., a, dim - 1)."""
        if self.triangular:
            return _triangle(s)
        values, slopes = _interval(s[..., 0])
        if s.shape[-1] == 1:
            return values, slopes[..., None]
        other, across = _interval(s[..., 1])
        flat = (*s.shape[:-1], 9)
        return (
            (values[..., :, None] * other[..., None, :]).reshape(flat),
            np.stack(
                (
                    (slopes[..., :, None] * other[..., None, :]).reshape(flat),
                    (values[..., :, None] * across[..., None, :]).reshape(flat),
                ),
                axis=-1,
            ),
        )

    def hats(self, s: Array) -> Array:
        """Linear shape functions of the corners in the order of `outline`, (..., corners)."""
        if self.triangular:
            return np.stack((1 - s.sum(axis=-1), s[..., 0], s[..., 1]), axis=-1)
        a = s[..., 0]
        if self.dim == 2:
            return np.stack((1 - a, a), axis=-1)
        b = s[..., 1]
        return np.stack(((1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b), axis=-1)

    def at(self, x: Array, s: Array) -> tuple[Array, Array]:
        """Places and outward unit normals (facets, n, dim) at the same s (n, dim - 1) of each."""
        values, slopes = self.shapes(s)
        nodes = self.now(x)
        tangents = np.einsum("qak,fai->fqik", slopes, nodes)
        if self.dim == 2:
            normals = tangents[..., ::-1, 0] * np.array([1.0, -1.0])
        else:
            normals = np.cross(tangents[..., 0], tangents[..., 1])
        normals *= self.outward[:, None, None]
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        return values @ nodes, normals


def _nodes_in_order(places: Array, corners: Array) -> Integers:
    """Local nodes of the facet with these corners in the reference element, as `shapes` has them.

    The first corner is s = 0; its neighbours are the ends of the axes.
    """
    arms = corners[1:] - corners[0]
    if len(arms) == 3:  # not the one across
        arms = np.delete(arms, np.argmax(np.linalg.norm(arms, axis=1)), axis=0)
    s, *_ = np.linalg.lstsq(arms.T, (places - corners[0]).T, rcond=None)
    on = np.flatnonzero(np.abs(corners[0] + s.T @ arms - places).max(axis=1) < 1e-9)
    key = np.round(2 * s[:, on]).astype(int)
    return np.asarray(on[np.lexsort(key[::-1])], dtype=np.int64)


def _interval(s: Array) -> tuple[Array, Array]:
    values = np.stack(((1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)), axis=-1)
    return values, np.stack((4 * s - 3, 4 - 8 * s, 4 * s - 1), axis=-1)


def _triangle(s: Array) -> tuple[Array, Array]:
    a, b = s[..., 0], s[..., 1]
    c, zero = 1 - a - b, np.zeros_like(a)
    # as the lattice has them: (0, 0), (0, 1/2), (0, 1), (1/2, 0), (1/2, 1/2), (1, 0)
    values = (c * (2 * c - 1), 4 * b * c, b * (2 * b - 1), 4 * a * c, 4 * a * b, a * (2 * a - 1))
    along_a = (1 - 4 * c, -4 * b, zero, 4 * (c - a), 4 * b, 4 * a - 1)
    along_b = (1 - 4 * c, 4 * (c - b), 4 * b - 1, -4 * a, 4 * a, zero)
    slopes = np.stack((np.stack(along_a, axis=-1), np.stack(along_b, axis=-1)), axis=-1)
    return np.stack(values, axis=-1), slopes
