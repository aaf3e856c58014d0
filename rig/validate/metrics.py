"""How far a model is from an experiment, and how well the experiment repeats itself.

Comparison error E = S - D (simulation minus data) and validation uncertainty after ASME V&V 20-2009
(section 1-5); repeatability after ISO 5725-2:2019 (7.4); uncertainties propagated after GUM 5.1 and
5.2: errors random from repeat to repeat are independent between levels, errors of a calibration
are common to all of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtri

from rig.validate.errors import ValidateError
from rig.validate.uncertainty import Component, Estimate, combine

Array = NDArray[np.float64]
VALIDATION_COVERAGE = 2.0
"""Coverage factor of the validation uncertainty: about 95 % for many degrees of freedom."""


@dataclass(frozen=True)
class ComparisonErrors:
    """Model minus experiment at n levels of pressure, with all that makes it uncertain.

    All arrays have shape (n,) and one unit.
    """

    error: Array
    u_random: Array
    """Standard uncertainty from repeats; independent from level to level."""
    dof: Array
    """Degrees of freedom of `u_random`."""
    u_common: Mapping[str, Array] = field(default_factory=dict)
    """For each calibration the error that one standard uncertainty of it makes at each level,
    signed: at all levels it acts together."""
    u_input: Mapping[str, Array] = field(default_factory=dict)
    """As `u_common`, for each input of the model: how far the model may be off by no fault of its
    own. It counts for validation, not for how far model and experiment are apart."""

    def __post_init__(self) -> None:
        arrays = [self.error, self.u_random, self.dof]
        arrays += [*self.u_common.values(), *self.u_input.values()]
        if self.error.ndim != 1 or self.error.size == 0:
            raise ValidateError(
                "there is no level at which model and experiment can be compared. Take at least "
                "one point within the range of the model."
            )
        if any(array.shape != self.error.shape for array in arrays):
            raise ValidateError("error and uncertainties must have one value for each level.")
        if not all(np.all(np.isfinite(array)) for array in arrays[:2] + arrays[3:]):
            raise ValidateError("errors and uncertainties must be finite numbers.")

    @property
    def u_data(self) -> Array:
        """Standard uncertainty of the experiment at each level, (n,)."""
        return _root_sum(self.u_random, *self.u_common.values())

    @property
    def u_simulation(self) -> Array:
        """Standard uncertainty that the inputs leave to the model at each level, (n,)."""
        return _root_sum(np.zeros_like(self.error), *self.u_input.values())

    @property
    def u_validation(self) -> Array:
        """Validation uncertainty u_val at each level, (n,): V&V 20 eq. (1-5-8).

        The numerical part, u_num, is not in it: finite elements are converged beforehand.
        """
        return _root_sum(self.u_data, self.u_simulation)

    def propagate(self, value: float, sensitivity: Array) -> Estimate:
        """Estimate of a result of the errors with sensitivity coefficients (n,)."""
        random = [
            Component("repeats", abs(c) * u, dof)
            for c, u, dof in zip(sensitivity, self.u_random, self.dof, strict=True)
        ]
        common = [Component(name, abs(float(sensitivity @ u))) for name, u in self.u_common.items()]
        return combine(value, random + common)


def _root_sum(*parts: Array) -> Array:
    return np.asarray(np.hypot.reduce(np.stack(parts), axis=0), dtype=np.float64)


def bias(errors: ComparisonErrors) -> Estimate:
    """Mean comparison error."""
    n = errors.error.size
    return errors.propagate(float(errors.error.mean()), np.full(n, 1.0 / n))


def rmse(errors: ComparisonErrors) -> Estimate:
    """Root of the mean squared comparison error.

    Propagation is linear, dR/dE_i = E_i / (n R). Where R is within its own uncertainty that
    gradient says nothing; the root mean square of the uncertainties, which bounds it, is then
    taken.
    """
    n = errors.error.size
    value = math.sqrt(float(np.mean(errors.error**2)))
    bound = math.sqrt(float(np.mean(errors.u_data**2)))
    if value <= bound:
        return Estimate(value, bound, float(errors.dof.min()))
    return errors.propagate(value, errors.error / (n * value))


def maximum_error(errors: ComparisonErrors) -> tuple[int, Estimate]:
    """Level of the largest absolute comparison error, and that error without its sign."""
    level = int(np.argmax(np.abs(errors.error)))
    sensitivity = np.zeros(errors.error.size)
    sensitivity[level] = 1.0
    return level, errors.propagate(abs(float(errors.error[level])), sensitivity)


def normalised(estimate: Estimate, span: float) -> Estimate:
    """`estimate` in per cent of the measured range `span`; its uncertainty is neglected."""
    if not span > 0:
        raise ValidateError(
            "the measured values have no range to normalise by: all levels gave the same."
        )
    return Estimate(100 * estimate.value / span, 100 * estimate.u / span, estimate.dof)


@dataclass(frozen=True)
class ValidationStatement:
    """What comparison says about a model, after V&V 20: the model's error is E +- k u_val."""

    levels: int
    beyond: int
    """Levels at which |E| exceeds k u_val: there the model is wrong by about E."""
    coverage: float
    largest_ratio: float
    """Largest |E| / (k u_val) of all levels."""

    @property
    def agrees(self) -> bool:
        """No difference that the experiment could resolve."""
        return self.beyond == 0


def validation_statement(errors: ComparisonErrors) -> ValidationStatement:
    """Compare |E| with the expanded validation uncertainty at every level."""
    expanded = VALIDATION_COVERAGE * errors.u_validation
    size = np.abs(errors.error)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(size > 0, size / expanded, 0.0)
    return ValidationStatement(
        levels=errors.error.size,
        beyond=int(np.sum(ratio > 1)),
        coverage=VALIDATION_COVERAGE,
        largest_ratio=float(ratio.max()),
    )


def en_number(first: Estimate, second: Estimate) -> float:
    """Difference second - first over its expanded uncertainty (ISO 13528:2022, 9.7).

    Beyond 1 the two results do not agree within their uncertainties for 95 %, taken as
    independent. Infinite with the sign of the difference if both are free of uncertainty.
    """
    difference = second.value - first.value
    expanded = math.hypot(first.u95, second.u95)
    if expanded == 0:
        return math.copysign(math.inf, difference) if difference else 0.0
    return difference / expanded


@dataclass(frozen=True)
class Repeatability:
    """Scatter of repeats under the same conditions."""

    sd: float
    """Repeatability standard deviation, pooled over levels."""
    dof: int
    low: float
    high: float
    """95 % interval of `sd` for normally distributed repeats."""

    @property
    def limit(self) -> float:
        """Two single results differ by more than this in one case of twenty (ISO 5725-6, 4.1)."""
        return 2.8 * self.sd


def repeatability(groups: Sequence[Array]) -> Repeatability | None:
    """Pooled standard deviation of repeats, one array for each level; None without repeats."""
    repeated = [group for group in groups if group.size > 1]
    dof = sum(group.size - 1 for group in repeated)
    if dof == 0:
        return None
    squares = sum(float(np.sum((group - group.mean()) ** 2)) for group in repeated)
    return Repeatability(
        sd=math.sqrt(squares / dof),
        dof=dof,
        low=math.sqrt(squares / float(chdtri(dof, 0.025))),
        high=math.sqrt(squares / float(chdtri(dof, 0.975))),
    )


def same_variance(groups: Sequence[Array], significance: float = 0.05) -> bool:
    """Whether groups of repeats may have one variance: Cochran's test (ISO 5725-2:2019, 8.3.3).

    Its critical value from the F distribution ('t Lam 2010, eq. 3), with the mean size of a group
    where they differ. Groups without repeats do not count; one group agrees with itself.
    """
    repeated = [group for group in groups if group.size > 1]
    count = len(repeated)
    variances = np.array([group.var(ddof=1) for group in repeated])
    if count < 2 or not variances.sum() > 0:
        return True
    dof = float(np.mean([group.size - 1 for group in repeated]))
    limit = float(fdtri(dof, (count - 1) * dof, 1 - significance / count))
    return bool(variances.max() / variances.sum() <= 1 / (1 + (count - 1) / limit))


@dataclass(frozen=True)
class Hysteresis:
    """Largest difference between descending and ascending branch at the same level."""

    level: int
    difference: float
    """Descending minus ascending, signed."""
    percent_of_span: float


def hysteresis(ascending: Array, descending: Array) -> Hysteresis | None:
    """Compare branches level by level, both (n,), NaN where a level was not visited.

    The span is that of the ascending branch. None if no level was visited on both branches or
    the span is zero.
    """
    difference = descending - ascending
    known = np.isfinite(difference)
    if not known.any():
        return None
    span = float(np.nanmax(ascending) - np.nanmin(ascending))
    if span == 0:
        return None
    level = int(np.argmax(np.where(known, np.abs(difference), -1.0)))
    worst = float(difference[level])
    return Hysteresis(level, worst, 100 * abs(worst) / span)
