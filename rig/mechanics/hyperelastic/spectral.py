"""Principal stretches and directions of many deformation gradients at once.

One-sided Jacobi rotations (Hestenes, 1958): the columns of F are turned until they are orthogonal.
That gives stretches with their full relative accuracy, equal or not, and costs a fraction of a
call of LAPACK per point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rig.mechanics.hyperelastic.protocol import Array

_PAIRS = ((0, 1), (0, 2), (1, 2))
_MOST_SWEEPS = 12
_ORTHOGONAL = 2e-15
"""Cosine between two columns below which they count as orthogonal: a few units of round-off."""


class Spectrum(NamedTuple):
    """F = sum over a of stretches[a] left[:, a] (x) right[:, a], for n points.

    `stretches` is (3, n), in no particular order; `left` and `right` are (3, 3, n).
    """

    stretches: Array
    left: Array
    right: Array


def spectrum(f: Array) -> Spectrum:
    """Singular values and vectors of F (3, 3, n); stretches are positive whatever det F is."""
    both = np.empty((6, 3, f.shape[-1]))
    both[:3] = f
    both[3:] = np.eye(3)[..., None]
    for _ in range(_MOST_SWEEPS):
        turned = [_rotate(both, p, q) for p, q in _PAIRS]
        if not any(turned):
            break
    stretches = np.sqrt(np.einsum("ian,ian->an", both[:3], both[:3]))
    return Spectrum(stretches, both[:3] / stretches, both[3:])


def _rotate(both: Array, p: int, q: int) -> bool:
    """Turn columns p and q until orthogonal at every point; whether any point needed it."""
    x, y = both[:, p], both[:, q]
    xx, yy, xy = _dot(x, x), _dot(y, y), _dot(x, y)
    if not (xy * xy > _ORTHOGONAL**2 * (xx * yy)).any():
        return False
    difference = yy - xx
    xy *= 2
    root = np.sqrt(difference * difference + xy * xy) + np.finfo(float).tiny
    tangent = xy / (difference + np.copysign(root, difference))
    cosine = 1 / np.sqrt(1 + tangent * tangent)
    sine = tangent * cosine
    turned = cosine * x - sine * y
    np.add(sine * x, cosine * y, out=y)
    x[:] = turned
    return True


def _dot(x: Array, y: Array) -> Array:
    """Of the first three components: the turned columns of F, above those of the rotation."""
    result: Array = np.einsum("in,in->n", x[:3], y[:3])
    return result
