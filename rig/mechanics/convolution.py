"""Unfolding of half a convolution: six closure equations for the deformed middle surface.

The half convolution runs from the trough D over the arc R2, the flank f and the arc R1 to the
crest A (Fig. 5 of the paper, read from D to A). Unfolding keeps the three lengths

    R1' phi1' = R1 pi/2,    R2' phi2' = R2 pi/2,    f' = f,

keeps the wall smooth and the symmetry lines of trough and crest normal to it

    phi1' = phi2' + alpha,    beta' = pi/2 - phi2',

where beta' is the tilt of the flank and alpha the angle between the two symmetry lines (0 in a
straight bellow, Theta / (2 N) in a bent one), and closes on the width that is asked for

    u - slope v = width,

with u, v the extents from trough to crest along and across the trough's tangent. In a straight
bellow `slope` is 0 and `width` the half-length; in a bent one they say at which distance from the
centre of curvature the convolution sits (`rig.mechanics.profile`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

QUARTER = np.pi / 2

UNFOLDED = 0.1
"""Arc angle in rad at which a convolution counts as unfolded (the toolbox stops there)."""

_FOLDED = 0.9 * np.pi
_CLOSED = 1e-13
_MAX_ITERATIONS = 100


@dataclass(frozen=True)
class HalfConvolution:
    """Lengths of the middle surface of the undeformed half convolution, metres."""

    crest_radius: float
    """R1 = r1 + t/2."""
    trough_radius: float
    """R2 = r2 - t/2."""
    flank: float
    """f."""

    @property
    def half_length(self) -> float:
        """Axial length, R1 + R2."""
        return self.crest_radius + self.trough_radius

    @property
    def max_elongation(self) -> float:
        """Axial growth at which the arcs reach `UNFOLDED`, no wedge."""
        u, _ = _extents(self, np.array(UNFOLDED), np.array(0.0))
        return float(u) - self.half_length


@dataclass(frozen=True)
class Unfolded:
    """A deformed half convolution; arrays have the shape of the requested widths.

    `stretch` is 1 where lengths are kept; beyond complete unfolding all lengths grow by it.
    """

    crest_radius: Array
    trough_radius: Array
    crest_angle: Array
    trough_angle: Array
    flank: Array
    flank_tilt: Array
    u: Array
    v: Array
    stretch: Array


def unfold(
    half: HalfConvolution, width: ArrayLike, wedge: ArrayLike = 0.0, slope: ArrayLike = 0.0
) -> Unfolded:
    """Solve the closure equations for `width` in metres and the wedge angle alpha in rad.

    Beyond complete unfolding the arcs stay at `UNFOLDED` and all lengths stretch alike, so that
    the answer is continuous for every width.
    """
    width, wedge, slope = np.broadcast_arrays(
        *(np.asarray(value, dtype=float) for value in (width, wedge, slope))
    )
    lowest = UNFOLDED + np.maximum(-wedge, 0.0)
    u, v = _extents(half, lowest, wedge)
    stretched = u - slope * v < width
    angle = np.where(stretched, lowest, _trough_angle(half, width, wedge, slope, lowest))
    u, v = _extents(half, angle, wedge)
    stretch = np.where(stretched, width / (u - slope * v), 1.0)
    return Unfolded(
        crest_radius=stretch * half.crest_radius * QUARTER / (angle + wedge),
        trough_radius=stretch * half.trough_radius * QUARTER / angle,
        crest_angle=angle + wedge,
        trough_angle=angle,
        flank=stretch * half.flank,
        flank_tilt=QUARTER - angle,
        u=stretch * u,
        v=stretch * v,
        stretch=stretch,
    )


def _extents(half: HalfConvolution, angle: Array, wedge: Array) -> tuple[Array, Array]:
    trough = half.trough_radius * QUARTER / angle
    crest = half.crest_radius * QUARTER / (angle + wedge)
    sine, cosine = np.sin(angle), np.cos(angle)
    u = trough * sine + half.flank * cosine + crest * (sine + np.sin(wedge))
    v = trough * (1 - cosine) + half.flank * sine + crest * (np.cos(wedge) - cosine)
    return u, v


def _trough_angle(
    half: HalfConvolution, width: Array, wedge: Array, slope: Array, lowest: Array
) -> Array:
    """Root of u - slope v = width, whose left side falls: Newton's method kept in a bracket."""
    low, high = lowest, np.full_like(width, _FOLDED)
    angle = np.full_like(width, QUARTER)
    for _ in range(_MAX_ITERATIONS):
        u, v = _extents(half, angle, wedge)
        du, dv = _extent_rates(half, angle, wedge)
        miss = u - slope * v - width
        low, high = np.where(miss > 0, angle, low), np.where(miss > 0, high, angle)
        newton = angle - miss / (du - slope * dv)
        inside = (newton >= low) & (newton <= high)
        step = np.where(inside, newton, (low + high) / 2) - angle
        angle = angle + step
        if np.all(np.abs(step) < _CLOSED):
            break
    return angle


def _extent_rates(half: HalfConvolution, angle: Array, wedge: Array) -> tuple[Array, Array]:
    """Derivatives of `_extents` with respect to the trough angle."""
    trough = half.trough_radius * QUARTER / angle
    crest = half.crest_radius * QUARTER / (angle + wedge)
    sine, cosine = np.sin(angle), np.cos(angle)
    du = (
        trough * (cosine - sine / angle)
        - half.flank * sine
        + crest * (cosine - (sine + np.sin(wedge)) / (angle + wedge))
    )
    dv = (
        trough * (sine - (1 - cosine) / angle)
        + half.flank * cosine
        + crest * (sine - (np.cos(wedge) - cosine) / (angle + wedge))
    )
    return du, dv
