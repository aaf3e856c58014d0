"""What a mixed element knows about its mesh: shape functions, their gradients, weights, numbering.

scikit-fem evaluates the basis once; everything is kept here in the order that the batched kernels
of `solid` want, elements first. Displacements are quadratic. Pressures are linear, either
discontinuous (quadrilaterals and hexahedra, Q2/P1: Sussman & Bathe, Comput. Struct. 26 (1987)
357, Section 3; linear in the *global* coordinates, because the mapped version loses an order on
distorted elements: Arnold, Boffi & Falk, Math. Comput. 71 (2002) 909) or continuous (triangles
and tetrahedra, P2/P1: Taylor & Hood, Comput. Fluids 1 (1973) 73).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

from rig.mechanics.fe.errors import MeshError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Kinematics(Enum):
    """How displacements of the mesh deform the solid."""

    SOLID = "solid"
    PLANE_STRAIN = "plane strain"
    """Unit thickness; no strain along the third direction."""
    AXISYMMETRIC = "axisymmetric"
    """Coordinates (r, z); the full turn, so that forces and volumes are those of the body."""

    @property
    def components(self) -> tuple[tuple[int, ...], ...]:
        """Per displacement component, the entries of F (row-major, 0 to 8) that it moves."""
        return _COMPONENTS[self]


_COMPONENTS = {
    Kinematics.SOLID: ((0, 1, 2), (3, 4, 5), (6, 7, 8)),
    Kinematics.PLANE_STRAIN: ((0, 1), (3, 4)),
    Kinematics.AXISYMMETRIC: ((0, 1, 8), (3, 4)),  # u_r / R stretches the hoop, F_33
}

# pressure space by displacement element: is it continuous?
_CONTINUOUS = {
    skfem.ElementHex2: False,
    skfem.ElementQuad2: False,
    skfem.ElementTetP2: True,
    skfem.ElementTriP2: True,
}
_QUADRATIC = {
    skfem.MeshHex1: skfem.ElementHex2,
    skfem.MeshQuad1: skfem.ElementQuad2,
    skfem.MeshTet1: skfem.ElementTetP2,
    skfem.MeshTri1: skfem.ElementTriP2,
}
_LINEAR_PRESSURE = {
    skfem.ElementTetP2: skfem.ElementTetP1,
    skfem.ElementTriP2: skfem.ElementTriP1,
}
# exact for products of gradients on affine elements; three Gauss points a direction on the others
_QUADRATURE_ORDER = {
    skfem.ElementHex2: 5,
    skfem.ElementQuad2: 5,
    skfem.ElementTetP2: 4,
    skfem.ElementTriP2: 4,
}


@dataclass(frozen=True)
class Discretisation:
    """A mesh with its mixed element; build it by `discretise`.

    Displacement degrees of freedom are numbered node by node: `dim * node + component`.
    Continuous pressures follow after all of them.
    """

    mesh: Any
    kinematics: Kinematics
    element: Any
    """The scalar displacement element of scikit-fem."""
    nodes: Array
    """Coordinates of every displacement node in m, (n, dim)."""
    connectivity: Integers
    """Nodes of each element, (elements, a)."""
    weights: Array
    """Reference volume of each quadrature point in m3, (elements, q)."""
    values: Array
    """Shape functions, (elements, q, a)."""
    gradients: tuple[Array, ...]
    """Per displacement component d F_entry / d u, (elements, q, entries, a), in 1/m; the entries
    are those of `kinematics.components`."""
    pressure_values: Array
    """Pressure shape functions, (elements, q, m); m = 0 without pressures."""
    pressure_connectivity: Integers | None
    """Pressure nodes of each element, (elements, m), or None where they are the element's own."""
    pressure_nodes: int
    """Number of continuous pressure nodes; 0 where pressures are discontinuous."""
    basis: Any = field(repr=False)
    """The scalar scikit-fem basis behind the arrays."""

    @property
    def dim(self) -> int:
        """Displacement components per node."""
        return int(self.nodes.shape[1])

    @property
    def mixed(self) -> bool:
        """Whether there are pressures beside the displacements."""
        return bool(self.pressure_values.shape[2])

    @property
    def facet_nodes(self) -> int:
        """Displacement nodes of one facet."""
        return {27: 9, 10: 6, 9: 3, 6: 3}[self.connectivity.shape[1]]

    @property
    def displacement_size(self) -> int:
        """Number of displacement degrees of freedom."""
        return int(self.nodes.size)

    @property
    def size(self) -> int:
        """Number of degrees of freedom, continuous pressures included."""
        return self.displacement_size + self.pressure_nodes

    @property
    def dofs(self) -> Integers:
        """Displacement degrees of freedom of each element, (elements, a * dim), node by node."""
        return node_dofs(self.connectivity, self.dim)

    def nodes_on(self, boundary: str) -> Integers:
        """Displacement nodes on a named boundary, ascending; raises MeshError if there is none."""
        facets = self.facets_on(boundary)
        found = self.basis.get_dofs(facets=facets).flatten()
        return np.unique(found).astype(np.int64)

    def facets_on(self, boundary: str) -> Integers:
        """Facets of a named boundary; raises MeshError for a name the mesh does not have."""
        known = self.mesh.boundaries or {}
        if boundary not in known:
            raise MeshError(
                f"the mesh has no boundary named '{boundary}'; it has "
                f"{', '.join(sorted(known)) or 'none'}. Name its facets with `with_boundaries`."
            )
        return np.asarray(known[boundary], dtype=np.int64)

    def nodes_at(self, **coordinates: float) -> Integers:
        """Displacement nodes where x, y, z (or r, z) have the values given, within round-off."""
        names = ("r", "z") if self.kinematics is Kinematics.AXISYMMETRIC else ("x", "y", "z")
        slack = 1e-9 * float(np.ptp(self.nodes, axis=0).max())
        found = np.ones(len(self.nodes), dtype=bool)
        for name, value in coordinates.items():
            found &= np.abs(self.nodes[:, names.index(name)] - value) < slack
        return np.flatnonzero(found)


def discretise(
    mesh: Any,
    kinematics: Kinematics = Kinematics.SOLID,
    *,
    mixed: bool = True,
    order: int | None = None,
) -> Discretisation:
    """The quadratic element on a scikit-fem mesh of hexahedra, tetrahedra, quads, triangles.

    `mixed` false leaves the pressures out: the displacement element of other programs, to compare
    with them; it locks near incompressibility. `order` is that of the quadrature, by default one
    that loses nothing.

    Raises MeshError for other cells, for a mesh of the wrong dimension, and for elements that are
    inverted or flat, telling which and where.
    """
    element = next((e() for m, e in _QUADRATIC.items() if isinstance(mesh, m)), None)
    if element is None:
        raise MeshError(
            f"{type(mesh).__name__} has no mixed element here; use hexahedra, tetrahedra, "
            "quadrilaterals or triangles."
        )
    dim = 3 if kinematics is Kinematics.SOLID else 2
    if mesh.dim() != dim:
        raise MeshError(
            f"{kinematics.value} needs a mesh in {dim} dimensions; "
            f"{type(mesh).__name__} has {mesh.dim()}."
        )
    basis = skfem.Basis(mesh, element, intorder=order or _QUADRATURE_ORDER[type(element)])
    _check_orientation(mesh, basis)
    nodes = np.ascontiguousarray(basis.doflocs.T)
    connectivity = np.ascontiguousarray(basis.element_dofs.T).astype(np.int64)
    values = np.stack(
        [np.broadcast_to(np.asarray(b[0]), basis.dx.shape) for b in basis.basis], axis=-1
    )
    gradient = np.stack([np.moveaxis(b[0].grad, 0, -1) for b in basis.basis], axis=-1)
    weights = np.array(basis.dx)
    gradients: tuple[Array, ...] = (gradient,) * dim
    if kinematics is Kinematics.AXISYMMETRIC:
        radius = np.asarray(basis.global_coordinates())[0]
        weights *= 2 * np.pi * radius
        hoop = values / radius[..., None]
        gradients = (np.concatenate((gradient, hoop[:, :, None]), axis=2), gradient)
    pressure_values, pressure_connectivity, pressure_nodes = (
        _pressure_space(basis, weights) if mixed else (np.zeros((*weights.shape, 0)), None, 0)
    )
    return Discretisation(
        mesh=mesh,
        kinematics=kinematics,
        element=element,
        nodes=nodes,
        connectivity=connectivity,
        weights=weights,
        values=values,
        gradients=gradients,
        pressure_values=pressure_values,
        pressure_connectivity=pressure_connectivity,
        pressure_nodes=pressure_nodes,
        basis=basis,
    )


def node_dofs(nodes: Integers, dim: int) -> Integers:
    """Degrees of freedom of nodes (..., a) as (..., a * dim), node by node."""
    return (dim * nodes[..., None] + np.arange(dim)).reshape(*nodes.shape[:-1], -1)


def _pressure_space(basis: Any, weights: Array) -> tuple[Array, Integers | None, int]:
    element = basis.elem
    if _CONTINUOUS[type(element)]:
        linear = basis.with_element(_LINEAR_PRESSURE[type(element)]())
        values = np.stack(
            [np.broadcast_to(np.asarray(b[0]), weights.shape) for b in linear.basis], axis=-1
        )
        return values, np.ascontiguousarray(linear.element_dofs.T).astype(np.int64), int(linear.N)
    points = np.moveaxis(np.asarray(basis.global_coordinates()), 0, -1)  # (e, q, dim)
    volume = weights.sum(axis=1)
    centre = np.einsum("eq,eqi->ei", weights, points) / volume[:, None]
    size = volume ** (1 / 3)
    arms = (points - centre[:, None]) / size[:, None, None]
    values = np.concatenate((np.ones((*weights.shape, 1)), arms), axis=-1)
    # orthonormal over the element, so that the pressure matrix is well conditioned in slivers too
    gram = np.einsum("eq,eqm,eqn->emn", weights / volume[:, None], values, values)
    lower = np.linalg.cholesky(gram)
    values = np.linalg.solve(lower, values.swapaxes(1, 2)).swapaxes(1, 2)
    return np.ascontiguousarray(values), None, 0


def _check_orientation(mesh: Any, basis: Any) -> None:
    determinant = mesh.mapping().detDF(basis.X)
    # left-handed numbering everywhere in an element is harmless; a sign that changes is not
    sign = np.sign(determinant)
    bad = np.flatnonzero((sign != sign[:, :1]).any(axis=1) | (sign == 0).any(axis=1))
    if bad.size:
        where = mesh.p[:, mesh.t[:, bad[0]]].mean(axis=1)
        at = ", ".join(f"{1e3 * c:.4g}" for c in where)
        raise MeshError(
            f"{bad.size} of {mesh.nelements} elements are inverted or flat, the first being "
            f"element {bad[0]} around ({at}) mm. Refine or smooth the mesh there."
        )
