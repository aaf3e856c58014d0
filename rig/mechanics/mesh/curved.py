"""scikit-fem meshes whose facets can be integrated however curved their elements are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshHex2, MeshQuad2, MeshTet2
from skfem.mapping import MappingIsoparametric

from rig.mechanics.errors import MechanicsError

Array = NDArray[np.float64]

_TOLERANCE = 1e-10
"""Of local coordinates."""
_OUTSIDE = 1e-6
"""Of local coordinates: how far outside its element a point may lie, by rounding where the
Jacobian is small."""
_GRID = 17
"""Points a direction among which a better start is looked for."""
_ROUNDING = 4e-16
"""Of positions, relative to the largest."""


class _CurvedMapping(MappingIsoparametric):  # type: ignore[misc]
    def invF(  # noqa: N802 (scikit-fem's name)
        self,
        x: Array,
        tind: NDArray[np.int64] | None = None,
        newton_max_iters: int = 60,
        newton_tol: float = _TOLERANCE,
    ) -> Array:
        """Local coordinates of places `x` (d, elements, points) in the elements `tind`.

        Newton's method as in scikit-fem, which asks for 1e-12 summed over directions and points
        (millimetre elements at centimetres from the origin do not reach that) and cuts every step
        at the faces of the element (where it then creeps along them if the element is curved).
        A mapping that is bijective on its element may have further roots outside of it: points
        that Newton's method takes there, or nowhere, start again from the nearest of a grid.
        """
        every = np.arange(self.mesh.nelements) if tind is None else np.asarray(tind)
        local, found = self._newton(x, np.full(x.shape, 0.5), every, newton_max_iters, newton_tol)
        lost = np.flatnonzero(~found.all(axis=1))
        if lost.size:
            start = self._nearest(x[:, lost], every[lost])
            local[:, lost], found[lost] = self._newton(
                x[:, lost], start, every[lost], newton_max_iters, newton_tol
            )
        if not found.all():
            raise MechanicsError(
                f"The mapping of {np.count_nonzero(~found)} points of curved elements cannot be "
                f"inverted: their elements are too distorted. Refine the mesh there."
            )
        return local

    def _newton(
        self, x: Array, local: Array, tind: NDArray[np.int64], iterations: int, tolerance: float
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Local coordinates, and which of them (elements, points) are roots in their element."""
        rounding = _ROUNDING * np.abs(x).max(initial=0.0)
        found = np.zeros(x.shape[1:], dtype=bool)
        for _ in range(iterations):
            residual = x - self.F(local, tind)
            step = np.einsum("ijkl,jkl->ikl", self.invDF(local, tind), residual)
            local = np.clip(local + step, -0.5, 1.5)
            found = np.abs(step).max(axis=0, initial=0.0) < tolerance
            found |= np.abs(residual).max(axis=0, initial=0.0) < rounding
            if found.all():
                break
        inside = np.abs(local - 0.5).max(axis=0, initial=0.0) < 0.5 + _OUTSIDE
        return local, found & inside

    def _nearest(self, x: Array, tind: NDArray[np.int64]) -> Array:
        """Of a grid of local points the one whose image is nearest to each place."""
        dim = x.shape[0]
        ticks = np.linspace(0.0, 1.0, _GRID)
        grid = np.stack(np.meshgrid(*[ticks] * dim, indexing="ij")).reshape(dim, -1)
        images = self.F(np.broadcast_to(grid[:, None], (dim, tind.size, grid.shape[1])), tind)
        distance = np.sum((x[:, :, :, None] - images[:, :, None, :]) ** 2, axis=0)
        return np.asarray(grid[:, np.argmin(distance, axis=-1)])


class _Curved:
    def _mapping(self: Any) -> _CurvedMapping:
        if not hasattr(self, "_cached_mapping"):
            self._cached_mapping = _CurvedMapping(self, self.elem(), self.bndelem)
        mapping: _CurvedMapping = self._cached_mapping
        return mapping


@dataclass(repr=False)
class CurvedHex(_Curved, MeshHex2):  # type: ignore[misc]
    """27-node hexahedra."""


@dataclass(repr=False)
class CurvedTet(_Curved, MeshTet2):  # type: ignore[misc]
    """10-node tetrahedra."""


@dataclass(repr=False)
class CurvedQuad(_Curved, MeshQuad2):  # type: ignore[misc]
    """9-node quadrilaterals."""
