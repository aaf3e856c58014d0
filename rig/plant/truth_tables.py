"""What a specimen's response is tabulated as, whatever theory it comes from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TruthTables:
    """Quasi-static response over the specimen's pressures; each (n,), SI units."""

    deformation: Array
    """Bending angle in rad or elongation in m, tip free."""
    blocked_force: Array
    """Force on the stop in N."""
    volume_free: Array
    """Volume of the cavity in m3, tip free."""
    volume_blocked: Array
    """Volume of the cavity in m3, tip at the stop."""
