"""Where things should be by now: a Kalman filter (Kalman 1960) that only predicts and gates.

Constant velocity with white acceleration, for any number of coordinates at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import KalmanFilter

from rig.vision.errors import VisionError
from rig.vision.lines import FloatArray


def require_later(time_s: float, before_s: float) -> None:
    """Raises VisionError where a film's frame does not come after the one before."""
    if time_s <= before_s:
        raise VisionError(
            f"A frame at {time_s:g} s follows one at {before_s:g} s; expected frames of one film "
            "in the order in which they were taken."
        )


@dataclass(frozen=True)
class ConstantVelocity:
    """Each of n coordinates followed by its rate."""

    mean: FloatArray
    """(2n,)"""
    covariance: FloatArray
    """(2n, 2n)"""

    @classmethod
    def begun(cls, values: FloatArray, u: FloatArray, u_rate: FloatArray) -> ConstantVelocity:
        """From one look (n,) with its standard uncertainties; rates are zero within `u_rate`."""
        mean = np.stack([values, np.zeros_like(values)], axis=1).ravel()
        return cls(mean, np.diag(np.stack([u, u_rate], axis=1).ravel() ** 2))

    @property
    def values(self) -> FloatArray:
        """(n,)"""
        return self.mean[::2]

    @property
    def rates(self) -> FloatArray:
        """(n,)"""
        return self.mean[1::2]

    @property
    def u(self) -> FloatArray:
        """(n,) standard uncertainties of the values."""
        return np.asarray(np.sqrt(np.diag(self.covariance)[::2]), dtype=np.float64)

    def predicted(self, step_s: float, acceleration: FloatArray) -> ConstantVelocity:
        """The same `step_s` later; `acceleration` (n,) are standard deviations."""
        filter_ = self._filter()
        filter_.F = np.kron(np.eye(len(self.values)), [[1.0, step_s], [0.0, 1.0]])
        unit = Q_discrete_white_noise(2, dt=step_s, var=1.0)
        filter_.Q = np.kron(np.diag(acceleration**2), unit)
        filter_.predict()
        return ConstantVelocity(filter_.x.ravel(), np.asarray(filter_.P))

    def updated(self, values: FloatArray, u: FloatArray) -> ConstantVelocity:
        """With a look (n,) at its time."""
        filter_ = self._filter()
        filter_.update(values[:, None], R=np.diag(u**2))
        return ConstantVelocity(filter_.x.ravel(), np.asarray(filter_.P))

    def _filter(self) -> KalmanFilter:
        count = len(self.values)
        filter_ = KalmanFilter(dim_x=2 * count, dim_z=count)
        filter_.x = self.mean[:, None].copy()
        filter_.P = self.covariance.copy()
        filter_.H = np.kron(np.eye(count), [[1.0, 0.0]])
        return filter_
