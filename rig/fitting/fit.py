"""One energy fitted to specimens of any modes at once: least squares, several starts, uncertainty.

Standard errors are those of least squares with independent residuals of one variance. Residuals of
a smooth model on a smooth curve are not independent, so they are a lower bound; the scatter from
specimen to specimen, `rig.fitting.validation`, is the other half of the story.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from rig.fitting.errors import FittingError
from rig.fitting.families import Family, Values
from rig.fitting.specimen import Array, Specimen
from rig.fitting.stable import stable_least_squares
from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic import Energy, Mode, check_stability

_CANDIDATES = 128
"""Sets of shape parameters that are tried, before the best of them are polished."""
_LEAST_WEIGHED = 0.05
"""Of the largest stress: relative residuals below it are taken relative to it."""


class Weighting(StrEnum):
    """What a residual counts."""

    ABSOLUTE = "absolute"
    RELATIVE = "relative"


@dataclass(frozen=True)
class Settings:
    """How to fit."""

    weighting: Weighting = Weighting.ABSOLUTE
    starts: int = 3
    """Starting points that are polished, of energies with exponents or a locking stretch."""
    seed: int = 0
    stable_to: float | None = None
    """Stretch up to which, and down to whose inverse, the energy must be stable; None: the
    longest in the data."""


@dataclass(frozen=True)
class Coefficient:
    """A fitted coefficient, in Pa or a plain number."""

    name: str
    value: float
    standard_error: float | None
    """None where the data do not determine it."""
    is_modulus: bool


@dataclass(frozen=True)
class EnergyFit:
    """One energy's best coefficients and how well they do."""

    family: Family
    coefficients: tuple[Coefficient, ...]
    correlation: Array | None
    """(k, k) in the order of the coefficients."""
    rmse: float
    """Root mean square of stress differences in Pa."""
    relative_rmse: float
    """Root mean square of differences over the stress, or over 5 % of the largest, if more."""
    points: int
    aic: float
    """Akaike's criterion, n ln(chi2 / n) + 2 k."""
    bic: float
    """Bayes' criterion, n ln(chi2 / n) + k ln n."""
    stable_to: float
    """The stretch of the settings."""
    stable: bool
    """Whether stability holds in all three modes, checked more densely than it was asked for."""
    held: bool
    """Whether a condition of stability is active: the data alone would have chosen otherwise."""

    @property
    def stability(self) -> str:
        """What the check of Drucker's stability came to, in words."""
        found = "stable" if self.stable else "not stable everywhere"
        return f"{found} (Drucker) to a stretch of {self.stable_to:.4g}"

    @property
    def values(self) -> dict[str, float]:
        """Coefficient to value."""
        return {c.name: c.value for c in self.coefficients}

    def secant_modulus(self, strain: float) -> float:
        """Nominal stress over engineering strain in uniaxial tension, in Pa."""
        stress = self.family.stress(self.values, Mode.UNIAXIAL, np.array([1 + strain]))
        return float(stress[0]) / strain

    @property
    def energy(self) -> Energy:
        """The energy with these coefficients."""
        return self.family.build(self.values)


@dataclass(frozen=True)
class _Problem:
    """Residuals of one family: data and weights (n,), in the order of the specimens."""

    family: Family
    specimens: tuple[Specimen, ...]
    data: Array
    weight: Array

    @classmethod
    def of(cls, family: Family, specimens: Sequence[Specimen], weighting: Weighting) -> _Problem:
        data = np.concatenate([s.stress for s in specimens])
        largest = float(np.max(np.abs(data)))
        if largest == 0:
            raise FittingError("all stresses are zero; is the unit of the stress right?")
        weight = np.full(data.size, 1 / largest)
        if weighting is Weighting.RELATIVE:
            weight = 1 / np.maximum(np.abs(data), _LEAST_WEIGHED * largest)
        return cls(family, tuple(specimens), data, weight)

    @property
    def scale(self) -> float:
        """A modulus of the size of the data's, in Pa, so that unknowns are near one."""
        elongation = max(float(np.max(np.abs(s.stretch - 1))) for s in self.specimens)
        return float(np.max(np.abs(self.data))) / elongation

    def stress(self, values: Values) -> Array:
        """(n,) in Pa; one evaluation a mode."""
        result = np.empty_like(self.data)
        ends = np.cumsum([s.stretch.size for s in self.specimens])
        for mode in Mode:
            places = [
                (end - s.stretch.size, end, s)
                for end, s in zip(ends, self.specimens, strict=True)
                if s.mode is mode
            ]
            if not places:
                continue
            together = self.family.stress(
                values, mode, np.concatenate([s.stretch for _, _, s in places])
            )
            at = 0
            for start, end, s in places:
                result[start:end] = together[at : at + s.stretch.size]
                at += s.stretch.size
        return result

    def columns(self, shapes: Values) -> Array:
        """Weighted stresses of unit moduli at chosen shapes, (n, k)."""
        moduli = self.family.moduli
        return np.column_stack(
            [
                self.weight * self.stress({**dict.fromkeys(moduli, 0.0), name: 1.0, **shapes})
                for name in moduli
            ]
        )

    def residual(self, values: Values) -> Array:
        """Weighted model minus data, (n,)."""
        return self.weight * (self.stress(values) - self.data)


def fit(
    family: Family,
    specimens: Sequence[Specimen],
    settings: Settings | None = None,
    start: Values | None = None,
) -> EnergyFit:
    """The family's coefficients of least squared residuals over all points of all specimens.

    `start` is a set of values to begin from instead of several of our own. Raises FittingError
    where there are too few points or they cannot tell the coefficients apart, and MechanicsError
    where the energy has no response at some stretch.
    """
    settings = settings or Settings()
    problem = _Problem.of(family, specimens, settings.weighting)
    unknowns = len(family.coefficients)
    if problem.data.size <= unknowns:
        raise FittingError(
            f"{family.name}: {problem.data.size} points cannot determine {unknowns} coefficients; "
            f"expected more points than coefficients."
        )
    longest = settings.stable_to
    if longest is None:
        longest = max(float(np.max(s.stretch)) for s in specimens)
    shortest = min(float(np.min(s.stretch)) for s in specimens)
    highest = max(longest, 1 / shortest, 1 + 1e-6)
    if family.positive:
        values, covariance, held = _with_positive_moduli(problem, settings, start)
    else:
        weighted = problem.weight * problem.data
        columns = problem.columns({})
        found = stable_least_squares(family, columns, weighted, 1 / highest, highest)
        left = columns @ found.moduli - weighted
        variance = float(left @ left) / (weighted.size - unknowns)
        values = dict(zip(family.moduli, found.moduli.tolist(), strict=True))
        covariance = None if found.covariance is None else variance * found.covariance
        held = found.held
    return _judged(problem, values, covariance, held, highest)


def _with_positive_moduli(
    problem: _Problem, settings: Settings, start: Values | None
) -> tuple[dict[str, float], Array | None, bool]:
    """Bounded least squares by lmfit from several starts; moduli are never negative."""
    import lmfit

    family, scale = problem.family, problem.scale
    names = family.coefficients
    units = {name: scale if name in family.moduli else 1.0 for name in names}

    def residual(parameters: Any) -> Array:
        return problem.residual({name: parameters[name].value * units[name] for name in names})

    best: Any = None
    for first in [start] if start is not None else _starts(problem, settings):
        parameters = lmfit.Parameters()
        for name in family.moduli:
            parameters.add(name, value=max(first[name] / scale, 1e-9), min=0.0)
        for shape in family.shapes:
            inside = float(np.clip(first[shape.name], shape.low + 1e-6, shape.high - 1e-6))
            parameters.add(shape.name, value=inside, min=shape.low, max=shape.high)
        with np.errstate(invalid="ignore"):  # of variances below zero, which are none: see below
            found = lmfit.minimize(
                residual, parameters, method="least_squares", x_scale="jac", max_nfev=400
            )
        if best is None or found.chisqr < best.chisqr:
            best = found
    values = {name: float(best.params[name].value) * units[name] for name in names}
    factors = np.array([units[name] for name in names])
    covariance = getattr(best, "covar", None)
    if covariance is not None and not (
        np.all(np.isfinite(covariance)) and np.all(np.diag(covariance) > 0)
    ):
        covariance = None
    held = any(values[name] < 1e-6 * scale for name in family.moduli)
    if covariance is not None:
        covariance = covariance * np.outer(factors, factors)
    return values, covariance, held


def _starts(problem: _Problem, settings: Settings) -> list[dict[str, float]]:
    """The best of many shapes, each with the best moduli for it (non-negative least squares)."""
    from scipy.optimize import nnls
    from scipy.stats import qmc

    family = problem.family
    weighted = problem.weight * problem.data
    if not family.shapes:
        moduli, _ = nnls(problem.columns({}), weighted)
        return [dict(zip(family.moduli, moduli.tolist(), strict=True))]
    sampler = qmc.Sobol(len(family.shapes), seed=settings.seed)
    unit = sampler.random(_CANDIDATES)
    tried = []
    for row in unit:
        shapes = {
            shape.name: shape.low + (shape.high - shape.low) * float(u)
            for shape, u in zip(family.shapes, row, strict=True)
        }
        columns = problem.columns(shapes)
        if not np.all(np.isfinite(columns)):
            continue
        size = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
        scaled, misfit = nnls(columns / size, weighted)
        moduli = scaled / size
        tried.append((misfit, {**dict(zip(family.moduli, moduli.tolist(), strict=True)), **shapes}))
    tried.sort(key=lambda pair: pair[0])
    return [values for _, values in tried[: settings.starts]]


def _judged(
    problem: _Problem,
    values: dict[str, float],
    covariance: Array | None,
    held: bool,
    highest: float,
) -> EnergyFit:
    family = problem.family
    difference = problem.stress(values) - problem.data
    n, k = difference.size, len(values)
    chi2 = max(float(np.sum((problem.weight * difference) ** 2)), np.finfo(float).tiny)
    floor = _LEAST_WEIGHED * float(np.max(np.abs(problem.data)))
    errors = [None] * k if covariance is None else np.sqrt(np.diag(covariance)).tolist()
    correlation = None
    if covariance is not None:
        spread = np.maximum(np.sqrt(np.diag(covariance)), np.finfo(float).tiny)
        correlation = covariance / np.outer(spread, spread)
    coefficients = tuple(
        Coefficient(name, values[name], error, name in family.moduli)
        for name, error in zip(family.coefficients, errors, strict=True)
    )
    try:
        stable = check_stability(family.build(values), 1 / highest, highest).stable
    except MechanicsError:
        stable = False
    return EnergyFit(
        family=family,
        coefficients=coefficients,
        correlation=correlation,
        rmse=float(np.sqrt(np.mean(difference**2))),
        relative_rmse=float(
            np.sqrt(np.mean((difference / np.maximum(np.abs(problem.data), floor)) ** 2))
        ),
        points=n,
        aic=n * float(np.log(chi2 / n)) + 2 * k,
        bic=n * float(np.log(chi2 / n)) + k * float(np.log(n)),
        stable_to=highest,
        stable=stable,
        held=held,
    )
