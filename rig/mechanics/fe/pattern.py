"""One fixed sparsity pattern for the life of a model, and where every element entry lands in it.

A pattern that is computed anew per iteration changes when an entry happens to be zero, and a
reused symbolic factorisation is then silently wrong. Here it never changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from rig.mechanics.fe._native import lib
from rig.mechanics.fe.discretisation import Integers
from rig.mechanics.fe.pointers import ints, reals

Array = NDArray[np.float64]


class Pattern:
    """Compressed columns of a square matrix to which blocks of elements contribute."""

    def __init__(self, size: int, blocks: Sequence[Integers], dim: int = 1) -> None:
        """`blocks` are degrees of freedom (elements, dofs) of each contributor.

        Where every block numbers its dofs node by node, `dim` to a node, telling so saves time.
        """
        by_node = dim > 1 and size % dim == 0 and all(_is_by_node(b, dim) for b in blocks)
        width = dim if by_node else 1
        graph = [b[:, ::width] // width for b in blocks]
        coarse = _structure(size // width, graph)
        counts = np.diff(coarse.indptr)
        self.size = size
        self.indptr = np.concatenate(([0], np.cumsum(np.repeat(counts * width, width)))).astype(
            np.int32
        )
        self.indices = np.empty(self.indptr[-1], dtype=np.int32)
        starts = width * width * coarse.indptr[:-1]
        column = np.repeat(np.arange(size // width), counts)
        rank = np.arange(coarse.nnz) - coarse.indptr[column]
        for k in range(width):
            for i in range(width):
                where = starts[column] + k * width * counts[column] + width * rank + i
                self.indices[where] = width * coarse.indices + i
        self._width = width
        coarse.data = np.arange(coarse.nnz, dtype=np.int64)
        first = (starts[column] + width * rank).astype(np.int32)
        stride = (width * counts).astype(np.int32)
        self._places = [(first[_address(nodes, coarse)], stride[nodes]) for nodes in graph]

    def assemble(self, blocks: Sequence[Array]) -> Array:
        """Sum of the element matrices (elements, dofs, dofs) of each block as column data."""
        data = np.zeros(len(self.indices))
        for (first, stride), values in zip(self._places, blocks, strict=True):
            elements, nodes = stride.shape
            if values.shape != (elements, nodes * self._width, nodes * self._width):
                raise ValueError(
                    f"matrices of shape {values.shape} for {elements} elements of {nodes} nodes "
                    f"with {self._width} unknowns each"
                )
            matrices = np.ascontiguousarray(values)
            lib.elements_scatter(
                elements,
                nodes,
                self._width,
                ints(first),
                ints(stride),
                reals(matrices),
                reals(data),
            )
        return data

    def matrix(self, data: Array) -> sparse.csc_array:
        """The sparse matrix with these data."""
        shape = (self.size, self.size)
        return sparse.csc_array((data, self.indices, self.indptr), shape=shape)

    def submatrix(self, keep: Integers) -> Submatrix:
        """The rows and columns `keep`, which must ascend."""
        return Submatrix(self, keep)


class Submatrix:
    """Some rows and columns of a pattern: their own compressed columns, and how to fill them."""

    def __init__(self, pattern: Pattern, keep: Integers) -> None:
        number = np.full(pattern.size, -1, dtype=np.int64)
        number[keep] = np.arange(len(keep))
        columns = np.repeat(np.arange(pattern.size), np.diff(pattern.indptr))
        inside = (number[pattern.indices] >= 0) & (number[columns] >= 0)
        self._source = np.flatnonzero(inside)
        counts = np.bincount(number[columns[self._source]], minlength=len(keep))
        self.size = len(keep)
        self.indices = number[pattern.indices[self._source]].astype(np.int32)
        self.indptr = np.concatenate(([0], np.cumsum(counts))).astype(np.int32)

    def take(self, data: Array) -> sparse.csc_array:
        """The submatrix of the matrix with these data."""
        shape = (self.size, self.size)
        return sparse.csc_array((data[self._source], self.indices, self.indptr), shape=shape)


def _address(nodes: Integers, coarse: sparse.csc_array) -> Integers:
    """Which entry of the graph each pair of an element's nodes is, (elements, a, a)."""
    a = nodes.shape[1]
    rows = np.repeat(nodes[:, :, None], a, axis=2)
    columns = np.repeat(nodes[:, None, :], a, axis=1)
    # entries are their own addresses: ask the matrix where each is
    found = coarse[rows.reshape(-1), columns.reshape(-1)]
    return np.asarray(found).reshape(rows.shape)


def _is_by_node(dofs: Integers, dim: int) -> bool:
    if dofs.shape[1] % dim:
        return False
    grouped = dofs.reshape(len(dofs), -1, dim)
    first = grouped[:, :, :1]
    return bool(np.all(first % dim == 0) and np.all(grouped == first + np.arange(dim)))


def _structure(size: int, blocks: Sequence[Integers]) -> sparse.csc_array:
    rows = np.concatenate([b.reshape(-1) for b in blocks])
    starts = np.cumsum([0, *(b.shape[1] for b in blocks for _ in range(len(b)))])
    member = sparse.csr_array(
        (np.ones(len(rows), dtype=np.int32), rows, starts), shape=(len(starts) - 1, size)
    )
    graph = sparse.csc_array(member.T @ member)
    graph.sort_indices()
    return graph
