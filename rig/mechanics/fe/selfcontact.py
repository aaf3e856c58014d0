"""Where a soft surface comes close to itself: the smallest gap between facing parts, as of flanks.

The engine does not push such parts apart; this tells whether it should have. Facets are sampled
where they are now, curved as they are, at the points of a lattice; two samples face each other
where their outward normals are opposed within 30 degrees and the line between them follows both
within 30 degrees: round the root of a fold the gap may be 3 % smaller than between its flanks.
Facets that share a corner are not looked at: in a fold they always meet. The closest pairs of
facets are sampled again, five times as finely. Parts that have passed through each other by less
than `depth` have a negative gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from rig.mechanics.fe.discretisation import Discretisation, Integers

Array = NDArray[np.float64]

_COARSE, _FINE = 4, 17
"""Samples along a direction of a facet, first and second time."""
_NARROWER = 4
"""Times the reach is halved for the first look."""
_FACING = np.cos(np.pi / 6)
_CANDIDATES = 8
"""Pairs of facets that are sampled again."""


@dataclass(frozen=True)
class Gap:
    """The closest facing points of a surface."""

    distance: float
    """In m; negative where they have passed through each other."""
    places: tuple[Array, Array]
    """Where they are now, in m."""
    facets: tuple[int, int]
    """Facets of the mesh they are on."""


class FacingSurface:
    """One surface, watched for places where it faces itself."""

    def __init__(
        self, discretisation: Discretisation, facets: Integers, *, reach: float, depth: float
    ) -> None:
        """`facets` of one side of the wall, outside or cavity.

        Gaps above `reach` in m are not looked for. `depth` in m is how far parts may have passed
        through each other and still count as such: less than the thinnest wall, whose other face
        is opposed as well.
        """
        self._d = discretisation
        self._facets = np.asarray(facets, dtype=np.int64)
        self._reach = reach
        self._depth = depth
        self._samples = _Samples(discretisation, self._facets, _COARSE)
        self._corners = discretisation.mesh.facets[:, self._facets].T

    def smallest_gap(self, x: Array) -> Gap | None:
        """The closest facing points for the displacements in x; None if all are out of reach."""
        places, normals, number = self._samples.at(x)
        tree = cKDTree(places)
        # most pairs are far apart: look near first, but as far as parts may have passed through
        nearer = self._reach / 2.0 ** np.arange(_NARROWER, 0, -1)
        for reach in (*nearer[nearer >= self._depth], self._reach):
            pairs = tree.query_pairs(reach, output_type="ndarray")
            distance, faces = self._facing(places, normals, pairs)
            pairs, distance = pairs[faces], distance[faces]
            corners = self._corners[number[pairs]]
            shared = corners[:, 0, :, None] == corners[:, 1, None, :]
            apart = ~shared.any(axis=(1, 2))
            pairs, distance = pairs[apart], distance[apart]
            if len(pairs):
                break
        else:
            return None
        order = np.argsort(distance, kind="stable")
        best, seen = None, set[tuple[int, int]]()
        for k in order:
            first, second = (int(i) for i in number[pairs[k]])
            if (first, second) in seen:
                continue
            seen.add((first, second))
            found = self._closer(x, first, second)
            if found is not None and (best is None or found.distance < best.distance):
                best = found
            if len(seen) >= _CANDIDATES:
                break
        return best

    def _closer(self, x: Array, first: int, second: int) -> Gap | None:
        facets = self._facets[[first, second]]
        places, normals, number = _Samples(self._d, facets, _FINE).at(x)
        here, there = np.flatnonzero(number == 0), np.flatnonzero(number == 1)
        near = cKDTree(places[there]).query(places[here])[1]
        pairs = np.stack((here, there[near]), axis=1)
        distance, faces = self._facing(places, normals, pairs)
        if not faces.any():
            return None
        k = int(np.flatnonzero(faces)[np.argmin(distance[faces])])
        a, b = pairs[k]
        return Gap(float(distance[k]), (places[a], places[b]), (int(facets[0]), int(facets[1])))

    def _facing(
        self, places: Array, normals: Array, pairs: Integers
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Signed distances of pairs of samples, and which of the pairs face each other."""
        a, b = pairs.T
        between = places[b] - places[a]
        length = np.linalg.norm(between, axis=1)
        out = np.einsum("ni,ni->n", between, normals[a])
        back = -np.einsum("ni,ni->n", between, normals[b])
        opposed = np.einsum("ni,ni->n", normals[a], normals[b]) < -_FACING
        outside = (out >= _FACING * length) & (back >= _FACING * length)
        inside = (out < -_FACING * length) & (back < -_FACING * length) & (length < self._depth)
        return np.where(inside, -length, length), opposed & (outside | inside)


class _Samples:
    def __init__(self, d: Discretisation, facets: Integers, count: int) -> None:
        side = np.linspace(0.0, 1.0, count)
        lattice = np.stack(np.meshgrid(*[side] * (d.dim - 1), indexing="ij")).reshape(d.dim - 1, -1)
        if isinstance(d.mesh, skfem.MeshTet1):
            lattice = lattice[:, lattice.sum(axis=0) <= 1 + 1e-12]
        weights = np.ones(lattice.shape[1])
        basis = skfem.FacetBasis(
            d.mesh, d.element, facets=facets, quadrature=(lattice, weights), disable_doflocs=True
        )
        shape = basis.dx.shape
        self._values = np.stack(
            [np.broadcast_to(np.asarray(b[0]), shape) for b in basis.basis], axis=-1
        )
        self._slopes = np.stack([np.moveaxis(b[0].grad, 0, 2) for b in basis.basis], axis=-1)
        self._nodes = basis.element_dofs.T.astype(np.int64)
        self._normals = np.moveaxis(np.asarray(basis.normals), 0, -1)
        self._rest = d.nodes
        self._dim = d.dim

    def at(self, x: Array) -> tuple[Array, Array, Integers]:
        """Places and outward unit normals (n, dim) for displacements, and each one's facet."""
        u = x[: self._rest.size].reshape(self._rest.shape)
        places = self._values @ (self._rest + u)[self._nodes]
        gradient = np.eye(self._dim) + np.einsum(
            "fai,fqja->fqij", u[self._nodes], self._slopes, optimize=True
        )
        # Nanson: n da = cof F N dA
        normals = np.linalg.solve(gradient.swapaxes(-1, -2), self._normals[..., None])[..., 0]
        normals *= np.sign(np.linalg.det(gradient))[..., None]
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        number = np.repeat(np.arange(len(places)), places.shape[1])
        return (
            places.reshape(-1, self._dim),
            normals.reshape(-1, self._dim),
            number,
        )
