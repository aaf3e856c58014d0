"""Parts whose meshes do not match, tied where they lie on each other: a mortar method.

Both parts are on one discretisation, as a mesh of two components. On the facets of one of them,
the slave, tractions are interpolated linearly between corners A by hats phi_A; the gap of a corner
is g_A = int phi_A (u_slave - u_master) dA / int phi_A dA. Linear tractions suit quadratic
displacements (Puso, Laursen & Solberg, Comput. Methods Appl. Mech. Eng. 197 (2008) 555). Facets
are cut where those of the other part meet, so that integrals are exact between flat parallelograms
and triangles, and a constant stress passes (patch test).

Multipliers are augmented Lagrangians, as in contact: solve by `rig.mechanics.fe.contact.settle`.
Without it the tie is a penalty, t_A = e g_A, too soft by a layer of stiffness e.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from skfem import ElementLineP1, ElementTriP1
from skfem.quadrature import get_quadrature

from rig.mechanics.fe.discretisation import Discretisation, Integers, Kinematics, node_dofs
from rig.mechanics.fe.errors import MeshError
from rig.mechanics.fe.facets import Facets

Array = NDArray[np.float64]

_NEWTON = 20
"""Steps to the closest point of a facet; plane ones need a single one."""
_COVERED = 1e-2
"""Share of a slave facet's area that the pieces of curved facets may miss or count twice."""

_UNIT = {
    False: (((1, 0), 0.0), ((-1, 0), -1.0), ((0, 1), 0.0), ((0, -1), -1.0)),
    True: (((1, 0), 0.0), ((0, 1), 0.0), ((-1, -1), -1.0)),
}
"""Edges of a facet's coordinates by kind: inward normals n and what n . s is at least."""


class Tie:
    """Facets of one part that move as those of another: an `Augmented` item of a model."""

    symmetric = True

    def __init__(
        self,
        discretisation: Discretisation,
        slave: Integers,
        master: Integers,
        *,
        penalty: float,
        tolerance: float,
    ) -> None:
        """`slave`, better the finer mesh, must lie on `master` all over.

        `penalty` in Pa/m, about a hundred times Young's modulus over an element's size, decides
        how fast multipliers settle. They are updated until no corner misses by more than
        `tolerance` in m. Displacements are tied as they are, so curved parts that are a gap apart
        at rest would strain by that gap when they turn: more than 1 % of a facet's size is refused.

        Raises MeshError where the parts do not lie on each other.
        """
        d = discretisation
        self.penalty = penalty
        self.tolerance = tolerance
        weights, area = _coupling(d, np.asarray(slave), np.asarray(master))
        counts = np.diff(weights.indptr)
        width = int(counts.max())
        # rows of different lengths end with a node of theirs that has no weight
        column = np.arange(width)
        inside = column < counts[:, None]
        entry = weights.indptr[:-1, None] + np.where(inside, column, 0)
        self.dofs = node_dofs(weights.indices[entry].astype(np.int64), d.dim)
        self._weights = np.where(inside, weights.data[entry], 0.0)
        self._area = area
        self._traction = np.zeros((len(area), d.dim))

    def gap(self, x: Array) -> Array:
        """Mean gaps at the corners of the slave in m, (corners, dim)."""
        moved = x[self.dofs].reshape(*self._weights.shape, -1)
        return np.asarray(np.einsum("ca,cai->ci", self._weights, moved) / self._area[:, None])

    def traction(self, x: Array) -> Array:
        """Tractions of the master on the slave, in Pa of undeformed area, (corners, dim)."""
        return -self._traction - self.penalty * self.gap(x)

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Residual and its exact derivative, which is constant; see `Item`."""
        w = self._weights
        residual = -np.einsum("ca,ci->cai", w, self.traction(x))
        stiff = np.einsum("ca,cb->cab", self.penalty / self._area[:, None] * w, w)
        tangent = np.einsum("cab,ij->caibj", stiff, np.eye(self._traction.shape[1]))
        return residual.reshape(self.dofs.shape), tangent.reshape(*self.dofs.shape, -1)

    def settle(self, x: Array, /) -> float:
        """Multipliers become the tractions, unless corners miss by less than the tolerance."""
        worst = float(np.linalg.norm(self.gap(x), axis=1).max()) / self.tolerance
        if worst > 1.0:
            self._traction = -self.traction(x)
        return worst

    def accept(self, x: Array, /) -> None:
        """Nothing slides: nothing is to be remembered."""


def _coupling(
    d: Discretisation, slave: Integers, master: Integers
) -> tuple[sparse.csr_array, Array]:
    """Integrals of hats times u_slave - u_master, (corners, nodes), and of the hats, (corners,)."""
    ours, theirs = Facets.of(d, slave), Facets.of(d, master)
    corner_nodes = ours.nodes[:, list(ours.outline)]
    corners, number = np.unique(corner_nodes, return_inverse=True)
    number = number.reshape(corner_nodes.shape)
    rows, columns, values = [], [], []
    size = np.ptp(ours.places, axis=1).max(axis=1)
    for k in range(len(slave)):
        one = ours.part(np.array([k]))
        covered, whole = 0.0, _area(d, one)
        for j in _nearby(one, theirs, 0.01 * size[k]):
            other = theirs.part(np.array([j]))
            points, cut = _overlap(one, other)
            if not len(points):
                continue
            hats, shapes = one.hats(points), one.shapes(points)
            here = shapes[0] @ one.places[0]
            where, miss = _closest(other, here)
            if miss.max() > 0.01 * size[k]:
                continue
            weight = cut * _jacobian(d, one, points)
            covered += float(weight.sum())
            moving = np.concatenate((shapes[0], -other.shapes(where)[0]), axis=1)
            nodes = np.concatenate((one.nodes[0], other.nodes[0]))
            block = np.einsum("q,qc,qa->ca", weight, hats, moving)
            rows.append(np.repeat(number[k], len(nodes)))
            columns.append(np.tile(nodes, len(block)))
            values.append(block.reshape(-1))
        if abs(covered / whole - 1) > _COVERED:
            at = ", ".join(f"{1e3 * c:.4g}" for c in one.places[0].mean(axis=0))
            raise MeshError(
                f"{100 * covered / whole:.4g} % of the facet around ({at}) mm lies on the part it "
                "is to be tied to. Tie the smaller surface to the larger one, and let both lie "
                "within 1 % of a facet's size of each other."
            )
    shape = (len(corners), len(d.nodes))
    entries = (np.concatenate(rows), np.concatenate(columns))
    weights = sparse.csr_array(sparse.coo_array((np.concatenate(values), entries), shape=shape))
    own = np.isin(np.arange(shape[1]), ours.nodes)
    # displacements of the slave alone, all 1: what the hats integrate to
    return weights, np.asarray(weights @ own.astype(float))


def _nearby(one: Facets, others: Facets, slack: float) -> Integers:
    """Facets whose boxes meet that of the first."""
    low, high = one.places[0].min(axis=0) - slack, one.places[0].max(axis=0) + slack
    meets = (others.places.min(axis=1) <= high) & (others.places.max(axis=1) >= low)
    return np.flatnonzero(meets.all(axis=1))


def _overlap(one: Facets, other: Facets) -> tuple[Array, Array]:
    """Points (n, dim - 1) and weights of a quadrature over what lies on the other facet.

    Both are in the coordinates of the first; edges between projected corners are taken as straight.
    """
    outline, _ = _closest(one, other.places[0][list(other.outline)])
    if one.dim == 2:
        low, high = np.clip(np.sort(outline[:, 0]), 0.0, 1.0)
        points, weights = get_quadrature(ElementLineP1, 6)
        return low + (high - low) * points.T, (high - low) * weights
    piece = _clipped(outline, _UNIT[one.triangular])
    if len(piece) < 3:
        return np.zeros((0, 2)), np.zeros(0)
    points, weights = get_quadrature(ElementTriP1, 6)
    origin = piece[0]
    found, cut = [], []
    for a, b in zip(piece[1:-1] - origin, piece[2:] - origin, strict=True):
        found.append(origin + points.T @ np.stack((a, b)))
        cut.append(abs(a[0] * b[1] - a[1] * b[0]) * weights)
    return np.concatenate(found), np.concatenate(cut)


def _clipped(polygon: Array, edges: tuple[tuple[tuple[int, int], float], ...]) -> Array:
    """The part of a convex polygon (n, 2) within straight edges (Sutherland & Hodgman 1974)."""
    for normal, least in edges:
        height = polygon @ np.array(normal, dtype=float) - least
        kept = []
        for i in range(len(polygon)):
            a, b = height[i - 1], height[i]
            if (a < 0) != (b < 0):
                kept.append(polygon[i - 1] + a / (a - b) * (polygon[i] - polygon[i - 1]))
            if b >= 0:
                kept.append(polygon[i])
        polygon = np.array(kept).reshape(-1, 2)
    return polygon


def _closest(facet: Facets, places: Array) -> tuple[Array, Array]:
    """Coordinates (n, dim - 1) of the points of one facet, continued beyond its edges, that are
    closest to some places, and how far away they are in m, (n,)."""
    s = np.full((len(places), facet.dim - 1), 1 / 3)
    for _ in range(_NEWTON):
        values, slopes = facet.shapes(s)
        tangents = np.einsum("qak,ai->qik", slopes, facet.places[0])
        away = places - values @ facet.places[0]
        step = np.linalg.solve(
            tangents.swapaxes(1, 2) @ tangents, tangents.swapaxes(1, 2) @ away[..., None]
        )[..., 0]
        # corners of facets far round a bend would run away
        s = np.clip(s + step, -10.0, 10.0)
        if np.abs(step).max() < 1e-12:
            break
    return s, np.linalg.norm(places - facet.shapes(s)[0] @ facet.places[0], axis=1)


def _jacobian(d: Discretisation, facet: Facets, s: Array) -> Array:
    """Undeformed area in m2 to a unit of the facet's coordinates, of the full turn where
    axisymmetric, (n,)."""
    values, slopes = facet.shapes(s)
    tangents = np.einsum("qak,ai->qik", slopes, facet.places[0])
    area = np.sqrt(np.linalg.det(tangents.swapaxes(1, 2) @ tangents))
    if d.kinematics is Kinematics.AXISYMMETRIC:
        area = area * 2 * np.pi * (values @ facet.places[0])[:, 0]
    return np.asarray(area)


def _area(d: Discretisation, facet: Facets) -> float:
    points, weights = _overlap(facet, facet)
    return float(weights @ _jacobian(d, facet, points))
