"""Measures of second-order meshes: Jacobians, volumes and surface integrals of the geometry."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def jacobians(mesh: Any, points: Array) -> Array:
    """Jacobian determinants (elements, points) of a mesh at local points (d, points).

    Works where elements are inverted, too: scikit-fem's own mapping refuses them.
    """
    element = mesh.elem()
    gradient = np.stack(
        [
            np.broadcast_to(element.lbasis(points, i)[1], points.shape)
            for i in range(mesh.dofs.element_dofs.shape[0])
        ]
    )
    nodes = mesh.doflocs[:, mesh.dofs.element_dofs]
    jacobian = np.einsum("dne,njq->eqdj", nodes, gradient, optimize=True)
    return np.asarray(np.linalg.det(jacobian))


def scaled_jacobian(mesh: Any, points: Array) -> float:
    """Lowest Jacobian over all elements and local points, relative to its element's mean."""
    determinant = jacobians(mesh, points)
    return float((determinant.min(axis=1) / np.abs(determinant).mean(axis=1)).min())
