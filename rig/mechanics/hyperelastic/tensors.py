"""Small tensors at many points: determinants, cofactors and sums of dyads without Python per point.

Shapes are (3, 3, n) throughout: each component is one contiguous run over the n points.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rig.mechanics.hyperelastic.protocol import Array

BLOCK = 1024
"""Points worked on at once: their tangents, 81 numbers each, stay in the processor's cache."""

_SIGN = {(0, 1, 2): 1, (1, 2, 0): 1, (2, 0, 1): 1, (2, 1, 0): -1, (1, 0, 2): -1, (0, 2, 1): -1}


def in_blocks(
    f: Array, rank: int, compute: Callable[..., None], beside: tuple[Array, ...] = ()
) -> Array:
    """Result of shape (3,) * rank + the trailing shape of `f`, block by block.

    `compute(f, out, *beside)` fills `out` (3, ..., n) from `f` (3, 3, n) and from what is known at
    the same points beside it, (..., points). What is not defined, where det F <= 0, becomes not a
    number or infinite, silently: a line search asks there on purpose.
    """
    points = f.shape[2:]
    flat = f.reshape(3, 3, -1)
    result = np.empty((*(3,) * rank, flat.shape[-1]), dtype=f.dtype)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for start in range(0, flat.shape[-1], BLOCK):
            block = slice(start, start + BLOCK)
            compute(flat[..., block], result[..., block], *(own[..., block] for own in beside))
    reshaped: Array = result.reshape((3,) * rank + points)
    return reshaped


def cofactor(f: Array) -> Array:
    """cof F = det(F) F^-T = dJ/dF, (3, 3, n); also where F is singular."""
    around = np.empty((5, 5, f.shape[-1]), dtype=f.dtype)  # F repeated: rolled rows are slices
    around[:3, :3] = f
    around[3:, :3] = f[:2]
    around[:, 3:] = around[:, :2]
    result: Array = around[1:4, 1:4] * around[2:, 2:]
    result -= around[1:4, 2:] * around[2:, 1:4]
    return result


def determinant(f: Array, cof: Array) -> Array:
    """det F, (n), from F and its cofactor."""
    result: Array = f[0, 0] * cof[0, 0] + f[0, 1] * cof[0, 1] + f[0, 2] * cof[0, 2]
    return result


def square(f: Array) -> Array:
    """F : F, (n)."""
    result: Array = np.einsum("ijn,ijn->n", f, f)
    return result


def right_cauchy_green(f: Array) -> Array:
    """C = F^T F, (3, 3, n)."""
    result: Array = np.einsum("kin,kjn->ijn", f, f)
    return result


def left_cauchy_green(f: Array) -> Array:
    """B = F F^T, (3, 3, n)."""
    result: Array = np.einsum("ikn,jkn->ijn", f, f)
    return result


def product(a: Array, b: Array) -> Array:
    """The matrix product a b, (3, 3, n)."""
    result: Array = np.einsum("ikn,kjn->ijn", a, b)
    return result


def add_identity(tangent: Array, factor: Array) -> None:
    """Add `factor` d_ik d_jl to A_ijkl in place."""
    for i in range(3):
        for j in range(3):
            tangent[i, j, i, j] += factor


def add_cofactor_slope(tangent: Array, factor: Array, f: Array) -> None:
    """Add `factor` d2J/dF2 = `factor` e_ikm e_jln F_mn to A_ijkl in place."""
    scaled = factor * f
    for (i, k, m), rows in _SIGN.items():
        for (j, n, p), columns in _SIGN.items():
            if rows == columns:
                tangent[i, j, k, n] += scaled[m, p]
            else:
                tangent[i, j, k, n] -= scaled[m, p]


def sum_of_dyads(left: Array, right: Array, out: Array) -> None:
    """A_ijkl = sum over a of left_aij right_akl into `out`; left and right are (a, 3, 3, n)."""
    np.einsum("aijn,akln->ijkln", left, right, out=out)
