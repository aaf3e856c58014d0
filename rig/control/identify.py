"""Linear models from plunger volume to measured pressure, fitted to recorded excitations.

The model is a sum of first-order responses to the delayed plunger position behind a backlash,

    p(t) = p0 + d t + (k + sum_i c_i / (T_i s + 1)) x(t - delay),   x = play_w(plunger),

an output-error model: gas warms and cools (T about 0.3 s), the elastomer creeps (seconds), the
shape lags (tens of milliseconds); the drift d is a leak. k, c_i, p0 and d are linear parameters and
are eliminated by variable projection (Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973). The number
of terms is the one with the least Bayesian information criterion (Schwarz 1978).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.control.errors import ControlError

Array = NDArray[np.float64]

MOST_TERMS = 3
SHORTEST_S, LONGEST_S = 0.004, 30.0
"""Bounds of time constants: shorter looks like delay, longer like drift."""
LONGEST_DELAY_S = 0.05
WHITENESS_LAGS = 20
REFINEMENT = 4
"""Points of the simulation's grid in one sample."""
STARTS_S = (0.3, 0.03, 5.0)
"""Where the time constants begin: heat, shape, creep."""
APART = 1.5
"""Time constants closer than this ratio are one: their difference is noise."""


@dataclass(frozen=True)
class Recording:
    """Plunger and pressure as the board reported them while an excitation ran; arrays (n,)."""

    time_s: Array
    plunger_ml: Array
    pressure_kpa: Array

    def __post_init__(self) -> None:
        size = self.time_s.size
        if size < 50 or self.plunger_ml.shape != (size,) or self.pressure_kpa.shape != (size,):
            raise ControlError(
                f"{size} samples are too few to identify anything, or times, volumes and pressures "
                "are not equally many; expected at least 50 of each. Look for gaps in the "
                "pressure telemetry."
            )
        if np.any(np.diff(self.time_s) <= 0):
            raise ControlError("the times of a recording must ascend.")
        if np.ptp(self.plunger_ml) <= 0:
            raise ControlError("the plunger did not move in this recording: nothing is excited.")


@dataclass(frozen=True)
class Parameter:
    """An estimate with its standard deviation, both in `unit`."""

    name: str
    value: float
    deviation: float
    unit: str


@dataclass(frozen=True)
class LevelModel:
    """The plant around one pressure: plunger volume in mL to measured pressure in kPa."""

    level_kpa: float
    """Mean pressure of the recording."""
    plunger_ml: float
    """Mean plunger position of the recording."""
    direct: float
    """k in kPa/mL: the response to a jump at once."""
    gains: tuple[float, ...]
    """c_i in kPa/mL."""
    times_s: tuple[float, ...]
    """T_i."""
    delay_s: float
    """From reported plunger position to reported pressure."""
    backlash_ml: float

    @property
    def static_gain(self) -> float:
        """kPa/mL after everything has come to rest."""
        return self.direct + sum(self.gains)

    def scaled(self, gain: float) -> LevelModel:
        """The same dynamics with another gain, as of a gas volume smaller by that factor."""
        return replace(self, direct=self.direct * gain, gains=tuple(c * gain for c in self.gains))

    def state_space(self) -> Any:
        """The rational part, without delay and backlash, as a `control.StateSpace`."""
        import control

        rates = 1 / np.array(self.times_s)
        inputs = np.ones((rates.size, 1))
        return control.ss(-np.diag(rates), inputs, [np.array(self.gains) * rates], self.direct)

    def response(self, omega: Array) -> NDArray[np.complex128]:
        """Frequency response at `omega` (n,) in rad/s, delay included; kPa/mL."""
        s = 1j * omega
        total = np.full(omega.shape, self.direct, dtype=np.complex128)
        for gain, time_s in zip(self.gains, self.times_s, strict=True):
            total += gain / (time_s * s + 1)
        return np.asarray(total * np.exp(-s * self.delay_s))


@dataclass(frozen=True)
class Fit:
    """A model with how well it describes the recording it came from."""

    model: LevelModel
    parameters: tuple[Parameter, ...]
    covariance: Array
    """Of `parameters`, (m, m)."""
    time_s: Array
    measured_kpa: Array
    simulated_kpa: Array
    residual_deviation_kpa: float
    fit_percent: float
    """100 (1 - |residual| / |pressure - mean|), Ljung's measure of fit (1 - NRMSE)."""
    whiteness_p: float
    """p-value of Ljung and Box over 20 lags; small: the residual is not white."""
    criterion: float
    """Bayesian information criterion."""
    alternatives: dict[int, float] = field(default_factory=dict)
    """Criterion of each number of terms that was tried."""

    @property
    def residual_kpa(self) -> Array:
        """Measured minus simulated, (n,)."""
        return self.measured_kpa - self.simulated_kpa


def play(position: Array, width: float) -> Array:
    """What follows `position` (n,) through a backlash of `width`; begins pushed inwards."""
    if width <= 0:
        return position
    follower = []
    at = float(position[0])
    for x in position.tolist():  # comparisons: min and max take twice the time of all the rest
        if at < x:
            at = x
        elif at > x + width:
            at = x + width
        follower.append(at)
    return np.array(follower)


def identify_level(
    recording: Recording, least_delay_s: float = 0.0, most_terms: int = MOST_TERMS
) -> Fit:
    """The model with as many terms as the recording supports.

    `least_delay_s` is what is known of the delay without any experiment. Raises ControlError if no
    model can be fitted.
    """
    fits = {terms: _fit(recording, terms, least_delay_s) for terms in range(most_terms + 1)}
    alternatives = {terms: fit.criterion for terms, fit in fits.items() if fit is not None}
    found = [fit for fit in fits.values() if fit is not None]
    if not found:
        raise ControlError("no linear model could be fitted to this recording.")
    best = min(found, key=lambda fit: fit.criterion)
    return replace(best, alternatives=alternatives)


@dataclass(frozen=True)
class _Problem:
    """A recording, its plunger on a fine uniform grid, and the regression that follows."""

    recording: Recording
    grid_s: float
    times: Array
    plunger: Array

    @classmethod
    def of(cls, recording: Recording) -> _Problem:
        from scipy.interpolate import CubicSpline

        grid_s = float(np.median(np.diff(recording.time_s))) / REFINEMENT
        span = recording.time_s[-1] - recording.time_s[0]
        times = recording.time_s[0] + grid_s * np.arange(math.ceil(span / grid_s) + 1)
        # the drive accelerates steadily, so between samples the plunger follows a curve
        plunger = CubicSpline(recording.time_s, recording.plunger_ml)(times)
        return cls(recording, grid_s, times, plunger)

    def regressors(self, times_s: Array, delay_s: float, backlash_ml: float) -> Array:
        """Columns 1, t, x(t - delay) and a lag of it for each time constant, (n, 3 + terms)."""
        from scipy.signal import cont2discrete, lfilter

        felt = play(self.plunger, backlash_ml)
        x = np.interp(self.times - delay_s, self.times, felt - felt[0])
        columns = [x]
        for time_s in times_s:
            numerator, denominator, _ = cont2discrete(
                ([1.0], [time_s, 1.0]), self.grid_s, method="foh"
            )
            columns.append(lfilter(numerator.ravel(), denominator, x))
        t = self.recording.time_s
        moved = [np.interp(t, self.times, column) for column in columns]
        return np.column_stack([np.ones_like(t), t - t.mean(), *moved])

    def solve(self, times_s: Array, delay_s: float, backlash_ml: float) -> tuple[Array, Array]:
        """Linear parameters and residual (n,) of the best model with these others."""
        regressors = self.regressors(times_s, delay_s, backlash_ml)
        solution, *_ = np.linalg.lstsq(regressors, self.recording.pressure_kpa, rcond=None)
        linear = np.asarray(solution, dtype=np.float64)
        return linear, self.recording.pressure_kpa - regressors @ linear


def _fit(recording: Recording, terms: int, least_delay_s: float) -> Fit | None:
    """The best model with `terms` lags; None if its time constants run into each other."""
    from scipy.optimize import least_squares

    problem = _Problem.of(recording)
    travel = float(np.ptp(recording.plunger_ml))
    low = [*[math.log(SHORTEST_S)] * terms, least_delay_s, 0.0]
    high = [*[math.log(LONGEST_S)] * terms, LONGEST_DELAY_S, 0.5 * travel]
    start = [*(math.log(t) for t in STARTS_S[:terms]), least_delay_s + 0.004, 0.02 * travel]
    scale = [*[1.0] * terms, 0.01, 0.02 * travel]

    def residual(nonlinear: Array) -> Array:
        return problem.solve(np.exp(nonlinear[:terms]), *nonlinear[terms:])[1]

    found = least_squares(
        residual, start, bounds=(low, high), x_scale=scale, diff_step=1e-4, method="trf"
    )
    times_s = np.exp(found.x[:terms])
    if terms > 1 and np.min(np.diff(np.log(np.sort(times_s)))) < math.log(APART):
        return None
    return _described(problem, times_s, float(found.x[-2]), float(found.x[-1]))


def _described(problem: _Problem, times_s: Array, delay_s: float, backlash_ml: float) -> Fit:
    recording = problem.recording
    order = np.argsort(times_s)[::-1]
    times_s = times_s[order]
    linear, residual = problem.solve(times_s, delay_s, backlash_ml)
    values = np.concatenate([linear, times_s, [delay_s, backlash_ml]])
    count, n = values.size, residual.size
    variance = float(residual @ residual) / (n - count)
    jacobian = _jacobian(problem, values, times_s.size)
    covariance = np.asarray(variance * np.linalg.pinv(jacobian.T @ jacobian), dtype=np.float64)
    criterion = n * math.log(float(residual @ residual) / n) + count * math.log(n)
    model = LevelModel(
        level_kpa=float(recording.pressure_kpa.mean()),
        plunger_ml=float(recording.plunger_ml.mean()),
        direct=float(linear[2]),
        gains=tuple(float(c) for c in linear[3:]),
        times_s=tuple(float(t) for t in times_s),
        delay_s=delay_s,
        backlash_ml=backlash_ml,
    )
    terms = range(1, times_s.size + 1)
    names = [
        ("offset", "kPa"),
        ("drift", "kPa/s"),
        ("direct gain", "kPa/mL"),
        *((f"gain {i}", "kPa/mL") for i in terms),
        *((f"time constant {i}", "s") for i in terms),
        ("delay", "s"),
        ("backlash", "mL"),
    ]
    deviations = np.sqrt(np.diag(covariance))
    return Fit(
        model=model,
        parameters=tuple(
            Parameter(name, float(value), float(deviation), unit)
            for (name, unit), value, deviation in zip(names, values, deviations, strict=True)
        ),
        covariance=covariance,
        time_s=recording.time_s,
        measured_kpa=recording.pressure_kpa,
        simulated_kpa=recording.pressure_kpa - residual,
        residual_deviation_kpa=math.sqrt(variance),
        fit_percent=fit_percent(residual, recording.pressure_kpa),
        whiteness_p=whiteness(residual),
        criterion=criterion,
    )


def _jacobian(problem: _Problem, values: Array, terms: int) -> Array:
    """Of the simulated pressure with respect to all parameters, (n, m)."""
    linear, nonlinear = values[: 3 + terms], values[3 + terms :]

    def simulated(changed: Array) -> Array:
        return problem.regressors(changed[:terms], *changed[terms:]) @ linear

    columns = [problem.regressors(nonlinear[:terms], *nonlinear[terms:])]
    for index in range(nonlinear.size):
        width = 1e-3 * max(abs(nonlinear[index]), 1e-3)
        up, down = nonlinear.copy(), nonlinear.copy()
        up[index] += width
        down[index] -= width
        columns.append(((simulated(up) - simulated(down)) / (2 * width))[:, None])
    return np.hstack(columns)


def fit_percent(residual: Array, measured: Array) -> float:
    """100 (1 - |residual| / |measured - mean|) of arrays (n,); Ljung, System Identification."""
    about = measured - measured.mean()
    return float(100 * (1 - np.linalg.norm(residual) / np.linalg.norm(about)))


def whiteness(residual: Array, lags: int = WHITENESS_LAGS) -> float:
    """p-value that a residual (n,) is white: Ljung and Box, Biometrika 65 (1978).

    No degrees of freedom are taken off: what was fitted is the dynamics, not the noise.
    """
    from statsmodels.stats.diagnostic import acorr_ljungbox

    return float(acorr_ljungbox(residual, lags=[lags])["lb_pvalue"].iloc[0])


def predict(fit: Fit, recording: Recording) -> Array:
    """Pressure (n,) that a model foretells for another recording at its level.

    Offset and drift are of the recording itself, by least squares: they are not dynamics.
    """
    model = fit.model
    problem = _Problem.of(recording)
    regressors = problem.regressors(np.array(model.times_s), model.delay_s, model.backlash_ml)
    dynamic = regressors[:, 2:] @ np.array([model.direct, *model.gains])
    trend, *_ = np.linalg.lstsq(regressors[:, :2], recording.pressure_kpa - dynamic, rcond=None)
    return np.asarray(dynamic + regressors[:, :2] @ trend)
