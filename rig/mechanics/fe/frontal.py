"""A multifrontal Cholesky solver for the symmetric systems of soft shells.

SciPy's SuperLU treats every matrix as unsymmetric, works on small supernodes with one thread, and
repeats its analysis every time. Here the analysis is done once per pattern: SuperLU's own minimum
degree ordering (Liu, ACM Trans. Math. Softw. 11 (1985) 141) and fill of the graph of the nodes,
whose columns are gathered to fronts (Ashcraft & Grimes, ibid. 15 (1989) 291). The numerical part
is `native/multifrontal.cpp`, with the dense kernels of SciPy's BLAS.
A front that is not positive definite, as beyond a limit point, is pivoted within (Bunch-Kaufman).
"""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cython_blas, cython_lapack
from scipy.sparse.linalg import splu

from rig.mechanics.fe._native import ffi, lib
from rig.mechanics.fe.discretisation import Integers
from rig.mechanics.fe.errors import SingularError
from rig.mechanics.fe.pointers import flags, ints, longs, reals
from rig.mechanics.fe.threads import available_threads

Array = NDArray[np.float64]
Int32s = NDArray[np.int32]

_REFINE = 1e-9
"""Relative residual of a solution above which it is refined."""
_MAX_THREADS = 4
"""Threads beyond which the fronts near the root leave nothing to gain."""
_RATE, _TRAFFIC, _CALL = 15e9, 1e9, 4e-6
"""Multiplications and moved numbers per second, seconds per front: about those of a core of today.
They decide which fronts are worth merging, not what comes out."""


class Multifrontal:
    """Factorises symmetric matrices; analysis is repeated only when the pattern changes."""

    name = "multifrontal"

    def __init__(self, threads: int | None = None) -> None:
        """On `threads` threads, or as many as there are to be had, up to four."""
        self._threads = threads
        self._pattern: tuple[Int32s, Int32s] | None = None
        self._tree: _Tree | None = None
        self._memory = np.zeros(0)

    def factorise(self, matrix: sparse.csc_array) -> MultifrontalFactor:
        """The factors, in the memory of those before; raises SingularError."""
        known = self._pattern
        if (
            self._tree is None
            or known is None
            or not np.array_equal(known[0], matrix.indptr)
            or not np.array_equal(known[1], matrix.indices)
        ):
            self._tree = _analyse(matrix)
            self._pattern = (matrix.indptr.copy(), matrix.indices.copy())
            # touching new memory would cost a fifth of the time
            self._memory = np.empty(self._tree.panel[-1])
        threads = self._threads or min(available_threads(), _MAX_THREADS)
        return MultifrontalFactor(self._tree, matrix, self._memory, threads)


class MultifrontalFactor:
    """A factorised matrix, until the next is factorised."""

    def __init__(self, tree: _Tree, matrix: sparse.csc_array, memory: Array, threads: int) -> None:
        self._tree = tree
        self._matrix = matrix
        self._factor = memory
        self._pivoting = np.empty(len(tree.order), dtype=np.int32)
        self._indefinite = np.empty(len(tree.parent), dtype=np.uint8)
        data = np.ascontiguousarray(matrix.data, dtype=np.float64)
        status = lib.multifrontal_factorise(
            tree.handle,
            _routines(),
            threads,
            ints(tree.position),
            ints(tree.order),
            ints(matrix.indptr),
            ints(matrix.indices),
            reals(data),
            reals(self._factor),
            ints(self._pivoting),
            flags(self._indefinite),
        )
        _check(status, len(tree.order))

    @property
    def negative(self) -> bool:
        """Whether some front was not positive definite."""
        return bool(self._indefinite.any())

    def solve(self, right: Array) -> Array:
        """x with A x = `right`, (n,) or (n, k), refined once if round-off calls for it."""
        columns = right.reshape(len(right), -1)
        x = self._solve(columns)
        # one product tells of all columns, each at size one: they share their factors
        size = np.linalg.norm(columns, axis=0)
        weights = 1 / np.where(size > 0, size, 1.0)
        residual = columns @ weights - self._matrix @ (x @ weights)
        if np.linalg.norm(residual) > _REFINE * np.sqrt(len(size)):
            x = x + self._solve(columns - self._matrix @ x)
        return x.reshape(right.shape)

    def _solve(self, columns: Array) -> Array:
        y = np.asfortranarray(columns[self._tree.order], dtype=np.float64)
        status = lib.multifrontal_solve(
            self._tree.handle,
            _routines(),
            reals(self._factor),
            ints(self._pivoting),
            flags(self._indefinite),
            columns.shape[1],
            reals(y),
        )
        _check(status, len(y))
        return y[self._tree.position]


class _Tree:
    """The elimination tree of fronts, as the native part reads it."""

    def __init__(self, order: Int32s, pivots: Int32s, rows: list[Int32s], parent: Int32s) -> None:
        """`order` has the unknowns by position; front f eliminates `pivots[f]` to
        `pivots[f + 1]` and leaves `rows[f]` to its `parent[f]`, -1 at a root."""
        self.order = order
        self.position = np.empty_like(order)
        self.position[order] = np.arange(len(order), dtype=np.int32)
        self.parent = parent
        counts = np.array([len(r) for r in rows], dtype=np.int64)
        own = np.diff(pivots).astype(np.int64)
        self.panel = np.concatenate(([0], np.cumsum(own * (own + counts))))
        row_start = np.concatenate(([0], np.cumsum(counts)))
        row = np.concatenate(rows)
        # the arrays must live as long as the handle that points to them
        self._kept = (pivots, row_start, row)
        self.handle = ffi.new(
            "multifrontal_tree *",
            {
                "fronts": len(parent),
                "size": len(order),
                "pivot": ints(pivots),
                "row_start": longs(row_start),
                "row": ints(row),
                "parent": ints(parent),
                "panel": longs(self.panel),
            },
        )


@dataclass
class _Front:
    """Unknowns eliminated at once."""

    columns: list[int]
    """Their groups, by columns of SuperLU's factor; what the last one's column fills is what the
    front leaves to its parent."""
    pivots: int
    rows: int
    """Unknowns eliminated and left to the parent."""

    def seconds(self) -> float:
        """What it takes to assemble and eliminate."""
        k, m = self.pivots, self.rows
        return (k**3 / 3 + k * k * m + k * m * m) / _RATE + (k + m) ** 2 / _TRAFFIC + _CALL


def _analyse(matrix: sparse.csc_array) -> _Tree:
    group, first = _groups(matrix)
    size = np.bincount(group)
    order, below = _fill(_between(matrix, first))
    size = size[order]
    fronts, parent = _fronts(below, size)
    # columns of the factor by position: fronts one after the other
    columns = np.concatenate([np.array(f.columns) for f in fronts])
    place = np.empty(len(columns), dtype=np.int64)
    place[columns] = np.arange(len(columns))
    start = np.concatenate(([0], np.cumsum(size[columns])))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order[columns]] = np.arange(len(order))
    ends = np.cumsum([len(f.columns) for f in fronts])
    pivots = start[np.concatenate(([0], ends))].astype(np.int32)
    rows = []
    for front in fronts:
        last = front.columns[-1]
        left = below.indices[below.indptr[last] : below.indptr[last + 1]]
        rows.append(_expanded(np.sort(place[left]), start).astype(np.int32))
    return _Tree(np.argsort(rank[group], kind="stable").astype(np.int32), pivots, rows, parent)


def _groups(matrix: sparse.csc_array) -> tuple[Integers, Integers]:
    """Number of the group of each unknown, and the first unknown of each: neighbours in the
    numbering whose columns have the same rows, as those of a node do."""
    starts, counts = matrix.indptr[:-1], np.diff(matrix.indptr)
    following = np.repeat(counts, counts) + np.arange(matrix.nnz)
    alike = matrix.indices == matrix.indices[np.minimum(following, matrix.nnz - 1)]
    same = (counts[1:] == counts[:-1]) & np.logical_and.reduceat(alike, starts)[:-1]
    group = np.concatenate(([0], np.cumsum(~same)))
    first = np.flatnonzero(np.concatenate(([True], ~same)))
    return group, first


def _between(matrix: sparse.csc_array, chosen: Integers) -> sparse.csc_array:
    """The rows and columns `chosen` of a symmetric matrix."""
    # its columns are its rows
    rows = sparse.csr_array((matrix.data, matrix.indices, matrix.indptr), shape=matrix.shape)
    return sparse.csc_array(rows[chosen][:, chosen])


def _fill(graph: sparse.csc_array) -> tuple[Integers, sparse.csc_array]:
    """The order of elimination of a graph, and the rows below the diagonal that each of its
    columns fills: SuperLU's, of a matrix on that graph that needs no pivoting."""
    degree = np.diff(graph.indptr)
    weights = np.full(graph.nnz, -1.0)
    graph = sparse.csc_array((weights, graph.indices, graph.indptr), shape=graph.shape)
    dominant = graph + sparse.diags_array(degree + 2.0, format="csc")
    factor = splu(
        sparse.csc_matrix(dominant),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    below = sparse.csc_array(sparse.tril(factor.L, -1))
    below.sort_indices()
    return np.argsort(factor.perm_c), below


def _fronts(below: sparse.csc_array, size: Integers) -> tuple[list[_Front], Int32s]:
    """Fronts and their parents, children first: columns of the factor that share their rows,
    and children merged with parents wherever that saves time."""
    count = np.diff(below.indptr)
    heads = np.full(len(count), -1)
    filled = count > 0
    heads[filled] = below.indices[below.indptr[:-1][filled]]
    rows = np.bincount(
        np.repeat(np.arange(len(count)), count), size[below.indices], len(count)
    ).astype(np.int64)
    # a column continues the front of the one before if that leaves the same rows and itself
    joined = np.zeros(len(count), dtype=bool)
    joined[1:] = (heads[:-1] == np.arange(1, len(count))) & (count[:-1] == count[1:] + 1)
    starts = np.flatnonzero(~joined)
    owner = np.cumsum(~joined) - 1
    fronts: list[_Front | None] = []
    tops = np.append(starts[1:], len(count)) - 1
    pivots = np.add.reduceat(size, starts)
    for low, top, own in zip(starts, tops, pivots, strict=True):
        fronts.append(_Front(list(range(low, top + 1)), int(own), int(rows[top])))
    parent = [int(owner[heads[top]]) if heads[top] >= 0 else -1 for top in tops]
    children: list[list[int]] = [[] for _ in fronts]
    for number, above in enumerate(parent):
        if above >= 0:
            children[above].append(number)
    for number in range(len(fronts)):
        front = fronts[number]
        assert front is not None
        kept: list[int] = []
        # large children first: they are the ones whose rows the parent shares
        for child in sorted(children[number], key=lambda c: -fronts[c].rows):  # type: ignore[union-attr]
            small = fronts[child]
            assert small is not None
            both = _Front(small.columns + front.columns, small.pivots + front.pivots, front.rows)
            if both.seconds() < small.seconds() + front.seconds():
                front = both
                fronts[child] = None
                kept.extend(children[child])
            else:
                kept.append(child)
        fronts[number] = front
        children[number] = kept
    alive = [n for n, f in enumerate(fronts) if f is not None]
    number_of = {n: i for i, n in enumerate(alive)}
    final = np.full(len(alive), -1, dtype=np.int32)
    for n in alive:
        for child in children[n]:
            final[number_of[child]] = number_of[n]
    return [f for f in fronts if f is not None], final


def _expanded(groups: Integers, start: Integers) -> Integers:
    """Positions of the unknowns of groups given by their own positions."""
    counts = start[groups + 1] - start[groups]
    offset = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(np.repeat(start[groups], counts) + offset)


@functools.cache
def _routines() -> Any:
    """Addresses of SciPy's BLAS and LAPACK, as it publishes them for Cython."""
    found = {}
    for module, names in (
        (cython_blas, ("dtrsm", "dsyrk", "dgemm")),
        (cython_lapack, ("dpotrf", "dsytrf", "dsytrs")),
    ):
        for name in names:
            capsule = module.__pyx_capi__[name]
            found[name] = ffi.cast("void *", _address(capsule))
    return ffi.new("multifrontal_blas *", found)


def _address(capsule: object) -> int:
    api = ctypes.pythonapi
    api.PyCapsule_GetName.restype = ctypes.c_char_p
    api.PyCapsule_GetName.argtypes = [ctypes.py_object]
    api.PyCapsule_GetPointer.restype = ctypes.c_void_p
    api.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
    return int(api.PyCapsule_GetPointer(capsule, api.PyCapsule_GetName(capsule)))


def _check(status: int, unknowns: int) -> None:
    if status == lib.MULTIFRONTAL_SINGULAR:
        raise SingularError(
            "the tangent is singular: some part is not held, or the body is at a limit of "
            "stability. Check the supports."
        )
    if status == lib.MULTIFRONTAL_NO_MEMORY:
        raise MemoryError(f"the factors of {unknowns} unknowns do not fit into memory")
