"""Which factors matter: Sobol indices, Morris screening (SALib), and distributions of tolerances.

The model is a function of many points at once: beam theory itself, or a response surface of a
finished study where one answer is dear.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rig.study.errors import StudyError
from rig.study.extras import package
from rig.study.factors import Array, Factor

Model = Callable[[Array], Array]
"""Points (n, k) in the factors' units to responses (n,)."""


@dataclass(frozen=True)
class SobolIndices:
    """Shares of the response's variance; arrays (k,), intervals are half widths at 95 %."""

    factors: tuple[str, ...]
    first: Array
    first_interval: Array
    total: Array
    total_interval: Array
    evaluations: int


@dataclass(frozen=True)
class MorrisScreening:
    """Elementary effects in units of the response per whole range of a factor, (k,)."""

    factors: tuple[str, ...]
    mean: Array
    """mu: with sign."""
    absolute: Array
    """mu*: of sizes."""
    spread: Array
    """sigma: large for curved and interacting factors."""
    evaluations: int


@dataclass(frozen=True)
class Tolerance:
    """The response's distribution when factors scatter normally, levels at two deviations."""

    mean: float
    deviation: float
    percentiles: dict[float, float]
    """Percent to value."""
    shares: dict[str, float]
    """Factor to its share of the variance by itself: squared rank correlation with the response,
    over their sum."""
    values: Array
    """All responses, (n,)."""
    lost: int
    """Points without a response: shapes that cannot be."""


def sobol_indices(model: Model, factors: Sequence[Factor], samples: int, seed: int) -> SobolIndices:
    """First-order and total indices (Saltelli, 2010) of factors uniform between their levels.

    `samples` is N, a power of two; the model is asked N (k + 2) times. Raises StudyError for other
    N, and where the model has no value at some point.
    """
    analysis = package("SALib.analyze.sobol", "study")
    sampling = package("SALib.sample.sobol", "study")
    if samples < 2 or samples & (samples - 1):
        raise StudyError(
            f"{samples} samples do not keep the balance of a Sobol sequence; expected a power of "
            f"two, as {2 ** max(int(samples).bit_length(), 4)}."
        )
    problem = _problem(factors)
    points = sampling.sample(problem, samples, calc_second_order=False, seed=seed)
    values = _sound(model(points))
    found = analysis.analyze(problem, values, calc_second_order=False, seed=seed)
    return SobolIndices(
        factors=tuple(f.name for f in factors),
        first=np.asarray(found["S1"]),
        first_interval=np.asarray(found["S1_conf"]),
        total=np.asarray(found["ST"]),
        total_interval=np.asarray(found["ST_conf"]),
        evaluations=len(points),
    )


def morris_screening(
    model: Model, factors: Sequence[Factor], trajectories: int, seed: int
) -> MorrisScreening:
    """Elementary effects along `trajectories` random paths of four levels (Morris, 1991).

    Raises StudyError where the model has no value at some point.
    """
    analysis = package("SALib.analyze.morris", "study")
    sampling = package("SALib.sample.morris", "study")
    problem = _problem(factors)
    points = sampling.sample(problem, trajectories, num_levels=4, seed=seed)
    values = _sound(model(points))
    found = analysis.analyze(problem, points, values, num_levels=4, scaled=False, seed=seed)
    return MorrisScreening(
        factors=tuple(f.name for f in factors),
        mean=np.asarray(found["mu"]),
        absolute=np.asarray(found["mu_star"]),
        spread=np.asarray(found["sigma"]),
        evaluations=len(points),
    )


def tolerance(model: Model, factors: Sequence[Factor], samples: int, seed: int) -> Tolerance:
    """Distribution of the response by `samples` draws; levels are plus and minus two deviations.

    Raises StudyError where more than one in a hundred draws has no response.
    """
    from scipy.stats import spearmanr

    rng = np.random.default_rng(seed)
    centre, half = np.array([[f.centre, f.half] for f in factors]).T
    points = centre + half / 2 * rng.standard_normal((samples, len(factors)))
    values = model(points)
    sound = np.isfinite(values)
    lost = int(np.sum(~sound))
    if lost > samples / 100:
        raise StudyError(
            f"{lost} of {samples} draws are shapes that cannot be, or that the model does not "
            f"cover; narrow the tolerances, or ask at a lower pressure."
        )
    values, points = values[sound], points[sound]
    squared = np.array([spearmanr(column, values).statistic ** 2 for column in points.T])
    return Tolerance(
        mean=float(values.mean()),
        deviation=float(values.std(ddof=1)),
        percentiles={p: float(np.percentile(values, p)) for p in (2.5, 25, 50, 75, 97.5)},
        shares={
            f.name: float(share) for f, share in zip(factors, squared / squared.sum(), strict=True)
        },
        values=values,
        lost=lost,
    )


def _problem(factors: Sequence[Factor]) -> dict[str, object]:
    return {
        "num_vars": len(factors),
        "names": [f.name for f in factors],
        "bounds": [[f.low, f.high] for f in factors],
    }


def _sound(values: Array) -> Array:
    lost = int(np.sum(~np.isfinite(values)))
    if lost:
        raise StudyError(
            f"{lost} of {values.size} points have no response: shapes that cannot be, or that the "
            f"model does not cover. Narrow the levels, or ask at a lower pressure."
        )
    if np.ptp(values) == 0:
        raise StudyError("the response is the same at all points: no factor acts on it.")
    return values
