"""A circle through points of any curvature, none included, and what is known of it.

The parameters are those of Pratt (SIGGRAPH 1987): curvature, heading of the normal and distance, so
that a straight line is no special case.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from rig.vision.lines import FloatArray, independent_share, lag_one_correlation

LOOSE_MM = 0.2  # beyond which points pull less: a dent, a thread
VALUES = 3
_STEPS = np.array([1e-6, 1e-6, 1e-4])  # per mm, rad, mm: for derivatives


@dataclass(frozen=True)
class Circle:
    """Its `values` (3,), curvature per mm, heading in rad and distance in mm, about `middle` (2,).

    The curvature is signed, against the normal.
    """

    values: FloatArray
    middle: FloatArray

    @property
    def curvature(self) -> float:
        """Signed, per mm."""
        return float(self.values[0])

    def near(self, step: FloatArray) -> Circle:
        """The circle with values (3,) a little different."""
        return replace(self, values=self.values + step)

    def off(self, points: FloatArray) -> FloatArray:
        """Signed distances (n,) of points (n, 2)."""
        return _distances(points - self.middle, self.values)

    def outwards(self, points: FloatArray, inside: FloatArray) -> FloatArray:
        """Unit normals (n, 2) at points (n, 2) on it, away from the side of `inside` (2,)."""
        radii = self._radii(points)
        unit = radii / np.hypot(radii[:, 0], radii[:, 1])[:, None]
        side = np.sign(float(((points - inside) * unit).sum()))
        outwards: FloatArray = side * unit
        return outwards

    def turn(self, ends: FloatArray) -> float:
        """Signed angle in rad between the radii through two points (2, 2)."""
        one, other = self._radii(ends)
        return float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other))

    def covariance(self, points: FloatArray) -> tuple[FloatArray, float]:
        """Covariance (3, 3) of the values from the residuals of points (n, 2) in their order.

        Also its degrees of freedom: of the points that count as independent.
        """
        off, inverse = self.off(points), np.linalg.pinv(self._jacobian(points))
        independent = max(len(off) * independent_share(lag_one_correlation(off)), VALUES + 1.0)
        dof = independent - VALUES
        variance = float(off @ off) / len(off) * independent / dof
        return variance * len(off) / independent * (inverse @ inverse.T), dof

    def moved(self, points: FloatArray, others: FloatArray) -> Circle:
        """The circle through `others` (n, 2), little off its `points`: a Gauss-Newton step."""
        return self.near(
            np.linalg.pinv(self._jacobian(points)) @ (self.off(points) - self.off(others))
        )

    def turn_gradient(self, ends: FloatArray) -> FloatArray:
        """Of `turn` by the values, (3,)."""
        steps = np.diag(_STEPS)
        differences = [self.near(s).turn(ends) - self.near(-s).turn(ends) for s in steps]
        return np.array(differences) / (2.0 * _STEPS)

    def _jacobian(self, points: FloatArray) -> FloatArray:
        """Of the distances of points (n, 2), (n, 3)."""
        steps = np.diag(_STEPS)
        differences = [self.near(s).off(points) - self.near(-s).off(points) for s in steps]
        return np.stack(differences, axis=1) / (2.0 * _STEPS)

    def _radii(self, points: FloatArray) -> FloatArray:
        """Radii (n, 2) to points (n, 2), times the curvature: the normal where that is small."""
        curvature, heading, distance = self.values
        normal = np.array([np.cos(heading), np.sin(heading)])
        radii: FloatArray = curvature * (points - self.middle) + (1 + curvature * distance) * normal
        return radii


def fit_circle(points: FloatArray, loose: float = LOOSE_MM) -> Circle:
    """Robust least squares of the distances of `points` (n, 2); beyond `loose` they pull less."""
    middle = points.mean(axis=0)
    local = points - middle
    across = np.linalg.svd(local, full_matrices=False)[2][1]
    start = [0.0, float(np.arctan2(across[1], across[0])), 0.0]
    found = least_squares(
        lambda values: _distances(local, values), start, loss="soft_l1", f_scale=loose
    )
    return Circle(np.asarray(found.x, dtype=np.float64), middle)


def _distances(points: FloatArray, values: FloatArray) -> FloatArray:
    """Signed distances (n,) of points from the circle of curvature, heading and distance."""
    curvature, heading, distance = values
    along = points @ [np.cos(heading), np.sin(heading)]
    square = (points**2).sum(axis=1) + distance**2
    excess = 0.5 * curvature * square + (1.0 + curvature * distance) * along + distance
    away: FloatArray = 2.0 * excess / (1.0 + np.sqrt(np.maximum(1.0 + 2.0 * curvature * excess, 0)))
    return away
