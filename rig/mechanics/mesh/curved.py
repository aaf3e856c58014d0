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
        """
        local = np.full(x.shape, 0.5)
        rounding = _ROUNDING * np.abs(x).max(initial=0.0)
        for _ in range(newton_max_iters):
            residual = x - self.F(local, tind)
            step = np.einsum("ijkl,jkl->ikl", self.invDF(local, tind), residual)
            local = np.clip(local + step, -0.5, 1.5)
            found = np.abs(step).max(axis=0, initial=0.0) < newton_tol
            found |= np.abs(residual).max(axis=0, initial=0.0) < rounding
            if found.all():
                return np.asarray(local)
        raise MechanicsError(
            f"The mapping of {np.count_nonzero(~found)} points of curved elements cannot be "
            f"inverted: their elements are too distorted. Refine the mesh there."
        )


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
