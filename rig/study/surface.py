"""Response surfaces: least squares of a polynomial in coded factors, with what it is worth.

Adjusted sums of squares are those of each term given all others (type III in coded factors), which
for one degree of freedom is t^2 times the residual mean square. Predicted R2 is from PRESS,
adequate precision is the range of fitted values over their mean standard error, sqrt(p s^2 / n),
both as Design-Expert defines them (Myers, Montgomery and Anderson-Cook, Response Surface
Methodology, 4th ed., sections 2.6 and 2.7).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.study.errors import StudyError
from rig.study.extras import package
from rig.study.factors import (
    Array,
    Factor,
    Term,
    coded,
    model_matrix,
    quadratic_terms,
    require_estimable,
    term_name,
)

NO_PURE_ERROR = (
    "All replicates are identical, as those of a deterministic simulation are: there is no pure "
    "error, so lack of fit cannot be tested. F and p compare terms with what the polynomial "
    "misses, not with noise."
)
NO_REPLICATES = "No run was repeated: lack of fit cannot be told from noise."
_SAME = 1e-9
"""Of the range of responses: replicates closer than that are identical."""


@dataclass(frozen=True)
class Source:
    """One row of the analysis of variance; F and p are None where there is nothing to test."""

    name: str
    dof: int
    sum_of_squares: float
    f: float | None = None
    p: float | None = None

    @property
    def mean_square(self) -> float | None:
        """Sum of squares over degrees of freedom; None without any."""
        return self.sum_of_squares / self.dof if self.dof else None


@dataclass(frozen=True)
class Diagnostics:
    """Residuals of the runs, arrays (n,)."""

    fitted: Array
    residual: Array
    studentised: Array
    """Externally studentised residuals; not a number at leverage 1."""
    normality: float | None
    """p of the Shapiro-Wilk test; small where residuals are not normal. None of fewer than four
    residuals that differ."""

    @property
    def outlying(self) -> tuple[int, ...]:
        """Runs, from 0, whose studentised residual is beyond 4 in size."""
        return tuple(int(i) for i in np.flatnonzero(np.abs(self.studentised) > 4))


@dataclass(frozen=True)
class Surface:
    """A fitted polynomial; coefficients are those of coded factors."""

    response: str
    factors: tuple[Factor, ...]
    terms: tuple[Term, ...]
    coefficients: Array
    """(p,)."""
    covariance: Array
    """(p, p), from the residual mean square."""
    sources: tuple[Source, ...]
    r2: float
    r2_adjusted: float
    r2_predicted: float
    adequate_precision: float
    coefficient_of_variation: float
    """Residual standard deviation over the mean response."""
    residual_variance: float
    residual_dof: int
    remark: str
    """What must be known of the error to read F and p; empty where there is pure error."""
    diagnostics: Diagnostics

    def source(self, name: str) -> Source:
        """The row of the analysis of variance of this name; raises StudyError."""
        for one in self.sources:
            if one.name == name:
                return one
        raise StudyError(f"no such source of variance: {name}")

    def predict(self, points: Array) -> Array:
        """Expected response at coded points (m, k), (m,)."""
        return np.asarray(model_matrix(np.atleast_2d(points), self.terms) @ self.coefficients)

    def standard_error(self, points: Array) -> Array:
        """Of the expected response at coded points (m, k), (m,)."""
        x = model_matrix(np.atleast_2d(points), self.terms)
        return np.asarray(np.sqrt(np.einsum("mp,pq,mq->m", x, self.covariance, x)))

    def prediction_interval(self, point: Array, level: float = 0.95) -> tuple[float, float]:
        """Interval for one more run at a coded point (k,)."""
        from scipy.stats import t

        middle = float(self.predict(point)[0])
        spread = np.sqrt(self.residual_variance + float(self.standard_error(point)[0]) ** 2)
        reach = float(t.ppf((1 + level) / 2, self.residual_dof)) * float(spread)
        return middle - reach, middle + reach

    def quadratic_form(self) -> tuple[float, Array, Array]:
        """Constant b0, vector b (k,) and symmetric matrix B (k, k) of b0 + b.x + x.B.x."""
        k = len(self.factors)
        constant, linear, matrix = 0.0, np.zeros(k), np.zeros((k, k))
        for term, value in zip(self.terms, self.coefficients.tolist(), strict=True):
            if not term:
                constant = value
            elif len(term) == 1:
                linear[term[0]] = value
            else:
                i, j = term
                matrix[i, j] += value / 2
                matrix[j, i] += value / 2
        return constant, linear, matrix

    def actual_coefficients(self) -> dict[str, float]:
        """Term to coefficient of the same polynomial in the factors' own units."""
        constant, linear, matrix = self.quadratic_form()
        centre, half = np.array([[f.centre, f.half] for f in self.factors]).T
        scaled = matrix / np.outer(half, half)
        slope = linear / half - 2 * scaled @ centre
        result = {}
        for term in self.terms:
            name = term_name(term, self.factors)
            if not term:
                result[name] = float(constant - (linear / half) @ centre + centre @ scaled @ centre)
            elif len(term) == 1:
                result[name] = float(slope[term[0]])
            else:
                i, j = term
                result[name] = float(scaled[i, j] * (1 if i == j else 2))
        return result


def fit_surface(
    response: str,
    factors: Sequence[Factor],
    points: Array,
    values: Array,
    terms: Sequence[Term] | None = None,
) -> Surface:
    """The surface through `values` (n,) at `points` (n, k) in the factors' units.

    The model is the full quadratic unless `terms` says otherwise. Raises StudyError where runs are
    too few or alias terms, and where values are not finite or all the same.
    """
    sm = package("statsmodels.api", "study")
    influence_of = package("statsmodels.stats.outliers_influence", "study").OLSInfluence
    _check(response, values)
    x = coded(factors, np.asarray(points, dtype=float))
    terms = tuple(terms or quadratic_terms(len(factors)))
    matrix = model_matrix(x, terms)
    names = [term_name(term, factors) for term in terms]
    require_estimable(matrix, names)
    fitted = sm.OLS(values, matrix, hasconst=True).fit()
    influence = influence_of(fitted)
    n, p = matrix.shape
    variance = float(fitted.mse_resid)
    predictions = np.asarray(fitted.fittedvalues)
    with np.errstate(divide="ignore", invalid="ignore"):
        press = float(np.sum((fitted.resid / (1 - influence.hat_matrix_diag)) ** 2))
        studentised = np.asarray(influence.resid_studentized_external)
    precision = float(np.ptp(predictions)) / np.sqrt(p * variance / n) if variance else np.inf
    error_rows, remark = _error_sources(x, values, fitted)
    return Surface(
        response=response,
        factors=tuple(factors),
        terms=terms,
        coefficients=np.asarray(fitted.params),
        covariance=np.asarray(fitted.cov_params()),
        sources=(
            Source("Model", p - 1, float(fitted.ess), float(fitted.fvalue), float(fitted.f_pvalue)),
            *(
                Source(name, 1, float(t) ** 2 * variance, float(t) ** 2, float(significance))
                for name, t, significance in zip(names, fitted.tvalues, fitted.pvalues, strict=True)
                if name != "constant"
            ),
            Source("Error", n - p, float(fitted.ssr)),
            *error_rows,
            Source("Total", n - 1, float(fitted.centered_tss)),
        ),
        r2=float(fitted.rsquared),
        r2_adjusted=float(fitted.rsquared_adj),
        r2_predicted=1 - press / float(fitted.centered_tss),
        adequate_precision=float(precision),
        coefficient_of_variation=float(np.sqrt(variance) / abs(np.mean(values))),
        residual_variance=variance,
        residual_dof=n - p,
        remark=remark,
        diagnostics=Diagnostics(
            fitted=predictions,
            residual=np.asarray(fitted.resid),
            studentised=studentised,
            normality=_normality(np.asarray(fitted.resid)),
        ),
    )


def _check(response: str, values: Array) -> None:
    if not values.size:
        raise StudyError(f"response '{response}': no run has a value.")
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise StudyError(
            f"response '{response}': run {wrong[0] + 1} has no value; compute it, or leave the run "
            f"out of the table."
        )
    if np.ptp(values) == 0:
        raise StudyError(
            f"response '{response}' is {values[0]:g} in all runs: no factor acts on it."
        )


def _error_sources(x: Array, values: Array, fitted: object) -> tuple[tuple[Source, ...], str]:
    """Lack of fit and pure error, where repeated runs differ; and what else is to be said."""
    from scipy.stats import f as f_distribution

    _, group = np.unique(np.round(x, 9), axis=0, return_inverse=True)
    group = group.ravel()
    means = np.bincount(group, values) / np.bincount(group)
    pure_dof = values.size - means.size
    if pure_dof == 0:
        return (), NO_REPLICATES
    inner = values - means[group]
    if np.max(np.abs(inner)) <= _SAME * np.ptp(values):
        return (), NO_PURE_ERROR
    pure = float(inner @ inner)
    lack = float(fitted.ssr) - pure  # type: ignore[attr-defined]
    lack_dof = int(fitted.df_resid) - pure_dof  # type: ignore[attr-defined]
    if lack_dof <= 0:
        return (Source("Pure error", pure_dof, pure),), "No degrees of freedom for lack of fit."
    ratio = (lack / lack_dof) / (pure / pure_dof)
    return (
        Source(
            "Lack of fit",
            lack_dof,
            lack,
            ratio,
            float(f_distribution.sf(ratio, lack_dof, pure_dof)),
        ),
        Source("Pure error", pure_dof, pure),
    ), ""


def _normality(residual: Array) -> float | None:
    from scipy.stats import shapiro

    if residual.size < 4 or np.ptp(residual) == 0:
        return None
    return float(shapiro(residual).pvalue)
