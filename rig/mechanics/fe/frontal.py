"""A multifrontal Cholesky solver for the symmetric systems of soft shells, on BLAS alone.

SciPy's SuperLU treats every matrix as unsymmetric, works on small supernodes, and repeats its
analysis every time. Here the analysis is done once per pattern: nested dissection by level sets
(George, SIAM J. Numer. Anal. 10 (1973) 345; Gibbs, Poole & Stockmeyer, ibid. 13 (1976) 236 for
the starting points), then each separator or leaf is one dense front (Duff & Reid, ACM Trans.
Math. Softw. 9 (1983) 302): Cholesky of its pivots, the Schur complement handed to its parent.
A front that is not positive definite, as beyond a limit point, is pivoted within (Bunch-Kaufman).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import blas, lapack
from scipy.sparse.csgraph import breadth_first_order

from rig.mechanics.fe.discretisation import Integers
from rig.mechanics.fe.errors import SingularError

Array = NDArray[np.float64]

_LEAF = 48
"""Groups of unknowns (nodes) that are not worth dissecting further."""
_FAIR, _LOPSIDED = 0.62, 0.92
"""Share of the larger part that is welcome, and beyond which dissecting stops."""
_REFINE = 1e-9
"""Relative residual of a solution above which it is refined."""


_Run = tuple[int, int, int]
"""Rows low to high of a child that lie one after the other in its parent, from a third number."""


@dataclass(frozen=True)
class _Front:
    """One step of the elimination; rows ascend in the order of elimination."""

    pivots: slice
    """Positions eliminated here."""
    boundary: Integers
    """Positions of the rest of the front's rows."""
    source: tuple[Integers, Integers]
    """Where in the matrix' data the entries of the pivot and the boundary block come from."""
    target: tuple[Integers, Integers]
    """Where in those blocks (column by column) they belong."""
    children: tuple[int, ...]
    places: tuple[tuple[_Run, ...], ...]
    """For each child, where its boundary is among this front's rows."""


class Multifrontal:
    """Factorises symmetric matrices; analysis is repeated only when the pattern changes."""

    name = "multifrontal"

    def __init__(self) -> None:
        self._indices: NDArray[np.int32] | None = None
        self._order: Integers = np.zeros(0, dtype=np.int64)
        self._fronts: list[_Front] = []

    def factorise(self, matrix: sparse.csc_array) -> MultifrontalFactor:
        """The factors; raises SingularError."""
        known = self._indices
        if known is None or not np.array_equal(known, matrix.indices):
            self._analyse(matrix)
        return MultifrontalFactor(self._fronts, self._order, matrix)

    def _analyse(self, matrix: sparse.csc_array) -> None:
        group, first = _groups(matrix)
        graph = sparse.csr_array(matrix)[first][:, first]
        graph = sparse.csr_array(
            (np.ones(graph.nnz, dtype=np.int8), graph.indices, graph.indptr), shape=graph.shape
        )
        tree: list[tuple[Integers, tuple[int, ...]]] = []
        _dissect(graph, np.arange(graph.shape[0]), tree)
        # groups in the order of elimination, then unknowns
        size = np.bincount(group)
        groups = np.concatenate([own for own, _ in tree])
        place = np.empty(len(groups), dtype=np.int64)
        place[groups] = np.arange(len(groups))
        start = np.concatenate(([0], np.cumsum(size[groups])))
        self._order = np.argsort(place[group], kind="stable")
        position = np.empty(len(self._order), dtype=np.int64)
        position[self._order] = np.arange(len(self._order))
        self._fronts = _symbolic(matrix, graph, tree, place, start, position)
        self._indices = matrix.indices.copy()


class MultifrontalFactor:
    """A factorised matrix."""

    def __init__(self, fronts: Sequence[_Front], order: Integers, matrix: sparse.csc_array) -> None:
        self._fronts = fronts
        self._order = order
        self._matrix = matrix
        self._factors: list[_Dense] = []
        self.negative = False
        """Whether some front was not positive definite."""
        data = matrix.data
        updates: dict[int, Array] = {}
        for number, front in enumerate(fronts):
            k, m = front.pivots.stop - front.pivots.start, len(front.boundary)
            own = np.zeros((k, k), order="F")
            below = np.zeros((m, k), order="F")
            rest = np.zeros((m, m), order="F")
            own.reshape(-1, order="F")[front.target[0]] = data[front.source[0]]
            below.reshape(-1, order="F")[front.target[1]] = data[front.source[1]]
            for child, runs in zip(front.children, front.places, strict=True):
                update = updates.pop(child)
                for n, (low, high, at) in enumerate(runs):
                    end = at + high - low
                    for low_2, high_2, at_2 in runs[n:]:
                        part = update[low_2:high_2, low:high]
                        end_2 = at_2 + high_2 - low_2
                        if at_2 < k:
                            own[at_2:end_2, at:end] += part
                        elif at < k:
                            below[at_2 - k : end_2 - k, at:end] += part
                        else:
                            rest[at_2 - k : end_2 - k, at - k : end - k] += part
            dense = _Dense.of(own, below)
            self.negative |= dense.pivoting is not None
            if m:
                updates[number] = dense.schur(rest)
            self._factors.append(dense)

    def solve(self, right: Array) -> Array:
        """x with A x = `right`, (n,) or (n, k), refined once if round-off calls for it."""
        columns = right.reshape(len(right), -1)
        x = self._solve(columns)
        residual = columns - self._matrix @ x
        worst = np.linalg.norm(residual) / max(float(np.linalg.norm(columns)), 1e-300)
        if worst > _REFINE:
            x = x + self._solve(residual)
        return x.reshape(right.shape)

    def _solve(self, columns: Array) -> Array:
        y = np.asfortranarray(columns[self._order])
        for front, dense in zip(self._fronts, self._factors, strict=True):
            y[front.pivots] = dense.forward(y[front.pivots])
            if len(front.boundary):
                y[front.boundary] -= dense.down(y[front.pivots])
        for front, dense in zip(reversed(self._fronts), reversed(self._factors), strict=True):
            y[front.pivots] = dense.backward(y[front.pivots], y[front.boundary])
        x = np.empty_like(y)
        x[self._order] = y
        return x


@dataclass(frozen=True)
class _Dense:
    """The factored pivots of a front and what lies below them."""

    own: Array
    below: Array
    """L21 if positive definite, otherwise the block as it was."""
    pivoting: tuple[NDArray[np.int32], Array] | None
    """Bunch-Kaufman pivots, and own^-1 times the transposed block below."""

    @staticmethod
    def of(own: Array, below: Array) -> _Dense:
        lower, info = lapack.dpotrf(own, lower=1, clean=1)
        if info == 0:
            if len(below):
                below = blas.dtrsm(1.0, lower, below, side=1, lower=1, trans_a=1, overwrite_b=1)
            return _Dense(lower, below, None)
        ldl, pivots, info = lapack.dsytrf(own, lower=1)
        if info != 0 or not np.all(np.isfinite(ldl)):
            raise SingularError(
                "the tangent is singular: some part is not held, or the body is at a limit of "
                "stability. Check the supports."
            )
        across, _ = lapack.dsytrs(ldl, pivots, below.T, lower=1)
        return _Dense(ldl, below, (pivots, across))

    def schur(self, rest: Array) -> Array:
        """What the pivots leave to the parent; its lower triangle counts."""
        if self.pivoting is None:
            return np.asarray(
                blas.dsyrk(-1.0, self.below, beta=1.0, c=rest, lower=1, overwrite_c=1)
            )
        return rest - self.below @ self.pivoting[1]

    def forward(self, right: Array) -> Array:
        if self.pivoting is None:
            return np.asarray(blas.dtrsm(1.0, self.own, right, lower=1))
        return np.asarray(lapack.dsytrs(self.own, self.pivoting[0], right, lower=1)[0])

    def down(self, solved: Array) -> Array:
        return self.below @ solved

    def backward(self, solved: Array, later: Array) -> Array:
        if self.pivoting is not None:
            return solved - self.pivoting[1] @ later if len(later) else solved
        if len(later):
            solved = solved - self.below.T @ later
        return np.asarray(blas.dtrsm(1.0, self.own, solved, lower=1, trans_a=1))


def _groups(matrix: sparse.csc_array) -> tuple[Integers, Integers]:
    """Number of the group of each unknown, and the first unknown of each: neighbours in the
    numbering whose columns look alike, as those of a node do."""
    starts, counts = matrix.indptr[:-1], np.diff(matrix.indptr)
    index = matrix.indices.astype(np.int64)
    total = np.add.reduceat(index, starts)
    mixed = np.add.reduceat((index * 2654435761) % 4294967291, starts)
    same = (counts[1:] == counts[:-1]) & (total[1:] == total[:-1]) & (mixed[1:] == mixed[:-1])
    group = np.concatenate(([0], np.cumsum(~same)))
    first = np.flatnonzero(np.concatenate(([True], ~same)))
    return group, first


def _dissect(
    graph: sparse.csr_array, nodes: Integers, tree: list[tuple[Integers, tuple[int, ...]]]
) -> tuple[int, ...]:
    """Append the fronts of `nodes` to `tree`, children first; the roots appended."""
    if len(nodes) <= _LEAF:
        tree.append((nodes, ()))
        return (len(tree) - 1,)
    level = _levels(graph)
    apart = np.flatnonzero(level < 0)
    if len(apart):
        roots: tuple[int, ...] = ()
        for part in (np.flatnonzero(level >= 0), apart):
            roots += _dissect(graph[part][:, part], nodes[part], tree)
        return roots
    cut = _cut(graph, level)
    if cut is None:
        tree.append((nodes, ()))
        return (len(tree) - 1,)
    below, separator, above = cut
    children: tuple[int, ...] = ()
    for part in (below, above):
        if len(part):
            children += _dissect(graph[part][:, part], nodes[part], tree)
    tree.append((nodes[separator], children))
    return (len(tree) - 1,)


def _levels(graph: sparse.csr_array) -> Integers:
    """Distance of every node from one at the far end; -1 where it cannot be reached."""
    start = 0
    for _ in range(3):
        order, previous = breadth_first_order(graph, start, directed=True)
        start = int(order[-1])
    level = np.full(graph.shape[0], -1, dtype=np.int64)
    level[order[0]] = 0
    rest = order[1:]
    while len(rest):
        known = level[previous[rest]] >= 0
        # breadth first: the known ones come first
        count = int(np.argmin(known)) if not known.all() else len(rest)
        level[rest[:count]] = level[previous[rest[:count]]] + 1
        rest = rest[count:]
    return level


def _cut(graph: sparse.csr_array, level: Integers) -> tuple[Integers, Integers, Integers] | None:
    """Nodes below, in and above the best separator between two levels, if there is any."""
    last = int(level.max())
    if last < 1:
        return None
    columns = graph.indices
    rows = np.repeat(np.arange(graph.shape[0]), np.diff(graph.indptr))
    touches = np.zeros(len(level), dtype=bool)
    touches[rows[level[columns] == level[rows] + 1]] = True
    width = np.bincount(level[touches], minlength=last + 1)
    count = np.cumsum(np.bincount(level, minlength=last + 1))
    below = count[:-1] - width[:-1]
    above = len(level) - count[:-1]
    balance = np.maximum(below, above) / len(level)
    # the smallest separator among those that leave no part much larger than the other
    fair = balance <= max(_FAIR, float(balance.min()))
    best = int(np.argmin(np.where(fair, width[:-1], len(level))))
    if balance[best] > _LOPSIDED:
        return None
    inside = touches & (level == best)
    return (
        np.flatnonzero((level <= best) & ~inside),
        np.flatnonzero(inside),
        np.flatnonzero(level > best),
    )


def _symbolic(
    matrix: sparse.csc_array,
    graph: sparse.csr_array,
    tree: list[tuple[Integers, tuple[int, ...]]],
    place: Integers,
    start: Integers,
    position: Integers,
) -> list[_Front]:
    """The fronts with everything that the numerical phase needs to look up."""
    ends = np.cumsum([len(own) for own, _ in tree])
    boundaries: list[Integers] = []
    for number, (own, children) in enumerate(tree):
        near = [graph.indices[graph.indptr[g] : graph.indptr[g + 1]] for g in own]
        reached = [place[np.concatenate(near)]] if near else []
        reached += [boundaries[c] for c in children]
        found = np.unique(np.concatenate(reached)) if reached else np.zeros(0, dtype=np.int64)
        boundaries.append(found[found >= ends[number]])
    # entries of the lower triangle in the order of elimination, by the front of their column
    column = np.repeat(position, np.diff(matrix.indptr))
    row = position[matrix.indices]
    lower = np.flatnonzero(row >= column)
    first = start[np.concatenate(([0], ends[:-1]))]
    owner = np.searchsorted(first, column[lower], side="right") - 1
    # fronts without pivots share their start with the next one: take the last of equals
    lower = lower[np.argsort(owner, kind="stable")]
    limits = np.concatenate(([0], np.cumsum(np.bincount(owner, minlength=len(tree)))))
    rows_of = [_expanded(b, start) for b in boundaries]
    fronts = []
    for number, (_, children) in enumerate(tree):
        low = int(first[number])
        high = int(start[ends[number]])
        boundary = rows_of[number]
        entries = lower[limits[number] : limits[number + 1]]
        r, c = row[entries], column[entries] - low
        inner = r < high
        outer = ~inner
        where = np.searchsorted(boundary, r[outer])
        k = high - low
        all_rows = np.concatenate((np.arange(low, high), boundary))
        fronts.append(
            _Front(
                pivots=slice(low, high),
                boundary=boundary,
                source=(entries[inner], entries[outer]),
                target=(
                    (r[inner] - low) + c[inner] * k,
                    where + c[outer] * len(boundary),
                ),
                children=children,
                places=tuple(
                    _runs(np.searchsorted(all_rows, rows_of[child]), k) for child in children
                ),
            )
        )
    return fronts


def _runs(places: Integers, pivots: int) -> tuple[_Run, ...]:
    """Ascending places as runs of consecutive ones, none across the end of the pivots."""
    if not len(places):
        return ()
    breaks = np.flatnonzero((np.diff(places) != 1) | (places[1:] == pivots)) + 1
    lows = np.concatenate(([0], breaks))
    highs = np.concatenate((breaks, [len(places)]))
    return tuple((int(a), int(b), int(places[a])) for a, b in zip(lows, highs, strict=True))


def _expanded(groups: Integers, start: Integers) -> Integers:
    """Positions of the unknowns of groups given by their own positions."""
    counts = start[groups + 1] - start[groups]
    offset = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(np.repeat(start[groups], counts) + offset)
