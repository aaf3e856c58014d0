"""Dead loads: forces that keep direction and size, as vectors over all degrees of freedom in N."""

from __future__ import annotations

import numpy as np
import skfem
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Discretisation, Integers, Kinematics
from rig.mechanics.fe.solid import Solid

Array = NDArray[np.float64]


def gravity(solid: Solid, density: float, acceleration: Array) -> Array:
    """The weight of a solid: density in kg/m3, acceleration in m/s2, (dim,)."""
    d = solid.discretisation
    weights = d.weights[solid.elements]
    per_node = density * np.einsum("eq,eqa->ea", weights, d.values[solid.elements])
    forces = per_node[..., None] * np.asarray(acceleration, dtype=float)
    nodes = d.connectivity[solid.elements]
    return _scattered(d, nodes, forces)


def traction(discretisation: Discretisation, facets: Integers, stress: Array) -> Array:
    """A uniform dead traction in Pa of reference area, (dim,), on some facets."""
    d = discretisation
    basis = skfem.FacetBasis(d.mesh, d.element, facets=facets, intorder=5)
    weights = np.array(basis.dx)
    if d.kinematics is Kinematics.AXISYMMETRIC:
        weights *= 2 * np.pi * np.asarray(basis.global_coordinates())[0]
    values = np.stack(
        [np.broadcast_to(np.asarray(b[0]), weights.shape) for b in basis.basis], axis=-1
    )
    per_node = np.einsum("fq,fqa->fa", weights, values)
    forces = per_node[..., None] * np.asarray(stress, dtype=float)
    return _scattered(d, basis.element_dofs.T.astype(np.int64), forces)


def _scattered(d: Discretisation, nodes: Integers, forces: Array) -> Array:
    result = np.zeros(d.size)
    for i in range(d.dim):
        dofs = (d.dim * nodes + i).reshape(-1)
        result += np.bincount(dofs, weights=forces[..., i].reshape(-1), minlength=d.size)
    return result
