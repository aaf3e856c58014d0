"""Where a response surface is stationary, and where it is best within bounds; with uncertainty.

Uncertainty is that of the surface's coefficients: the analysis is repeated for coefficients drawn
from their joint normal distribution. For surfaces through deterministic simulations it stands for
what the polynomial misses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import product

import numpy as np

from rig.study.errors import StudyError
from rig.study.factors import Array, actual
from rig.study.surface import Surface

_DRAWS = 200


class Nature(StrEnum):
    """What a stationary point is."""

    MAXIMUM = "maximum"
    MINIMUM = "minimum"
    SADDLE = "saddle"
    RIDGE = "ridge"


class Goal(StrEnum):
    """What is wanted of a response."""

    MAXIMISE = "maximise"
    MINIMISE = "minimise"


@dataclass(frozen=True)
class StationaryPoint:
    """Where the gradient vanishes."""

    coded: Array
    """(k,)."""
    actual: Array
    """(k,), in the factors' units."""
    spread: Array
    """Robust standard deviation of `actual` under the coefficients' uncertainty, (k,)."""
    value: float
    eigenvalues: Array
    """Curvatures along the principal axes, per coded unit squared, ascending, (k,)."""
    nature: Nature
    inside: bool
    """Whether it lies between the factors' levels."""


@dataclass(frozen=True)
class Limit:
    """A response that must stay within bounds."""

    surface: Surface
    low: float = -np.inf
    high: float = np.inf


@dataclass(frozen=True)
class Optimum:
    """The best point between the factors' levels."""

    coded: Array
    actual: Array
    """(k,), in the factors' units."""
    spread: Array
    """Standard deviation of `actual` under the coefficients' uncertainty, (k,)."""
    value: float
    interval: tuple[float, float]
    """95 % prediction interval for a run there."""
    limited: tuple[float, ...]
    """Expected values of the limited responses, in the order of the limits."""
    on_bounds: tuple[bool, ...]
    """For each factor whether it is at one of its levels."""


def stationary_point(surface: Surface, seed: int = 0) -> StationaryPoint:
    """Canonical analysis; raises StudyError for a surface without curvature in some direction."""
    point = _stationary(surface)
    _, _, matrix = surface.quadratic_form()
    curvature = np.linalg.eigvalsh(2 * matrix)
    natures = {(True, False): Nature.MINIMUM, (False, True): Nature.MAXIMUM}
    small = 1e-9 * np.max(np.abs(curvature))
    nature = natures.get(
        (bool(np.all(curvature > small)), bool(np.all(curvature < -small))), Nature.SADDLE
    )
    if np.any(np.abs(curvature) <= small):
        nature = Nature.RIDGE
    drawn = []
    for one in _drawn(surface, seed):
        try:
            drawn.append(actual(surface.factors, _stationary(one)))
        except StudyError:
            continue  # a draw without curvature has no such point
    low, high = np.percentile(drawn, [15.87, 84.13], axis=0)
    return StationaryPoint(
        coded=point,
        actual=actual(surface.factors, point),
        spread=np.asarray((high - low) / 2),
        value=float(surface.predict(point)[0]),
        eigenvalues=np.asarray(curvature, dtype=np.float64),
        nature=nature,
        inside=bool(np.all(np.abs(point) <= 1)),
    )


def optimum(
    surface: Surface,
    goal: Goal,
    limits: Sequence[Limit] = (),
    *,
    radius: float | None = None,
    seed: int = 0,
) -> Optimum:
    """The point between the levels that fulfils `goal` under `limits`.

    `radius` keeps it within a sphere of the coded space (sqrt(2) for a Box-Behnken design of three
    factors, which has no runs in the corners). Raises StudyError where no point meets the limits.
    """
    point = _best(surface, goal, limits, radius)
    if point is None:
        raise StudyError(
            f"no point between the levels keeps "
            f"{', '.join(limit.surface.response for limit in limits)} within limits; relax them, "
            f"or widen the levels."
        )
    drawn = [_best(one, goal, limits, radius, start=point) for one in _drawn(surface, seed)]
    where = np.array([actual(surface.factors, one) for one in drawn if one is not None])
    return Optimum(
        coded=point,
        actual=actual(surface.factors, point),
        spread=where.std(axis=0),
        value=float(surface.predict(point)[0]),
        interval=surface.prediction_interval(point),
        limited=tuple(float(limit.surface.predict(point)[0]) for limit in limits),
        on_bounds=tuple((np.abs(point) > 1 - 1e-6).tolist()),
    )


def _stationary(surface: Surface) -> Array:
    _, linear, matrix = surface.quadratic_form()
    if np.linalg.matrix_rank(matrix, tol=1e-9 * max(np.max(np.abs(matrix)), 1e-300)) < len(linear):
        raise StudyError(
            f"the surface of '{surface.response}' is not curved in all directions: it has no "
            f"stationary point. Look for an optimum between the levels instead."
        )
    return np.asarray(np.linalg.solve(-2 * matrix, linear))


def _drawn(surface: Surface, seed: int) -> list[Surface]:
    rng = np.random.default_rng(seed)
    draws = rng.multivariate_normal(
        surface.coefficients, surface.covariance, size=_DRAWS, method="eigh"
    )
    return [replace(surface, coefficients=row) for row in draws]


def _best(
    surface: Surface,
    goal: Goal,
    limits: Sequence[Limit],
    radius: float | None,
    start: Array | None = None,
) -> Array | None:
    """Best feasible point of SLSQP from the corners and the centre, or from `start`; (k,)."""
    from scipy.optimize import NonlinearConstraint, minimize

    sign = -1.0 if goal is Goal.MAXIMISE else 1.0
    k = len(surface.factors)
    value, slope = _scaled(surface)
    constraints = [_constraint(limit) for limit in limits]
    if radius is not None:
        constraints.append(
            NonlinearConstraint(lambda x: float(x @ x), 0, radius**2, jac=lambda x: 2 * x)
        )
    starts = [np.zeros(k), *(np.array(c) for c in product((-1.0, 1.0), repeat=min(k, 8)))]
    best: Array | None = None
    for first in starts if start is None else [start]:
        found = minimize(
            lambda x: sign * value(x),
            first,
            jac=lambda x: sign * slope(x),
            method="SLSQP",
            bounds=[(-1, 1)] * k,
            constraints=constraints,
            options={"ftol": 1e-12, "maxiter": 300},
        )
        point = np.clip(found.x, -1, 1)
        if not _meets(point, limits, radius):
            continue
        if best is None or sign * surface.predict(point)[0] < sign * surface.predict(best)[0]:
            best = point
    return best


def _scaled(surface: Surface) -> tuple[Callable[[Array], float], Callable[[Array], Array]]:
    """Value and gradient of a surface over its largest coefficient."""
    scale = _size(surface)
    constant, linear, matrix = surface.quadratic_form()
    return (
        lambda x: float(constant + linear @ x + x @ matrix @ x) / scale,
        lambda x: np.asarray((linear + 2 * matrix @ x) / scale),
    )


def _size(surface: Surface) -> float:
    return max(float(np.max(np.abs(surface.coefficients))), 1e-300)


def _constraint(limit: Limit) -> object:
    from scipy.optimize import NonlinearConstraint

    value, slope = _scaled(limit.surface)
    scale = _size(limit.surface)
    return NonlinearConstraint(value, limit.low / scale, limit.high / scale, jac=slope)


def _meets(point: Array, limits: Sequence[Limit], radius: float | None) -> bool:
    if radius is not None and point @ point > radius**2 * (1 + 1e-6):
        return False
    for limit in limits:
        value = float(limit.surface.predict(point)[0])
        slack = 1e-6 * max(abs(value), 1e-300)
        if not limit.low - slack <= value <= limit.high + slack:
            return False
    return True
