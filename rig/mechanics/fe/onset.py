"""How contact sets in: at once, or rounded off so that Newton does not chatter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rounded(depth: Array, softness: float) -> tuple[Array, Array]:
    """What a depth counts for, and its derivative: 0 above the surface, the depth itself below.

    Within `softness` c on both sides it is (depth + c)^2 / (4 c); with c = 0 there is a kink.
    """
    if softness == 0.0:
        inside = np.where(depth >= 0, 1.0, 0.0)
        return np.where(depth >= 0, depth, 0.0), inside
    inside = np.clip((depth + softness) / (2 * softness), 0.0, 1.0)
    return np.where(inside < 1, softness * inside**2, depth), inside
