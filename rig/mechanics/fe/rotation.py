"""Finite rotations by rotation vectors (Rodrigues)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def skew(vector: Array) -> Array:
    """The matrix of v x ., (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_matrix(vector: Array) -> Array:
    """The rotation by |v| rad about v, (3, 3)."""
    angle = float(np.linalg.norm(vector))
    w = skew(vector)
    # sin(a)/a and (1 - cos a)/a^2 without cancellation or division by zero
    result: Array = (
        np.eye(3) + np.sinc(angle / np.pi) * w + np.sinc(angle / (2 * np.pi)) ** 2 / 2 * (w @ w)
    )
    return result


def rotation_vector(matrix: Array) -> Array:
    """The rotation vector of a rotation matrix in rad, of length up to pi."""
    axis = np.array(
        [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
    )
    sine = float(np.linalg.norm(axis)) / 2
    cosine = (float(np.trace(matrix)) - 1) / 2
    angle = float(np.arctan2(sine, cosine))
    if sine > 1e-6:
        return np.asarray(angle / (2 * sine) * axis)
    if cosine > 0:
        return np.asarray(axis / 2)
    # a half turn: the axis is the eigenvector of the eigenvalue 1
    outer = (matrix + np.eye(3)) / 2
    column = outer[:, int(np.argmax(np.diag(outer)))]
    return np.asarray(angle * column / np.linalg.norm(column))
