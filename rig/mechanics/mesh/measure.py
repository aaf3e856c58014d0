"""Measures of second-order meshes: Jacobians, volumes and surface integrals of the geometry.

Everything is evaluated at local points of the elements: the mapping is never inverted, so that
bad meshes can be measured, too.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def jacobians(mesh: Any, points: Array) -> Array:
    """Jacobian determinants (elements, points) of a mesh at local points (d, points).

    Works where elements are inverted, too: scikit-fem's own mapping refuses them.
    """
    every = np.arange(mesh.nelements)
    return np.asarray(np.linalg.det(_gradient(mesh, every, points)))


def scaled_jacobian(mesh: Any, order: int = 5) -> float:
    """Lowest Jacobian at quadrature points relative to its element's mean; 1 is a parallelepiped.

    Positive means that every element is valid under quadrature of this order.
    """
    determinant = jacobians(mesh, get_quadrature(mesh.elem.refdom, order)[0])
    return float((determinant.min(axis=1) / np.abs(determinant).mean(axis=1)).min())


def solid_volume(mesh: Any, order: int = 6) -> float:
    """Volume (3D, m3) or area (2D, m2) of the mesh, by quadrature of the given order."""
    points, weights = get_quadrature(mesh.elem.refdom, order)
    return float((jacobians(mesh, points) @ weights).sum())


def volume_of_revolution(mesh: Any, order: int = 6) -> float:
    """Volume in m3 of the solid that a meridian mesh in (r, z) sweeps about the axis r = 0."""
    points, weights = get_quadrature(mesh.elem.refdom, order)
    radius = _places(mesh, np.arange(mesh.nelements), points)[0]
    return float(2 * np.pi * ((jacobians(mesh, points) * radius) @ weights).sum())


def vector_area(mesh: Any, facets: Indices, order: int = 6) -> Array:
    """Integral of the outward normal over boundary facets, (d,) in m2 (3D) or m (2D)."""
    _, normal = _surface(mesh, facets, order)
    return np.asarray(normal.sum(axis=(1, 2)))


def enclosed_volume(mesh: Any, facets: Indices, order: int = 6) -> float:
    """Volume in m3 that boundary facets of a 3D mesh enclose, the solid being outside.

    Divergence theorem: minus a third of the integral of x . n. Facets may leave planes through
    the origin open, as half models do at their plane of symmetry.
    """
    place, normal = _surface(mesh, facets, order)
    return float(-np.sum(place * normal) / 3)


def enclosed_volume_of_revolution(mesh: Any, facets: Indices, order: int = 6) -> float:
    """Volume in m3 about the axis r = 0 that boundary facets of a meridian mesh (r, z) enclose.

    The solid lies outside; planes of constant z, where the meridian is open, close the volume.
    """
    place, normal = _surface(mesh, facets, order)
    return float(-np.pi * np.sum(place[0] ** 2 * normal[0]))


def _surface(mesh: Any, facets: Indices, order: int) -> tuple[Array, Array]:
    """Places and outward normals times weights at quadrature points, (d, facets, points) each."""
    refdom = mesh.elem.refdom
    dim = refdom.p.shape[0]
    flat, weights = get_quadrature(refdom.brefdom, order)
    owners = mesh.f2t[0, facets]
    local = np.argmax(mesh.t2f[:, owners] == facets, axis=0)
    place = np.empty((dim, facets.size, weights.size))
    normal = np.empty_like(place)
    for number, corners in enumerate(refdom.facets):
        chosen = np.flatnonzero(local == number)
        corner = refdom.p[:, list(corners)]
        # first corner and the edges from it: in scikit-fem corners go round a facet
        sides = (corner[:, [1, -1]] if dim == 3 else corner[:, [1]]) - corner[:, [0]]
        across = _crossed(sides.T[np.newaxis])[0]
        outwards = np.sign(across @ (corner.mean(axis=1) - refdom.p.mean(axis=1)))
        points = corner[:, [0]] + sides @ flat
        tangents = np.einsum("eqij,jk->eqki", _gradient(mesh, owners[chosen], points), sides)
        weighted = outwards * _crossed(tangents) * weights[:, np.newaxis]
        normal[:, chosen] = np.moveaxis(weighted, -1, 0)
        place[:, chosen] = _places(mesh, owners[chosen], points)
    return place, normal


def _crossed(tangents: Array) -> Array:
    """Normal (..., d) to d - 1 tangents (..., d - 1, d), as long as what they span is large."""
    if tangents.shape[-1] == 2:
        return np.stack([tangents[..., 0, 1], -tangents[..., 0, 0]], axis=-1)
    return np.cross(tangents[..., 0, :], tangents[..., 1, :])


def _places(mesh: Any, elements: Indices, points: Array) -> Array:
    """Images (d, elements, points) of local points in some elements."""
    shape = np.stack([value for value, _ in _basis(mesh, points)])
    nodes = mesh.doflocs[:, mesh.dofs.element_dofs[:, elements]]
    return np.asarray(np.einsum("dne,nq->deq", nodes, shape))


def _gradient(mesh: Any, elements: Indices, points: Array) -> Array:
    """Gradients of the mapping (elements, points, d, d) at local points in some elements."""
    gradient = np.stack([slope for _, slope in _basis(mesh, points)])
    nodes = mesh.doflocs[:, mesh.dofs.element_dofs[:, elements]]
    return np.asarray(np.einsum("dne,njq->eqdj", nodes, gradient, optimize=True))


def _basis(mesh: Any, points: Array) -> list[tuple[Array, Array]]:
    """Values (points,) and gradients (d, points) of every shape function."""
    element = mesh.elem()
    pairs = (element.lbasis(points, i) for i in range(mesh.dofs.element_dofs.shape[0]))
    return [
        (np.broadcast_to(value, points.shape[1]), np.broadcast_to(slope, points.shape))
        for value, slope in pairs
    ]
