"""Linear least squares with the covariance of its parameters.

b = (X'X)^-1 X'y, cov b = s^2 (X'X)^-1 with s^2 from the residuals (Draper and Smith, Applied
Regression Analysis, 3rd ed., sections 5.1 to 5.3; GUM H.3 for a straight line).

Points come in the order of time, and instruments drift: neighbouring residuals resemble each other.
With their correlation r the n points count as n (1 - r) / (1 + r) independent ones (Bayley and
Hammersley 1946, for a first-order process); variance and degrees of freedom are those.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibrate.errors import CalibrateError
from rig.spec.calibration import Fit
from rig.spec.student import widening

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinearFit:
    """Parameters (k,) by name, their covariance (k, k), and residuals (n,), measured - fitted."""

    names: tuple[str, ...]
    values: Array
    covariance: Array
    residuals: Array
    dof: float
    """Degrees of freedom, of the points that count as independent."""

    @property
    def sd(self) -> float:
        """Standard deviation of the residuals."""
        return float(np.std(self.residuals, ddof=self.values.size))

    def __getitem__(self, name: str) -> float:
        """Value of a parameter."""
        return float(self.values[self.names.index(name)])

    def u(self, weights: Mapping[str, float]) -> float:
        """Standard uncertainty of a weighted sum of parameters.

        Widened so that 1.96 of it are the 95 % interval of Student at these degrees of freedom:
        those who use a calibration take its uncertainties for normal.
        """
        w = np.array([weights.get(name, 0.0) for name in self.names])
        return widening(self.dof) * float(np.sqrt(w @ self.covariance @ w))

    def record(self, model: str) -> Fit:
        """The fit as calibration files keep it; `model` says its equation and units."""
        return Fit(
            model=model,
            parameters=self.names,
            values=tuple(self.values.tolist()),
            covariance=tuple(tuple(row) for row in self.covariance.tolist()),
            residuals=tuple(self.residuals.tolist()),
            degrees_of_freedom=round(self.dof, 3),
        )


def least_squares(
    columns: Mapping[str, Array], measured: Array, *, in_time: bool = True
) -> LinearFit:
    """Fit `measured` (n,) by a sum of `columns`, each (n,), times their parameters.

    `in_time` says that the points stand in the order of time, so that neighbours may be correlated.

    Raises CalibrateError where there are not more points than parameters, or the points do not
    tell the parameters apart.
    """
    design = np.column_stack(list(columns.values()))
    points, parameters = design.shape
    if points <= parameters:
        raise CalibrateError(
            f"{points} points cannot tell {parameters} parameters and their uncertainty; take at "
            f"least {parameters + 1}."
        )
    # Columns of very different size are brought to one, so that rank means what it says.
    scale = np.linalg.norm(design, axis=0)
    if not np.all(scale > 0) or np.linalg.matrix_rank(design / scale) < parameters:
        raise CalibrateError(
            f"the points do not tell {', '.join(columns)} apart: spread them over the whole range."
        )
    q, r = np.linalg.qr(design / scale)
    values = np.linalg.solve(r, q.T @ measured) / scale
    residuals = measured - design @ values
    inverse = np.linalg.inv(r)
    share = _independent_share(residuals) if in_time else 1.0
    variance = float(residuals @ residuals) / (points - parameters) / share
    covariance = variance * (inverse @ inverse.T) / np.outer(scale, scale)
    dof = max(1.0, points * share - parameters)
    return LinearFit(tuple(columns), values, covariance, residuals, dof)


def _independent_share(residuals: Array) -> float:
    """Share of points that count as independent, from the correlation of neighbours."""
    whole = float(residuals @ residuals)
    r = float(residuals[1:] @ residuals[:-1]) / whole if whole > 0 else 0.0
    r = min(max(r, 0.0), 0.9)
    return (1 - r) / (1 + r)
