"""Whether stated intervals hold the truth as often as they say, and are not vast."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

TIGHT, WIDE = 0.3, 0.75
"""Of the r.m.s. error over the expanded uncertainty, which is 0.51 for a normal error."""


def require_coverage(pairs: Sequence[tuple[float, float]], lowest: float, highest: float) -> None:
    """`pairs` are errors and expanded uncertainties; `lowest` to `highest` the allowed share."""
    errors, u95 = np.array(pairs).T
    within = (np.abs(errors) <= u95).mean()
    ratio = np.sqrt(np.mean((errors / u95) ** 2))
    print(f"{len(pairs)} measurements: {within:.1%} within U; r.m.s. error / U {ratio:.3f}")
    assert lowest <= within <= highest
    assert TIGHT < ratio < WIDE
