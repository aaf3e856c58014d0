"""Robust straight lines through edge points, with the uncertainty of their direction."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.spec.student import widening

FloatArray = NDArray[np.float64]

HUBER_TUNING = 1.345  # 95 % efficiency on Gaussian residuals (Huber 1981)
BISQUARE_TUNING = 4.685  # the same for Tukey's bisquare
MAD_TO_SIGMA = 1.4826
HUBER_STEPS, BISQUARE_STEPS = 2, 3


@dataclass(frozen=True)
class LineFit:
    """A line in the image: `centre` (2,) px, unit `direction` (2,), residuals and uncertainty."""

    centre: FloatArray
    direction: FloatArray
    u_direction_rad: float  # of the direction from the residuals; 1.96 of it are a 95 % interval
    rms_px: float  # weighted scatter of the points across the line
    offsets_px: FloatArray  # (n,) signed distance of every point from the line


def fit_line(points: FloatArray, weights: FloatArray, least_correlation: float = 0.0) -> LineFit:
    """Robust total least squares line through ordered points (n, 2).

    Huber weights come close to the line from anywhere, Tukey's bisquare then drops what is not
    on it, as where something lies across a part of the edge.

    `weights` (n,) are relative prior weights. Neighbouring edge points are correlated by the
    lens, the sensor and JPEG blocks, so the number of independent points is smaller than n: see
    `independent_share`. Few residuals tell little of that, so they are held to be correlated by
    `least_correlation` at least; at the degrees of freedom which that alone leaves, 1.96 times the
    uncertainty is Student's 95 % interval. Needs n >= 3.
    """
    robust = weights.astype(np.float64).copy()
    centre, direction, offsets = plain_line(points, robust)
    scale = 0.0
    for step in range(HUBER_STEPS + BISQUARE_STEPS):
        scale = max(MAD_TO_SIGMA * median(np.abs(offsets)), 1e-4)
        if step < HUBER_STEPS:
            robust = weights / np.maximum(np.abs(offsets) / (HUBER_TUNING * scale), 1.0)
        else:
            ratio = np.minimum(np.abs(offsets) / (BISQUARE_TUNING * scale), 1.0)
            robust = weights * (1.0 - ratio**2) ** 2
        centre, direction, offsets = plain_line(points, robust)
    along = (points - centre) @ direction
    total = float(robust.sum())
    scatter = float((robust * offsets**2).sum()) / total
    spread = float((robust * along**2).sum()) / total
    correlation = max(lag_one_correlation(offsets), least_correlation)
    dof = _degrees_of_freedom(len(points), correlation)
    wider = widening(_degrees_of_freedom(len(points), least_correlation))
    u_direction = wider * np.sqrt(scatter / max(spread, 1e-12) / dof)
    return LineFit(
        centre=centre,
        direction=direction,
        u_direction_rad=float(u_direction),
        rms_px=float(np.sqrt(scatter * len(points) / max(len(points) - 2, 1))),
        offsets_px=offsets,
    )


def plain_line(
    points: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Weighted total least squares: centre (2,), unit direction (2,), signed offsets (n,).

    The direction runs from the first point to the last.
    """
    x, y = points[:, 0], points[:, 1]
    total = float(weights.sum())
    middle_x, middle_y = float(weights @ x) / total, float(weights @ y) / total
    x, y = x - middle_x, y - middle_y
    weighted_x, weighted_y = weights * x, weights * y
    scatter = float(weighted_x @ x), float(weighted_x @ y), float(weighted_y @ y)
    half = 0.5 * atan2(2.0 * scatter[1], scatter[0] - scatter[2])  # axis of a 2x2 scatter matrix
    along, across = cos(half), sin(half)
    if along * (x[-1] - x[0]) + across * (y[-1] - y[0]) < 0.0:
        along, across = -along, -across
    return np.array([middle_x, middle_y]), np.array([along, across]), y * along - x * across


def median(values: NDArray[Any]) -> float:
    """Upper median of (n,) values: much cheaper than NumPy's, and as good for a scale."""
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])


def lag_one_correlation(offsets: FloatArray) -> float:
    """Of neighbouring residuals (n,) about a fit, taken to be between 0 and 0.95."""
    energy = float(offsets @ offsets)
    if energy <= 0.0:
        return 0.0
    return min(max(float(offsets[1:] @ offsets[:-1]) / energy, 0.0), 0.95)


def independent_share(correlation: float) -> float:
    """Share (1 - r) / (1 + r) of residuals that count as independent.

    The effective sample size of an AR(1) process with the lag-one correlation r.
    """
    return (1.0 - correlation) / (1.0 + correlation)


def _degrees_of_freedom(count: int, correlation: float) -> float:
    """What a line leaves of points that are correlated; one at least."""
    return max(count * independent_share(correlation) - 2.0, 1.0)
