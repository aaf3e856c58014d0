"""What trials over time show: creep and recovery, softening over cycles, peaks of a pull. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LEAST_POINTS = 6


@dataclass(frozen=True)
class CreepFit:
    """The law that describes values over time best.

    One-term Prony series, y = final - change exp(-t / time), or power law,
    y = start + change t^exponent (Findley's; Ferry, Viscoelastic Properties of Polymers, 1980).
    """

    law: Literal["prony", "power"]
    parameters: dict[str, tuple[float, float]]
    """Value and standard uncertainty; times in s, levels in the unit of the values."""
    rms: float
    curve: Array
    """The law at the times that were fitted, (n,)."""


def fit_creep(time_s: Array, value: Array) -> CreepFit | None:
    """Fit both laws to `value` (n,) at times (n,) after the load; None for fewer than six points.

    Both have three parameters, so that the smaller residual decides as any information criterion.
    """
    if time_s.size < LEAST_POINTS:
        return None
    span = float(value[-1] - value[0]) or 1e-9
    middle = float(np.sqrt(time_s[0] * time_s[-1]))
    first, last = float(value[0]), float(value[-1])
    candidates = [
        _fit("prony", ("final", "change", "time"), time_s, value, (last, span, middle)),
        _fit("power", ("start", "change", "exponent"), time_s, value, (first - span, span, 0.2)),
    ]
    fits = [fit for fit in candidates if fit is not None]
    return min(fits, key=lambda fit: fit.rms, default=None)


def _prony(t: Array, final: float, change: float, time: float) -> Array:
    return np.asarray(final - change * np.exp(-t / time))


def _power(t: Array, start: float, change: float, exponent: float) -> Array:
    return np.asarray(start + change * t**exponent)


def _fit(
    law: Literal["prony", "power"],
    names: tuple[str, str, str],
    time_s: Array,
    value: Array,
    start: tuple[float, float, float],
) -> CreepFit | None:
    from scipy.optimize import curve_fit

    model = _prony if law == "prony" else _power
    low = (-np.inf, -np.inf, 1e-3)
    high = (np.inf, np.inf, np.inf if law == "prony" else 2.0)
    try:
        found, covariance = curve_fit(model, time_s, value, start, bounds=(low, high))
    except RuntimeError:  # it does not converge: this law does not describe the data
        return None
    curve = model(time_s, *found)
    u = np.sqrt(np.diag(covariance))
    parameters = {n: (float(v), float(s)) for n, v, s in zip(names, found, u, strict=True)}
    return CreepFit(law, parameters, float(np.sqrt(np.mean((value - curve) ** 2))), curve)


@dataclass(frozen=True)
class Trend:
    """Change over a decade of cycles, with its standard uncertainty."""

    per_decade: float
    u: float


def softening(cycles: Array, amplitude: Array) -> Trend | None:
    """Slope of amplitudes (n,) over log10 of cycle numbers (n,) from 1; None below three."""
    if cycles.size < 3:
        return None
    from scipy.stats import linregress

    line = linregress(np.log10(cycles), amplitude)
    return Trend(float(line.slope), float(line.stderr))


def cycle_extremes(time_s: Array, value: Array, starts: Array) -> tuple[Array, Array]:
    """Highest and lowest value within each cycle; `starts` (m + 1,) are the cycles' borders.

    A cycle without samples gives not a number.
    """
    high, low = np.full(starts.size - 1, math.nan), np.full(starts.size - 1, math.nan)
    for index, (begin, end) in enumerate(pairwise(starts)):
        inside = value[(time_s >= begin) & (time_s < end)]
        if inside.size:
            high[index], low[index] = inside.max(), inside.min()
    return high, low


@dataclass(frozen=True)
class Peak:
    """The highest peak of a trace that stands out from its saddles."""

    time_s: float
    value: float
    prominence: float


def highest_peak(time_s: Array, value: Array, prominence: float) -> Peak | None:
    """The highest interior peak with at least that prominence; None if there is none."""
    from scipy.signal import find_peaks

    found, properties = find_peaks(value, prominence=prominence)
    if found.size == 0:
        return None
    best = int(np.argmax(value[found]))
    index = int(found[best])
    return Peak(float(time_s[index]), float(value[index]), float(properties["prominences"][best]))
