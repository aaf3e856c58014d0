"""Stress relaxation as a Prony series, with a chosen number of terms or the number that pays.

At a strain that is held, stress(t) = s0 (1 - sum of g_i (1 - exp(-t / tau_i))), with g_i >= 0 and
their sum below 1; s0 is the stress of an instant step. Moduli relax by the same factor (Abaqus
Theory Guide, Section 4.8.1). Relaxation times are kept within the time that was recorded: the data
know nothing of others.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rig.fitting.errors import FittingError, TestDataError
from rig.fitting.specimen import FEWEST_POINTS, Array
from rig.fitting.tensile import read_table

MOST_TERMS = 6
_PER_TERM = 4
"""Points that a term needs at least: two unknowns, and as many to check them."""


@dataclass(frozen=True)
class Relaxation:
    """A relaxation test: time in s from the end of loading, ascending, and stress; (n,)."""

    time: Array
    stress: Array
    """In Pa, or any unit: only ratios matter."""
    source: str


@dataclass(frozen=True)
class PronyTerm:
    """One relaxation: the share of the stress that it takes away, and how fast."""

    weight: float
    weight_error: float | None
    time: float
    """In s."""
    time_error: float | None


@dataclass(frozen=True)
class PronyFit:
    """A series and how well it does."""

    terms: tuple[PronyTerm, ...]
    instant_stress: float
    """s0, in the unit of the data."""
    rmse: float
    """Root mean square of differences over s0."""
    bic: float

    @property
    def long_term(self) -> float:
        """Share of the stress that stays for ever."""
        return 1 - sum(term.weight for term in self.terms)

    def stress(self, time: Array) -> Array:
        """Stress at times in s, in the unit of the data."""
        lost = sum(
            (term.weight * -np.expm1(-time / term.time) for term in self.terms),
            start=np.zeros_like(time),
        )
        return np.asarray(self.instant_stress * (1 - lost))


def read_relaxation(path: Path) -> Relaxation:
    """The columns time and stress (or force) of a file; raises TestDataError."""
    table = read_table(path, ("time",), ("stress", "true stress", "force"))
    name = next(n for n in ("stress", "true stress", "force") if n in table.columns)
    time, stress = table.values("time"), table.values(name)
    if time.size < FEWEST_POINTS:
        raise TestDataError(
            f"{path}: {time.size} points are too few for a relaxation; expected {FEWEST_POINTS}."
        )
    back = np.flatnonzero(np.diff(time) <= 0)
    if back.size:
        raise TestDataError(
            f"{path}:{table.rows[int(back[0]) + 1][0]}: the time does not go on; expected it to "
            f"ascend from row to row."
        )
    if stress[0] <= 0:
        raise TestDataError(
            f"{path}:{table.rows[0][0]}: the relaxation begins with a stress of {stress[0]:.4g}; "
            f"expected the loaded specimen, so a stress above 0."
        )
    return Relaxation(time - time[0], stress, path.name)


def fit_prony(relaxation: Relaxation, terms: int | None = None) -> PronyFit:
    """The series of `terms` terms, or of the number with the least BIC up to six.

    Raises FittingError for a number that the data cannot determine.
    """
    possible = min(MOST_TERMS, (relaxation.time.size - 1) // _PER_TERM)
    if terms is not None:
        if not 1 <= terms <= possible:
            raise FittingError(
                f"{relaxation.source}: {terms} terms cannot be fitted; expected 1 to {possible} "
                f"with {relaxation.time.size} points."
            )
        return _fitted(relaxation, terms)
    fits = [_fitted(relaxation, count) for count in range(1, possible + 1)]
    return min(fits, key=lambda one: one.bic)


def _fitted(relaxation: Relaxation, count: int) -> PronyFit:
    """Bounded least squares, begun with times that are evenly spread over the decades."""
    import lmfit

    time = relaxation.time
    scale = float(relaxation.stress[0])
    data = relaxation.stress / scale
    shortest, longest = float(np.min(np.diff(time))) / 2, float(time[-1])
    times = np.geomspace(shortest, longest, count + 2)[1:-1]
    columns = np.column_stack([np.ones_like(time), *(np.exp(-time / tau) for tau in times)])
    from scipy.optimize import nnls

    stays, *fades = nnls(columns, data)[0].tolist()
    parameters = lmfit.Parameters()
    parameters.add("stays", value=max(stays, 1e-6), min=0.0)
    for i, (tau, fade) in enumerate(zip(times, fades, strict=True)):
        parameters.add(f"fade_{i}", value=max(fade, 1e-4), min=0.0)
        parameters.add(f"log_{i}", value=np.log(tau), min=np.log(shortest), max=np.log(longest))

    def model(p: Any) -> Array:
        total = np.full_like(time, p["stays"].value)
        for i in range(count):
            total += p[f"fade_{i}"].value * np.exp(-time / np.exp(p[f"log_{i}"].value))
        return total

    with np.errstate(invalid="ignore"):  # of variances below zero: they are no errors, see below
        found = lmfit.minimize(
            lambda p: model(p) - data, parameters, method="least_squares", max_nfev=2000
        )
    p = found.params
    instant = p["stays"].value + sum(p[f"fade_{i}"].value for i in range(count))
    terms = sorted(
        (
            PronyTerm(
                weight=p[f"fade_{i}"].value / instant,
                weight_error=_finite(p[f"fade_{i}"].stderr, 1 / instant),
                time=float(np.exp(p[f"log_{i}"].value)),
                time_error=_finite(p[f"log_{i}"].stderr, float(np.exp(p[f"log_{i}"].value))),
            )
            for i in range(count)
        ),
        key=lambda term: term.time,
    )
    difference = model(p) - data
    chi2 = max(float(difference @ difference), np.finfo(float).tiny)
    n = time.size
    return PronyFit(
        terms=tuple(terms),
        instant_stress=scale * instant,
        rmse=float(np.sqrt(chi2 / n)) / instant,
        bic=n * float(np.log(chi2 / n)) + (2 * count + 1) * float(np.log(n)),
    )


def _finite(error: float | None, factor: float) -> float | None:
    """A standard error in the unit of its quantity; None where the data do not determine it."""
    return None if error is None or not np.isfinite(error) else error * factor
