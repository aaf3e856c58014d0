"""scikit-fem meshes whose facets can be integrated however curved their elements are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshHex2, MeshQuad2, MeshTet2
from skfem.mapping import MappingIsoparametric

INVERSE_TOLERANCE = 1e-10
"""Of local coordinates. scikit-fem's default, 1e-12 summed over directions and points, is below
what rounding lets millimetre elements at centimetres from the origin reach."""


class _CurvedMapping(MappingIsoparametric):  # type: ignore[misc]
    def invF(  # noqa: N802 (scikit-fem's name)
        self,
        x: NDArray[np.float64],
        tind: NDArray[np.int64] | None = None,
        newton_max_iters: int = 50,
        newton_tol: float = INVERSE_TOLERANCE,
    ) -> NDArray[np.float64]:
        """Local coordinates of places `x`, found to `newton_tol`."""
        return np.asarray(super().invF(x, tind, newton_max_iters, newton_tol))


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
