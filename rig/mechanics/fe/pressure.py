"""Pressure on the walls of a cavity: follower or dead, its load stiffness, the volume enclosed.

All follows from one surface integral of the current area vector n da = (F t1 x F t2) dA with
reference tangents t1, t2: the force is p n da, the volume V = -1/dim int (x - o) . n da (the
normal leaves the solid, so it enters the cavity). For a closed cavity, or one whose rim is
clamped or slides on a plane of symmetry through o, the force is p dV/du and the load stiffness
p d2V/du2 symmetric (Bufler, Z. Angew. Math. Mech. 64 (1984) 287; Schweizerhof & Ramm, Comput.
Struct. 18 (1984) 1099).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Discretisation, Integers, Kinematics, node_dofs
from rig.mechanics.fe.errors import MeshError

Array = NDArray[np.float64]

_ORDER = 5
_SIDES = {2: skfem.refdom.RefLine, 3: skfem.refdom.RefTri, 4: skfem.refdom.RefQuad}
"""Reference cell of a side by its corners."""
_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _j, _k] = 1.0
    _LEVI_CIVITA[_i, _k, _j] = -1.0


@dataclass(frozen=True)
class SurfaceEvaluation:
    """The wall at some displacements, per unit of pressure."""

    residual: Array
    """-dW/du in m2 for a pressure of 1 Pa: to be multiplied by p, (facets, dofs)."""
    tangent: Array
    """Its derivative in m, (facets, dofs, dofs)."""
    volume: float
    """Volume enclosed in m3."""
    volume_slope: Array
    """dV/du in m2, (facets, dofs)."""


class PressureSurface:
    """Facets under the pressure of the cavity."""

    def __init__(
        self,
        discretisation: Discretisation,
        facets: Integers,
        *,
        follower: bool = True,
        symmetric: bool = True,
        origin: Array | None = None,
    ) -> None:
        """Facets of the cavity's wall, the solid on one side.

        `follower` false keeps the force at its direction and size at rest. `symmetric` takes the
        symmetric part of the load stiffness, which is all of it where the cavity is closed or its
        rim clamped or sliding on a plane of symmetry. `origin` in m, (dim,), is where the volume
        is measured from; open rims must lie in planes through it. Raises MeshError for facets
        between elements.
        """
        d = discretisation
        if len(facets) == 0:
            raise MeshError("a pressure needs at least one facet to act on; none was given.")
        if np.any(d.mesh.f2t[1, facets] >= 0):
            raise MeshError(
                "a pressure acts on the outside of the solid, but some of its facets lie between "
                "two elements. Check how the boundary was selected."
            )
        self.follower = follower
        self.symmetric = symmetric
        self._axisymmetric = d.kinematics is Kinematics.AXISYMMETRIC
        self._dim = d.dim
        self.origin = np.zeros(d.dim) if origin is None else np.asarray(origin, dtype=float)
        owners = d.mesh.f2t[0, facets]
        local = np.argmax(d.mesh.t2f[:, owners] == facets, axis=0)
        cell = d.mesh.elem.refdom
        sides = [_Side.of(d.element, cell, number) for number in range(len(cell.facets))]
        nodes = np.stack([side.nodes for side in sides])[local]
        self.nodes = np.take_along_axis(d.connectivity[owners], nodes, axis=1)
        self.dofs = node_dofs(self.nodes, d.dim)
        self._x = d.nodes[self.nodes]  # (f, a, dim)
        self._value = np.stack([side.value for side in sides])[local]
        self._slopes = tuple(
            np.stack([side.slopes[i] for side in sides])[local] for i in range(d.dim - 1)
        )
        # sides turn the wrong way round in elements that are numbered left-handed
        centre = cell.p.mean(axis=1)[:, None]
        turn = np.sign(d.mesh.mapping().detDF(centre, tind=owners))
        self._w = turn * np.stack([side.weights for side in sides])[local]
        self._rest = self._evaluate(np.zeros_like(self._x))

    @property
    def rest_volume(self) -> float:
        """Volume enclosed at rest in m3."""
        return self._rest.volume

    @property
    def rest_area(self) -> Array:
        """The integral of n dA at rest in m2, (dim,): zero for a closed surface."""
        total: Array = self._rest.residual.reshape(-1, self._dim).sum(axis=0)
        return total

    def evaluate(self, x: Array) -> SurfaceEvaluation:
        """Force, load stiffness and volume for the displacements in x, per unit of pressure."""
        now = self._evaluate(x[self.dofs].reshape(self._x.shape))
        if self.follower:
            return now
        rest = self._rest
        return SurfaceEvaluation(
            rest.residual, np.zeros_like(rest.tangent), now.volume, now.volume_slope
        )

    def _evaluate(self, u: Array) -> SurfaceEvaluation:
        if self._dim == 3:
            return self._in_space(u)
        return self._in_plane(u)

    def _in_space(self, u: Array) -> SurfaceEvaluation:
        here = self._x + u
        first, second = self._slopes
        a = first @ here
        b = second @ here
        n = np.cross(a, b)
        weighted = self._w[..., None] * self._value
        residual = weighted.swapaxes(1, 2) @ n  # (f, a, 3)
        # d(a x b)_i / du_bj = e_ijk (s1_b b_k - s2_b a_k)
        area_slope = np.einsum("ijk,fqk,fqb->fqibj", _LEVI_CIVITA, b, first, optimize=True)
        area_slope -= np.einsum("ijk,fqk,fqb->fqibj", _LEVI_CIVITA, a, second, optimize=True)
        return self._complete(here, n, weighted, residual, area_slope)

    def _in_plane(self, u: Array) -> SurfaceEvaluation:
        here = self._x + u
        (first,) = self._slopes
        t = first @ here
        n = np.stack((t[..., 1], -t[..., 0]), axis=-1)
        turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
        area_slope = np.einsum("ij,fqb->fqibj", turn, first)
        if self._axisymmetric:
            radius = (self._value @ here)[..., 0]
            area_slope = 2 * np.pi * radius[..., None, None, None] * area_slope
            area_slope[..., 0] += 2 * np.pi * n[..., None] * self._value[:, :, None, :]
            n = 2 * np.pi * radius[..., None] * n
        weighted = self._w[..., None] * self._value
        residual = weighted.swapaxes(1, 2) @ n
        return self._complete(here, n, weighted, residual, area_slope)

    def _complete(
        self, here: Array, n: Array, weighted: Array, residual: Array, area_slope: Array
    ) -> SurfaceEvaluation:
        facets, nodes, dim = here.shape
        tangent = np.einsum("fqa,fqibj->faibj", weighted, area_slope, optimize=True)
        tangent = tangent.reshape(facets, nodes * dim, nodes * dim)
        arm = self._value @ here - self.origin
        parts = 3 if self._dim == 3 or self._axisymmetric else 2
        volume = -float(np.einsum("fq,fqi,fqi->", self._w, arm, n)) / parts
        slope = residual + np.einsum("fq,fqi,fqibj->fbj", self._w, arm, area_slope, optimize=True)
        if self.symmetric:
            tangent = (tangent + tangent.swapaxes(1, 2)) / 2
        return SurfaceEvaluation(
            residual.reshape(facets, -1), tangent, volume, -slope.reshape(facets, -1) / parts
        )


@dataclass(frozen=True)
class _Side:
    """One side of the reference cell: what its own nodes say at its quadrature points."""

    nodes: Integers
    """Local nodes on it, (a,)."""
    value: Array
    """Their shape functions, (q, a)."""
    slopes: tuple[Array, ...]
    """Derivatives along one or two directions with t1 x t2 (or t turned clockwise) outwards."""
    weights: Array
    """Of the quadrature points, (q,)."""

    @staticmethod
    def of(element: Any, cell: Any, number: int) -> _Side:
        corners = cell.p[:, list(cell.facets[number])].T
        along = _along(corners)
        normal = (
            np.cross(along[0], along[1])
            if len(along) == 2
            else np.array([along[0][1], -along[0][0]])
        )
        if normal @ (corners.mean(axis=0) - cell.p.mean(axis=1)) < 0:
            corners = corners[::-1]
            along = _along(corners)
        rule = skfem.quadrature.get_quadrature(_SIDES[len(corners)], _ORDER)
        places = corners[0][:, None] + np.stack(along, axis=1) @ rule[0]
        shapes = [element.lbasis(places, a) for a in range(len(element.doflocs))]
        value = np.stack([shape[0] for shape in shapes], axis=-1)
        nodes = np.flatnonzero(np.abs(value).max(axis=0) > 1e-9)
        slopes = tuple(
            np.stack([t @ shape[1] for shape in shapes], axis=-1)[:, nodes] for t in along
        )
        return _Side(nodes, value[:, nodes], slopes, np.asarray(rule[1]))


def _along(corners: Array) -> list[Array]:
    """Directions from the first corner of a side to its neighbours, or along an edge."""
    ends = (1,) if len(corners) == 2 else (1, -1)
    return [corners[end] - corners[0] for end in ends]
