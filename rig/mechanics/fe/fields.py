"""Stress and strain of a solved model: at quadrature points, and recovered at the nodes.

The Cauchy stress of the mixed form is that of the energy of distortion at the displacements plus
the pressure of its own field, sigma = (dW/dF) F^T / J + p I; the displacements' own J would bring
the oscillating pressure back that the mixed form is there to avoid.

At the nodes stress and logarithmic strain are fitted element by element: least squares over the
quadrature points, linear (triangles, tetrahedra) or multilinear (quadrilaterals, hexahedra) in the
local coordinates, averaged over the elements of one material by their volume. The fit is one
order below the displacements, which is the order to which their gradients are optimal (Barlow,
Int. J. Numer. Methods Eng. 10 (1976) 243; Hinton & Campbell, ibid. 8 (1974) 461): second-order
accurate where the solution is smooth. Other quantities follow from the recovered tensors.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import skfem
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Discretisation, Integers
from rig.mechanics.fe.model import Model
from rig.mechanics.fe.solid import Solid
from rig.mechanics.fe.state import PointState, State
from rig.mechanics.hyperelastic.spectral import spectrum
from rig.mechanics.hyperelastic.tensors import cofactor, determinant

Array = NDArray[np.float64]

_FIT = {
    skfem.ElementHex2: skfem.ElementHex1,
    skfem.ElementQuad2: skfem.ElementQuad1,
    skfem.ElementTetP2: skfem.ElementTetP1,
    skfem.ElementTriP2: skfem.ElementTriP1,
}
"""What stress is fitted with, by displacement element."""


@dataclass(frozen=True)
class Fields:
    """Stress and strain at some points; `...` is the shape of the points.

    Principal values come in descending order.
    """

    stress: Array
    """Cauchy stress in Pa, (3, 3, ...)."""
    log_strain: Array
    """Spatial logarithmic (Hencky) strain ln V, (3, 3, ...)."""

    @cached_property
    def pressure(self) -> Array:
        """Minus the mean Cauchy stress in Pa, (...): positive in compression."""
        return np.asarray(-np.trace(self.stress) / 3)

    @cached_property
    def von_mises(self) -> Array:
        """Equivalent Cauchy stress in Pa, (...); that of a pulled bar is its true stress."""
        return von_mises(self.stress)

    @cached_property
    def principal_stress(self) -> Array:
        """Principal Cauchy stresses in Pa, (3, ...)."""
        return _principal(self.stress)

    @cached_property
    def principal_stretch(self) -> Array:
        """Principal stretches, (3, ...); one less is the engineering principal strain."""
        return np.exp(_principal(self.log_strain))

    @cached_property
    def nominal_stress(self) -> Array:
        """Principal nominal (Biot) stresses J sigma_a / lambda_a in Pa, (3, ...).

        Force per area at rest along the principal directions, which stress and strain of an
        isotropic solid share: what a tensile test writes down.
        """
        volume_ratio = np.exp(np.trace(self.log_strain))
        # they share the order, too, where the Baker-Ericksen inequalities hold
        nominal = volume_ratio * self.principal_stress / self.principal_stretch
        return np.asarray(-np.sort(-nominal, axis=0))


@dataclass(frozen=True)
class PointFields(Fields):
    """Fields at the quadrature points of one solid; points have the shape (elements, q)."""

    weights: Array
    """Volume at rest of each point in m3, (elements, q)."""


@dataclass(frozen=True)
class NodalFields(Fields):
    """Fields of one solid at its nodes; points have the shape (n,)."""

    nodes: Integers
    """The solid's displacement nodes, ascending, (n,)."""


def von_mises(stress: Array) -> Array:
    """Equivalent stress, (...), of Cauchy stresses (3, 3, ...)."""
    deviator = stress.copy()
    for i in range(3):
        deviator[i, i] -= np.trace(stress) / 3
    return np.asarray(np.sqrt(1.5 * np.einsum("ij...,ij...->...", deviator, deviator)))


def cauchy_stress(solid: Solid, x: Array, points: PointState) -> Array:
    """Cauchy stress at the quadrature points of one solid in Pa, (3, 3, elements, q)."""
    f = solid.deformation_gradient(x)
    flat = f.reshape(3, 3, -1)
    j = determinant(flat, cofactor(flat))
    stress = np.einsum("ikn,jkn->ijn", solid.law(points).first_piola(flat), flat) / j
    pressure = solid.pressure(x, points).reshape(-1)
    for i in range(3):
        stress[i, i] += pressure
    return np.asarray(stress.reshape(f.shape))


def log_strain(solid: Solid, x: Array) -> Array:
    """Spatial logarithmic strain at the quadrature points of one solid, (3, 3, elements, q)."""
    f = solid.deformation_gradient(x)
    found = spectrum(f.reshape(3, 3, -1))
    scaled = np.log(found.stretches) * found.left
    return np.asarray(np.einsum("ian,jan->ijn", scaled, found.left).reshape(f.shape))


def point_fields(solid: Solid, x: Array, points: PointState) -> PointFields:
    """Fields at the quadrature points, where nothing is smoothed.

    `x` are the model's degrees of freedom, `points` the solid's own unknowns, both of a `State`.
    """
    weights = solid.discretisation.weights[solid.elements]
    return PointFields(cauchy_stress(solid, x, points), log_strain(solid, x), weights)


class Recovery:
    """What brings tensors at the quadrature points of one solid to its nodes."""

    def __init__(self, solid: Solid) -> None:
        d = solid.discretisation
        weights = d.weights[solid.elements]
        connectivity = d.connectivity[solid.elements]
        self.nodes, local = np.unique(connectivity, return_inverse=True)
        self._fit = _fit(d, weights)
        self._local = local.reshape(-1)
        self._share = np.repeat(weights.sum(axis=1), connectivity.shape[1])
        self._total = np.bincount(self._local, weights=self._share)

    def tensor(self, at_points: Array) -> Array:
        """A symmetric tensor (3, 3, elements, q) at the nodes, (3, 3, n)."""
        result = np.empty((3, 3, len(self.nodes)))
        for i in range(3):
            for k in range(i, 3):
                own = (self._fit @ at_points[i, k, :, :, None])[..., 0].reshape(-1)
                result[i, k] = np.bincount(self._local, weights=self._share * own) / self._total
                result[k, i] = result[i, k]
        return result


def recovered(solid: Solid, at: PointFields) -> NodalFields:
    """The fields at the solid's nodes, from those at its quadrature points."""
    recovery = Recovery(solid)
    return NodalFields(recovery.tensor(at.stress), recovery.tensor(at.log_strain), recovery.nodes)


def all_point_fields(model: Model, state: State) -> tuple[PointFields, ...]:
    """Fields at the quadrature points of every solid of a model."""
    return tuple(
        point_fields(solid, state.x, points)
        for solid, points in zip(model.solids, state.points, strict=True)
    )


def nodal_fields(model: Model, state: State) -> tuple[NodalFields, ...]:
    """Fields at the nodes of every solid of a model; a node between two solids is in both."""
    inside = all_point_fields(model, state)
    return tuple(recovered(solid, at) for solid, at in zip(model.solids, inside, strict=True))


def numbering(model: Model) -> tuple[Integers, tuple[Integers, ...]]:
    """Nodes of all solids one after another, as in `nodal_fields`, (n,), and per solid its
    elements' places in that list, (elements, a): nodes between two solids are there twice."""
    nodes, elements, offset = [], [], 0
    for solid in model.solids:
        own, local = np.unique(
            model.discretisation.connectivity[solid.elements], return_inverse=True
        )
        elements.append(offset + local.reshape(len(solid.elements), -1))
        nodes.append(own)
        offset += len(own)
    return np.concatenate(nodes), tuple(elements)


def displacements(discretisation: Discretisation, state: State) -> Array:
    """Displacements of all nodes in m, (n, dim)."""
    return state.x[: discretisation.displacement_size].reshape(-1, discretisation.dim)


def _fit(d: Discretisation, weights: Array) -> Array:
    """Values at an element's nodes from values at its quadrature points, (elements, a, q)."""
    element = _FIT[type(d.element)]()
    at_points = _shapes(element, np.asarray(d.basis.X))
    at_nodes = _shapes(element, np.asarray(d.element.doflocs, dtype=float).T)
    moments = weights[:, None, :] * at_points
    return np.asarray(at_nodes.T @ np.linalg.solve(moments @ at_points.T, moments))


def _shapes(element: skfem.Element, places: Array) -> Array:
    """Shape functions (m, points) of a scikit-fem element at local places (dim, points)."""
    count = len(element.doflocs)
    return np.stack(
        [np.broadcast_to(element.lbasis(places, i)[0], places.shape[1]) for i in range(count)]
    )


def _principal(tensor: Array) -> Array:
    """Eigenvalues (3, ...) in descending order of symmetric tensors (3, 3, ...)."""
    values: Array = np.linalg.eigvalsh(np.moveaxis(tensor, (0, 1), (-2, -1))).astype(np.float64)
    return np.moveaxis(values[..., ::-1], -1, 0)
