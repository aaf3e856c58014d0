"""Where a soft surface comes close to itself: the smallest gap between facing parts, as of flanks.

The engine does not push such parts apart; this tells whether it should have. Facets are sampled
where they are now, curved as they are, at the points of a lattice; two samples face each other
where their outward normals are opposed within 30 degrees and the line between them follows both
within 30 degrees: round the root of a fold the gap may be 3 % smaller than between its flanks.
Facets that share a corner are not looked at: in a fold they always meet. The closest pairs of
facets are sampled again, at 17 points a direction instead of two. Parts that have passed through
each other by less than `depth` have a negative gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from rig.mechanics.fe.discretisation import Discretisation, Integers
from rig.mechanics.fe.facets import Facets

Array = NDArray[np.float64]

_COARSE, _FINE = 2, 17
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
        self._facets = np.asarray(facets, dtype=np.int64)
        self._reach = reach
        self._depth = depth
        self._surfaces = Facets.of(discretisation, self._facets)
        shape = (discretisation.dim, self._surfaces.triangular)
        # off the edges, which neighbours share
        self._coarse = _lattice(*shape, (np.arange(_COARSE) + 0.5) / _COARSE)
        self._fine = _lattice(*shape, np.linspace(0.0, 1.0, _FINE))
        self._corners = discretisation.mesh.facets[:, self._facets].T

    def smallest_gap(self, x: Array) -> Gap | None:
        """The closest facing points for the displacements in x; None if all are out of reach."""
        places, normals = self._surfaces.at(x, self._coarse)
        number = np.repeat(np.arange(len(places)), places.shape[1])
        places, normals = (a.reshape(-1, a.shape[-1]) for a in (places, normals))
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
        at, directions = self._surfaces.part(np.array([first, second])).at(x, self._fine)
        places, normals = np.concatenate(at), np.concatenate(directions)
        count = len(self._fine)
        here = np.arange(count)
        near = cKDTree(at[1]).query(at[0])[1]
        pairs = np.stack((here, count + near), axis=1)
        distance, faces = self._facing(places, normals, pairs)
        if not faces.any():
            return None
        k = int(np.flatnonzero(faces)[np.argmin(distance[faces])])
        a, b = pairs[k]
        return Gap(
            float(distance[k]),
            (places[a], places[b]),
            (int(self._facets[first]), int(self._facets[second])),
        )

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


def _lattice(dim: int, triangular: bool, side: Array) -> Array:
    """Points of a facet, (n, dim - 1)."""
    lattice = np.stack(np.meshgrid(*[side] * (dim - 1), indexing="ij"), axis=-1)
    points = lattice.reshape(-1, dim - 1)
    return points[points.sum(axis=1) <= 1 + 1e-12] if triangular else points
