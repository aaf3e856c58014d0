"""How well repetitions of the same thing agree, and whether a simulation foretells an experiment.

Intraclass correlation after McGraw and Wong (Psychol. Methods 1 (1996) 30), two-way random effects,
absolute agreement of single ratings, ICC(A,1) = ICC(2,1) of Shrout and Fleiss; ordinary least
squares of the experiment on the simulation. Both as Guo et al. (Biocybern. Biomed. Eng. 40 (2020)
1359) use them, on tables of numbers: simulated or recorded alike.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.validate.errors import ValidateError

Array = NDArray[np.float64]
_AGREEMENT = "ICC(A,1)"


@dataclass(frozen=True)
class Intraclass:
    """Agreement of single ratings: 1 where all raters say the same of every target."""

    coefficient: float
    low: float
    """Of the 95 % interval, which the library gives to two digits."""
    high: float
    p_value: float
    """Of no difference between the targets at all."""


@dataclass(frozen=True)
class Regression:
    """experiment = intercept + slope * simulation, by ordinary least squares."""

    slope: float
    intercept: float
    """In the experiment's unit."""
    correlation: float
    """Pearson's r."""
    p_value: float
    """Of a slope of zero."""
    slope_interval: tuple[float, float]
    """95 % interval of the slope: does it hold 1?"""


def intraclass_correlation(ratings: ArrayLike) -> Intraclass:
    """Agreement of raters (m) about targets (n), from their ratings (n, m) in one unit.

    Raises ValidateError for fewer than five targets (the library's least) or two raters, numbers
    that are not finite, targets that do not differ, and where `pingouin` is not installed.
    """
    table = np.asarray(ratings, dtype=float)
    if table.ndim != 2 or table.shape[0] < 5 or table.shape[1] < 2:
        raise ValidateError(
            f"agreement needs a table of at least five targets by two raters, not one of shape "
            f"{table.shape}; put what is rated into rows and who rates it into columns."
        )
    _finite(table)
    if np.ptp(table.mean(axis=1)) == 0:
        raise ValidateError(
            "all targets are rated the same on average: there is nothing to agree about. Choose "
            "targets that differ."
        )
    target, rater = np.indices(table.shape)
    import pandas as pd

    rows = pd.DataFrame({"target": target.ravel(), "rater": rater.ravel(), "rating": table.ravel()})
    found = pingouin().intraclass_corr(rows, "target", "rater", "rating").set_index("Type")
    row = found.loc[_AGREEMENT]
    low, high = row["CI95"]
    return Intraclass(float(row["ICC"]), float(low), float(high), float(row["pval"]))


def regression(simulation: ArrayLike, experiment: ArrayLike) -> Regression:
    """The experiment (n,) as a line of the simulation (n,) at the same points.

    Raises ValidateError for fewer than three points, numbers that are not finite and a simulation
    that does not vary.
    """
    x, y = np.asarray(simulation, dtype=float), np.asarray(experiment, dtype=float)
    if x.ndim != 1 or x.shape != y.shape or x.size < 3:
        raise ValidateError(
            f"a regression needs two rows of equally many numbers, at least three, not shapes "
            f"{x.shape} and {y.shape}; interpolate one to the points of the other."
        )
    _finite(x, y)
    if np.ptp(x) == 0:
        raise ValidateError("the simulation does not vary: no line can be drawn through it.")
    from scipy import stats

    fit = stats.linregress(x, y)
    half = float(stats.t.ppf(0.975, x.size - 2) * fit.stderr)
    varies = np.ptp(y) > 0
    return Regression(
        slope=float(fit.slope),
        intercept=float(fit.intercept),
        correlation=float(fit.rvalue) if varies else 0.0,
        p_value=float(fit.pvalue) if varies else 1.0,
        slope_interval=(float(fit.slope) - half, float(fit.slope) + half),
    )


def _finite(*tables: Array) -> None:
    if not all(np.all(np.isfinite(table)) for table in tables):
        raise ValidateError("expected finite numbers; leave out points that were not measured.")


def pingouin() -> Any:
    """The library of intraclass correlation; raises ValidateError where it is not installed."""
    try:
        return importlib.import_module("pingouin")
    except ImportError as error:
        raise ValidateError(
            "Intraclass correlation needs the library pingouin, which is not installed. Install "
            "it with `pip install pingouin`, or `pip install 'rig[agreement]'`."
        ) from error
