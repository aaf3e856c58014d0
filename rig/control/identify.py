"""Linear models from plunger volume to measured pressure, fitted to recorded excitations.

The model is a sum of first-order responses to the delayed plunger position behind a backlash,

    p(t) = p0 + d t + (k + sum_i c_i / (T_i s + 1) + sum_j m_j / (s^2/w_j^2 + 2 z_j s/w_j + 1))
           x(t - delay),                                            x = play_w(plunger),

an output-error model: gas warms and cools (T about 0.3 s), the elastomer creeps (seconds), the
shape lags (tens of milliseconds); a liquid's mass in the tube swings between the cushion of air
and the actuator (one mode); the drift d is a leak. k, c_i, m_j, p0 and d are linear parameters and
are eliminated by variable projection (Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973). The number
of terms is the one with the least Bayesian information criterion (Schwarz 1978).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

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
SLOWEST_MODE, FASTEST_MODE = 5.0, 150.0
"""rad/s; bounds of a mode's frequency: the telemetry is every 20 ms."""
MODE_START = (30.0, 0.1)
"""Frequency in rad/s and damping ratio with which the search for a mode begins."""
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


class Mode(NamedTuple):
    """A swing: gain / (s^2/w^2 + 2 z s/w + 1)."""

    gain: float
    """kPa/mL."""
    frequency: float
    """w in rad/s."""
    damping: float
    """z, of critical damping."""


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
    modes: tuple[Mode, ...] = ()

    @property
    def static_gain(self) -> float:
        """kPa/mL after everything has come to rest."""
        return self.direct + sum(self.gains) + sum(mode.gain for mode in self.modes)

    def scaled(self, gain: float) -> LevelModel:
        """The same dynamics with another gain, as of a gas volume smaller by that factor."""
        return replace(
            self,
            direct=self.direct * gain,
            gains=tuple(c * gain for c in self.gains),
            modes=tuple(mode._replace(gain=mode.gain * gain) for mode in self.modes),
        )

    def state_space(self) -> Any:
        """The rational part, without delay and backlash, as a `control.StateSpace`."""
        import control

        rates = 1 / np.array(self.times_s)
        inputs = np.ones((rates.size, 1))
        system = control.ss(-np.diag(rates), inputs, [np.array(self.gains) * rates], self.direct)
        for mode in self.modes:
            w, z = mode.frequency, mode.damping
            a = [[0.0, w], [-w, -2 * z * w]]
            system = system + control.ss(a, [[0.0], [w]], [[mode.gain, 0.0]], 0.0)
        return system

    def response(self, omega: Array) -> NDArray[np.complex128]:
        """Frequency response at `omega` (n,) in rad/s, delay included; kPa/mL."""
        s = 1j * omega
        total = np.full(omega.shape, self.direct, dtype=np.complex128)
        for gain, time_s in zip(self.gains, self.times_s, strict=True):
            total += gain / (time_s * s + 1)
        for mode in self.modes:
            ratio = s / mode.frequency
            total += mode.gain / (ratio**2 + 2 * mode.damping * ratio + 1)
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


@dataclass(frozen=True)
class Shape:
    """What the nonlinear parameters are: log T of each lag, log w and log z of each mode, then
    delay and backlash."""

    lags: int
    modes: int = 0

    @property
    def linear(self) -> int:
        """How many parameters are linear: offset, drift, direct gain, and one for each term."""
        return 3 + self.lags + self.modes

    def poles(self, nonlinear: Array) -> tuple[Array, Array]:
        """Time constants (lags,) and pairs of frequency and damping (modes, 2)."""
        values = np.exp(nonlinear[: self.lags + 2 * self.modes])
        return values[: self.lags], values[self.lags :].reshape(self.modes, 2)


def identify_level(
    recording: Recording,
    least_delay_s: float = 0.0,
    most_terms: int = MOST_TERMS,
    modes: int = 0,
) -> Fit:
    """The model with as many lags as the recording supports, and `modes` modes.

    `least_delay_s` is what is known of the delay without any experiment. Raises ControlError if no
    model can be fitted.
    """
    fits = {
        terms: _fit(recording, Shape(terms, modes), least_delay_s)
        for terms in range(most_terms + 1)
    }
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

    def regressors(
        self, times_s: Array, swings: Array, delay_s: float, backlash_ml: float
    ) -> Array:
        """Columns 1, t, x(t - delay), and it through each lag (`times_s`) and each mode (`swings`,
        pairs of frequency and damping), (n, 3 + lags + modes)."""
        from scipy.signal import cont2discrete, lfilter

        felt = play(self.plunger, backlash_ml)
        x = np.interp(self.times - delay_s, self.times, felt - felt[0])
        columns = [x]
        polynomials = [[time_s, 1.0] for time_s in times_s]
        polynomials += [[1 / w**2, 2 * z / w, 1.0] for w, z in swings]
        for polynomial in polynomials:
            numerator, denominator, _ = cont2discrete(
                ([1.0], polynomial), self.grid_s, method="foh"
            )
            columns.append(lfilter(numerator.ravel(), denominator, x))
        t = self.recording.time_s
        moved = [np.interp(t, self.times, column) for column in columns]
        return np.column_stack([np.ones_like(t), t - t.mean(), *moved])

    def solve(self, shape: Shape, nonlinear: Array) -> tuple[Array, Array]:
        """Linear parameters and residual (n,) of the best model with these others."""
        regressors = self.regressors(*shape.poles(nonlinear), *nonlinear[-2:])
        solution, *_ = np.linalg.lstsq(regressors, self.recording.pressure_kpa, rcond=None)
        linear = np.asarray(solution, dtype=np.float64)
        return linear, self.recording.pressure_kpa - regressors @ linear


def _fit(recording: Recording, shape: Shape, least_delay_s: float) -> Fit | None:
    """The best model of this shape; None if its time constants run into each other."""
    from scipy.optimize import least_squares

    problem = _Problem.of(recording)
    travel = float(np.ptp(recording.plunger_ml))
    lags, modes = shape.lags, shape.modes
    low = [math.log(SHORTEST_S)] * lags + [math.log(SLOWEST_MODE), math.log(1e-3)] * modes
    high = [math.log(LONGEST_S)] * lags + [math.log(FASTEST_MODE), math.log(2.0)] * modes
    start = [math.log(t) for t in STARTS_S[:lags]] + [math.log(v) for v in MODE_START] * modes
    found = least_squares(
        lambda nonlinear: problem.solve(shape, nonlinear)[1],
        [*start, least_delay_s + 0.004, 0.02 * travel],
        bounds=([*low, least_delay_s, 0.0], [*high, LONGEST_DELAY_S, 0.5 * travel]),
        x_scale=[*[1.0] * len(start), 0.01, 0.02 * travel],
        diff_step=1e-4,
        method="trf",
    )
    times_s, _ = shape.poles(found.x)
    if lags > 1 and np.min(np.diff(np.log(np.sort(times_s)))) < math.log(APART):
        return None
    nonlinear = found.x.copy()
    nonlinear[:lags] = np.sort(nonlinear[:lags])[::-1]
    return _described(problem, shape, nonlinear)


def _described(problem: _Problem, shape: Shape, nonlinear: Array) -> Fit:
    recording = problem.recording
    linear, residual = problem.solve(shape, nonlinear)
    times_s, swings = shape.poles(nonlinear)
    delay_s, backlash_ml = float(nonlinear[-2]), float(nonlinear[-1])
    values = np.concatenate([linear, times_s, swings.ravel(), nonlinear[-2:]])
    count, n = values.size, residual.size
    variance = float(residual @ residual) / (n - count)
    jacobian = _jacobian(problem, shape, values)
    covariance = np.asarray(variance * np.linalg.pinv(jacobian.T @ jacobian), dtype=np.float64)
    criterion = n * math.log(float(residual @ residual) / n) + count * math.log(n)
    lags = shape.lags
    model = LevelModel(
        level_kpa=float(recording.pressure_kpa.mean()),
        plunger_ml=float(recording.plunger_ml.mean()),
        direct=float(linear[2]),
        gains=tuple(float(c) for c in linear[3 : 3 + lags]),
        times_s=tuple(float(t) for t in times_s),
        delay_s=delay_s,
        backlash_ml=backlash_ml,
        modes=tuple(
            Mode(float(m), float(w), float(z))
            for m, (w, z) in zip(linear[3 + lags :], swings, strict=True)
        ),
    )
    terms, swinging = range(1, lags + 1), range(1, shape.modes + 1)
    names = [
        ("offset", "kPa"),
        ("drift", "kPa/s"),
        ("direct gain", "kPa/mL"),
        *((f"gain {i}", "kPa/mL") for i in terms),
        *((f"mode gain {j}", "kPa/mL") for j in swinging),
        *((f"time constant {i}", "s") for i in terms),
        *(
            one
            for j in swinging
            for one in ((f"mode frequency {j}", "rad/s"), (f"mode damping {j}", ""))
        ),
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


def _jacobian(problem: _Problem, shape: Shape, values: Array) -> Array:
    """Of the simulated pressure with respect to all parameters, (n, m)."""
    linear, nonlinear = values[: shape.linear], values[shape.linear :]

    def regressors(changed: Array) -> Array:
        swings = changed[shape.lags : -2].reshape(shape.modes, 2)
        return problem.regressors(changed[: shape.lags], swings, *changed[-2:])

    columns = [regressors(nonlinear)]
    for index in range(nonlinear.size):
        width = 1e-3 * max(abs(nonlinear[index]), 1e-3)
        up, down = nonlinear.copy(), nonlinear.copy()
        up[index] += width
        down[index] -= width
        difference = regressors(up) @ linear - regressors(down) @ linear
        columns.append((difference / (2 * width))[:, None])
    return np.hstack(columns)


def fit_percent(residual: Array, measured: Array) -> float:
    """100 (1 - |residual| / |measured - mean|) of arrays (n,); Ljung, System Identification."""
    about = measured - measured.mean()
    return float(100 * (1 - np.linalg.norm(residual) / np.linalg.norm(about)))


def whiteness(residual: Array, lags: int = WHITENESS_LAGS) -> float:
    """p-value that a residual (n,) is white: Ljung and Box, Biometrika 65 (1978).

    No degrees of freedom are taken off: what was fitted is the dynamics, not the noise.
    """
    from scipy.stats import chi2

    count = residual.size
    about = residual - residual.mean()
    lag = np.arange(1, lags + 1)
    correlation = np.array([about[k:] @ about[:-k] for k in lag]) / (about @ about)
    statistic = count * (count + 2) * np.sum(correlation**2 / (count - lag))
    return float(chi2.sf(statistic, lags))


def predict(fit: Fit, recording: Recording) -> Array:
    """Pressure (n,) that a model foretells for another recording at its level.

    Offset and drift are of the recording itself, by least squares: they are not dynamics.
    """
    model = fit.model
    problem = _Problem.of(recording)
    swings = np.array([(m.frequency, m.damping) for m in model.modes]).reshape(-1, 2)
    regressors = problem.regressors(
        np.array(model.times_s), swings, model.delay_s, model.backlash_ml
    )
    shares = [model.direct, *model.gains, *(m.gain for m in model.modes)]
    dynamic = regressors[:, 2:] @ np.array(shares)
    trend, *_ = np.linalg.lstsq(regressors[:, :2], recording.pressure_kpa - dynamic, rcond=None)
    return np.asarray(dynamic + regressors[:, :2] @ trend)
