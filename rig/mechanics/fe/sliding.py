"""Frictional contact of two deformable parts that slide on each other: points on curved facets.

Points y of the slave's surface face points x(s) of the master's. Within one step of a path s is
kept: it is where the point was closest when the last step was accepted. The gap is measured along
the normal of the master as it is now, g = n . (y - x), so that turning together costs nothing, and
pushes back by t = e max(0, -g), e being the penalty. With the tangents a_i of the master's facet,
d = y - x and the dual basis a^i, dn = -(n . da_i) a^i gives the exact derivatives of g (Wriggers,
Computational Contact Mechanics, 2006, Section 6.3, at fixed s):

    dg  = n . (dy - dx) - (n . da_i)(a^i . d)
    ddg = -2 sym[(n . da_i)(a^i . (dy - dx))] + 2 sym[(n . da_i)(a^i . da_j)(a^j . d)]
          - m^ij g (n . da_i)(n . da_j)

The onset is rounded off within a softness c on both sides of g = 0: there t = e (c - g)^2 / (4 c).

Coulomb friction is that of elastic stick: q_i = q0_i - (mu t0 / s) d . a_i, cut to |q| <= mu t0.
Drag q0 and pressure t0 are those of the last accepted step, s is how far a point creeps before it
slides. That the limit is a step late keeps the system symmetric and Newton from chattering;
as with plasticity, steps decide how well the path is followed.

Beyond the master's rim the pressure fades over a short way, instead of being lost at a point.
Forces are per *undeformed* area of the slave; points are the four Gauss points a direction,
so that few at once leave the master.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Discretisation, Integers, node_dofs
from rig.mechanics.fe.errors import MeshError
from rig.mechanics.fe.facets import Facets
from rig.mechanics.fe.onset import rounded

Array = NDArray[np.float64]

_GAUSS, _SHARE = (a / 2 for a in np.polynomial.legendre.leggauss(4))
_GAUSS = _GAUSS + 0.5
_NEWTON = 12
_LOST = 0.5
"""Of a facet: how far a point may have moved across its column before it is let go."""


class _Memory(NamedTuple):
    """What a point knows of the last accepted step; columns of one array (points, 7)."""

    facet: Integers
    """Which of the candidates of its part it faces."""
    s: Array
    """Where on it, (points, 2)."""
    hold: Array
    """1 within the master's rim, down to 0 beyond it."""
    pressed: Array
    """Normal traction in Pa, (points,)."""
    drag: Array
    """Friction's traction along the tangents there, q . a_i in Pa m, (points, 2)."""

    @classmethod
    def of(cls, array: Array) -> _Memory:
        facet, rest = array[:, 0].astype(np.int64), array[:, 1:]
        return cls(facet, rest[:, :2], rest[:, 2], rest[:, 3], rest[:, 4:])

    def array(self) -> Array:
        return np.column_stack((self.facet, self.s, self.hold, self.pressed, self.drag))


@dataclass(frozen=True)
class Grip:
    """What the parts feel of each other."""

    pressure: Array
    """Normal traction at the points in Pa, (points,)."""
    drag: Array
    """Size of friction's traction there in Pa, (points,)."""
    gap: Array
    """Along the normal in m, negative inside, (points,); not a number off the master's rim."""
    area: Array
    """Undeformed, of each point in m2, (points,)."""
    places: Array
    """Of the points at rest in m, (points, 3)."""


class Sliding:
    """Facets of one part that may slide on those of another and lift off: an `Interface`."""

    symmetric = True

    def __init__(
        self,
        discretisation: Discretisation,
        slave: Integers,
        master: Integers,
        *,
        penalty: float,
        friction: float = 0.0,
        direction: tuple[float, float, float],
        reach: float,
        rim: float,
        softness: float,
        slip: float,
    ) -> None:
        """`slave` and `master` are facets of hexahedra, close to each other at rest.

        They slide along `direction`, where every point may get as far as `reach` in m; across it,
        points keep to the column of facets that they are in. `penalty` in Pa/m; `softness` in m
        rounds off the onset of contact, `slip` in m is what sticking points creep before they
        slide. Beyond the rim of the master pressure fades over `rim` in m.

        Raises MeshError where no point of the slave has anything to face.
        """
        d = discretisation
        self.penalty = penalty
        self.friction = friction
        self.slave, self.master = np.asarray(slave), np.asarray(master)
        self._slave, self._master = Facets.of(d, self.slave), Facets.of(d, self.master)
        self._direction = np.asarray(direction, dtype=float)
        self._direction /= np.linalg.norm(self._direction)
        self._rim = rim
        self._softness = softness
        self._slip = slip
        a, b = np.meshgrid(_GAUSS, _GAUSS, indexing="ij")
        points = np.stack((a.reshape(-1), b.reshape(-1)), axis=-1)
        self._values, slopes = self._slave.shapes(points)
        tangents = np.einsum("qak,fai->fqik", slopes, self._slave.places)
        normals = np.cross(tangents[..., 0], tangents[..., 1])
        self._area = np.outer(_SHARE, _SHARE).reshape(-1) * np.linalg.norm(normals, axis=-1)
        parts, self._candidates = self._facing(reach)
        self._slave = self._slave.part(parts)
        self._area = self._area[parts].reshape(-1)
        self._part = np.repeat(np.arange(len(parts)), len(points))
        self._way = self._ways()
        self._lay_out(d)

    def _facing(self, reach: float) -> tuple[Integers, Integers]:
        """Facets of the slave that have candidates, and these, (parts, most); -1 where fewer."""
        places = np.einsum("qa,fai->fqi", self._values, self._slave.places)
        flat = places.reshape(-1, 3)
        centres = self._master.places.mean(axis=1)
        size = np.linalg.norm(self._master.places - centres[:, None], axis=2).max()
        far = np.linalg.norm(flat[:, None] - centres[None], axis=2)
        point, facet = np.nonzero(far < size + reach)
        s, _ = self._closest(facet, self._master.places[facet], flat[point])
        inside = np.clip(s, 0.0, 1.0)
        values, _ = self._master.shapes(inside)
        away = flat[point] - np.einsum("na,nai->ni", values, self._master.places[facet])
        along = away @ self._direction
        across = np.linalg.norm(away - along[:, None] * self._direction, axis=1)
        near = (np.abs(along) <= reach) & (across <= 0.02 * size)
        pairs = np.unique(np.stack((point[near] // len(self._values), facet[near]), axis=1), axis=0)
        if not len(pairs):
            raise MeshError(
                f"no point of the sliding part has any facet of the other one within "
                f"{1e3 * reach:.3g} mm along the way it slides; check the sets of facets."
            )
        parts, counts = np.unique(pairs[:, 0], return_counts=True)
        candidates = np.full((len(parts), int(counts.max())), -1)
        column = np.arange(len(pairs)) - np.repeat(np.cumsum(counts) - counts, counts)
        candidates[np.repeat(np.arange(len(parts)), counts), column] = pairs[:, 1]
        return parts, candidates

    def _ways(self) -> Integers:
        """Which coordinate of each facet of the master runs along the direction."""
        _, slopes = self._master.shapes(np.array([0.5, 0.5]))
        tangents = np.einsum("ak,fai->fik", slopes, self._master.places)
        share = np.abs(np.einsum("fik,i->fk", tangents, self._direction))
        return np.asarray(np.argmax(share / np.linalg.norm(tangents, axis=1), axis=1))

    def _lay_out(self, d: Discretisation) -> None:
        """Numbering: nodes of each part and of all its candidates, once each."""
        rows = [
            np.unique(np.concatenate((own, self._master.nodes[facets[facets >= 0]].reshape(-1))))
            for own, facets in zip(self._slave.nodes, self._candidates, strict=True)
        ]
        width = max(len(row) for row in rows)
        # rows of different lengths end with their first node, to which nothing is added
        nodes = np.stack([np.append(row, np.full(width - len(row), row[0])) for row in rows])
        self.dofs = node_dofs(nodes, d.dim)
        self._sizes = np.array([len(row) for row in rows])
        self._nodes = nodes
        self._own = np.stack(
            [np.searchsorted(row, own) for row, own in zip(rows, self._slave.nodes, strict=True)]
        )
        facets = np.maximum(self._candidates, 0)
        theirs = self._master.nodes[facets]
        self._theirs = np.stack(
            [np.searchsorted(row, each) for row, each in zip(rows, theirs, strict=True)]
        )

    def virgin(self, size: int) -> Array:
        """The memory at rest, of a model with `size` degrees of freedom."""
        count = len(self._part)
        return self._paired(np.zeros(size), np.zeros(count), np.zeros((count, 3)))

    def settled(self, x: Array, memory: Array) -> Array:
        """Points paired anew with the displacements in x; what has slid has slid for good."""
        at = self._contact(x, _Memory.of(memory))
        return self._paired(x, at.pressure, np.einsum("nk,nki->ni", at.drag, at.dual))

    def _paired(self, x: Array, pressed: Array, drag: Array) -> Array:
        """The memory of points with these tractions, (points,) and (points, 3) in Pa."""
        places = self._places(x)
        best = np.full(len(places), np.inf)
        found = _Memory.of(np.zeros((len(places), 7)))
        found.pressed[:] = pressed
        for column in range(self._candidates.shape[1]):
            facet = self._candidates[self._part, column]
            there = facet >= 0
            facet = np.maximum(facet, 0)
            now = self._master.now(x)[facet]
            s, tangents = self._closest(facet, now, places)
            beyond = np.maximum(np.maximum(-s, s - 1), 0.0)
            lengths = np.linalg.norm(tangents, axis=1)
            way = self._way[facet]
            rows = np.arange(len(facet))
            along = beyond[rows, way] * lengths[rows, way]
            aside = beyond[rows, 1 - way]
            # neighbours across the way share their edge: the nearer one
            distance = along + 1e-3 * aside * lengths[rows, 1 - way]
            closer = there & (aside <= _LOST) & (distance < best)
            best = np.where(closer, distance, best)
            found.facet[closer] = column
            found.s[closer] = s[closer]
            found.hold[closer] = np.clip(1 - along[closer] / self._rim, 0.0, 1.0)
            found.drag[closer] = np.einsum("nik,ni->nk", tangents, drag)[closer]
        found.drag[found.hold == 0] = 0.0
        return found.array()

    def evaluate(self, x: Array, memory: Array) -> tuple[Array, Array]:
        """Residual and the derivative described above; see `Interface`."""
        at = self._contact(x, _Memory.of(memory))
        t, w = at.pressure, self._area
        force = -(w * t)[:, None] * at.slope - np.einsum("n,nk,nkm->nm", w, at.drag, at.shear)
        outer = at.bend[:, :, :, None] * at.shear[:, :, None, :]
        curl = np.einsum("nil,njim,nj->nlm", at.bend, at.stretch, at.offset)
        second = -outer.sum(axis=1) + curl
        second = second + second.swapaxes(1, 2)
        curved = at.gap[:, None, None] * at.inverse
        second -= np.einsum("nij,nik,njl->nkl", curved, at.bend, at.bend, optimize=True)
        stiff = (w * at.stiffness)[:, None, None] * at.slope[:, :, None] * at.slope[:, None, :]
        stiff -= (w * t)[:, None, None] * second
        stiff += np.einsum("n,nik,nij,njl->nkl", w, at.shear, at.stick, at.shear, optimize=True)
        return self._summed(force, stiff, at.dofs)

    def grip(self, x: Array, memory: Array) -> Grip:
        """Pressure, friction and gap at some displacements."""
        known = _Memory.of(memory)
        at = self._contact(x, known)
        drag = np.linalg.norm(np.einsum("nk,nki->ni", at.drag, at.dual), axis=1)
        places = np.einsum("qa,fai->fqi", self._values, self._slave.places).reshape(-1, 3)
        return Grip(at.pressure, drag, np.where(known.hold > 0, at.gap, np.nan), self._area, places)

    def _places(self, x: Array) -> Array:
        places = np.einsum("qa,fai->fqi", self._values, self._slave.now(x))
        return np.asarray(places.reshape(-1, 3))

    def _contact(self, x: Array, known: _Memory) -> _Contact:
        facet = self._candidates[self._part, known.facet]
        nodes = self._master.now(x)[facet]
        values, slopes = self._master.shapes(known.s)
        tangents = np.einsum("nak,nai->nki", slopes, nodes)
        normal = np.cross(tangents[:, 0], tangents[:, 1]) * self._master.outward[facet][:, None]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        metric = np.einsum("nki,nli->nkl", tangents, tangents)
        inverse = np.linalg.inv(metric)
        dual = np.einsum("nkl,nli->nki", inverse, tangents)
        away = self._places(x) - np.einsum("na,nai->ni", values, nodes)
        own = np.tile(self._values, (len(self._candidates), 1))
        difference = np.concatenate((own, -values), axis=1)
        steepness = np.concatenate((np.zeros((*own.shape, 2)), slopes), axis=1)

        def along(vectors: Array, weights: Array) -> Array:
            return np.asarray(
                (weights[..., :, None] * vectors[..., None, :]).reshape(*vectors.shape[:-1], -1)
            )

        bend = np.stack([along(normal, steepness[..., k]) for k in range(2)], axis=1)
        stretch = np.stack(
            [along(dual, np.repeat(steepness[:, None, :, k], 2, axis=1)) for k in range(2)], axis=1
        )  # (n, of da_k, along a^j, dofs)
        shear = along(dual, np.repeat(difference[:, None], 2, axis=1))
        offset = np.einsum("nki,ni->nk", dual, away)
        gap = np.einsum("ni,ni->n", normal, away)
        slope = along(normal, difference) - np.einsum("nk,nkm->nm", offset, bend)
        depth, inside = rounded(-gap, self._softness)
        stiffness = self.penalty * known.hold * inside
        pressure = self.penalty * known.hold * depth
        drag, stick = self._friction(known, tangents, metric, inverse, away)
        dofs = np.concatenate(
            (self._own[self._part], self._theirs[self._part, known.facet]), axis=1
        )
        return _Contact(
            gap, pressure, stiffness, slope, bend, stretch, shear, offset, inverse, dual, drag,
            stick, dofs,
        )  # fmt: skip

    def _friction(
        self,
        known: _Memory,
        tangents: Array,
        metric: Array,
        inverse: Array,
        away: Array,
    ) -> tuple[Array, Array]:
        """Tractions q . a_i (points, 2), and minus their derivative by a^i . (dy - dx)."""
        if not self.friction:
            return np.zeros_like(known.drag), np.zeros_like(metric)
        limit = self.friction * known.pressed
        stiffness = limit / self._slip
        trial = known.drag - stiffness[:, None] * np.einsum("nki,ni->nk", tangents, away)
        size = np.sqrt(np.einsum("nk,nkl,nl->n", trial, inverse, trial))
        slips = size > limit
        share = np.where(slips, limit / np.where(slips, size, 1.0), 1.0)
        way = trial / np.where(size > 0, size, 1.0)[:, None]
        left = np.where(slips, 1.0, 0.0)[:, None, None] * way[:, :, None] * way[:, None, :]
        stick = (share * stiffness)[:, None, None] * (metric - left)
        return share[:, None] * trial, stick

    def _summed(self, force: Array, stiff: Array, where: Integers) -> tuple[Array, Array]:
        """Contributions of points to the degrees of freedom of their parts."""
        parts, width = self.dofs.shape
        local = node_dofs(where, 3)
        rows = self._part[:, None] * width + local
        residual = np.bincount(rows.reshape(-1), force.reshape(-1), minlength=parts * width)
        entry = rows[:, :, None] * width + local[:, None, :]
        tangent = np.bincount(entry.reshape(-1), stiff.reshape(-1), minlength=parts * width**2)
        return (
            np.asarray(residual.reshape(parts, width)),
            np.asarray(tangent.reshape(parts, width, width)),
        )

    def _closest(self, facet: Integers, nodes: Array, places: Array) -> tuple[Array, Array]:
        """Coordinates (n, 2) of the points of facets, continued beyond their edges, closest to
        one place each, and the tangents there (n, 3, 2)."""
        s = np.full((len(facet), 2), 0.5)
        for _ in range(_NEWTON):
            values, slopes = self._master.shapes(s)
            tangents = np.einsum("nak,nai->nik", slopes, nodes)
            away = places - np.einsum("na,nai->ni", values, nodes)
            right = np.einsum("nik,ni->nk", tangents, away)
            step = np.linalg.solve(tangents.swapaxes(1, 2) @ tangents, right[..., None])[..., 0]
            s = np.clip(s + step, -2.0, 3.0)
            if np.abs(step).max(initial=0.0) < 1e-10:
                break
        return s, np.einsum("nak,nai->nik", self._master.shapes(s)[1], nodes)


@dataclass(frozen=True)
class _Contact:
    """All points at some displacements; m runs over the degrees of freedom of both facets."""

    gap: Array
    pressure: Array
    stiffness: Array
    """e where pressed, else 0."""
    slope: Array
    """dg, (n, m)."""
    bend: Array
    """n . da_i, (n, 2, m)."""
    stretch: Array
    """a^j . da_i, (n, i, j, m)."""
    shear: Array
    """a^i . (dy - dx), (n, 2, m)."""
    offset: Array
    """a^i . d, (n, 2)."""
    inverse: Array
    """m^ij, (n, 2, 2)."""
    dual: Array
    """a^i, (n, 2, 3)."""
    drag: Array
    """q . a_i, (n, 2)."""
    stick: Array
    """Minus the derivative of the drag by a^i . (dy - dx), (n, 2, 2)."""
    dofs: Integers
    """Nodes among those of the part, (n, 18)."""


__all__ = ["Grip", "Sliding"]
