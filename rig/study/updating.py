"""Model updating: what modulus, wall and other parameters a recorded run speaks for.

The angle alone speaks for one product of the parameters, the force for the wall; what print and
material tolerances say goes in as normal priors, and the posterior says what the run added.
Estimates are the least squares of measured and prior differences over their standard uncertainties
(maximum a posteriori); a model's own error, where it is known, counts as uncertainty of the levels.
Where the model still misses them by more, these are widened by the Birge ratio and the fit
repeated. Uncertainties of different pressures are taken for independent.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rig.study.errors import StudyError
from rig.study.factors import Array
from rig.study.forward import Forward
from rig.study.measured import Measured

_EDGE = 1e-3
"""Prior deviations from a bound within which an estimate is at it."""


@dataclass(frozen=True)
class Estimate:
    """A parameter before and after the run, SI."""

    name: str
    prior: float
    prior_deviation: float
    value: float
    deviation: float

    def interval(self, deviations: float = 1.96) -> tuple[float, float]:
        """About 95 % by default."""
        return self.value - deviations * self.deviation, self.value + deviations * self.deviation


@dataclass(frozen=True)
class Prediction:
    """What the updated model says of levels that it has not seen; rad or N, (n,)."""

    pressure: Array
    mean: Array
    deviation: Array
    """Of the model's prediction."""
    measured: Array
    measured_u: Array

    @property
    def rmse(self) -> float:
        """Root mean square of prediction minus measurement."""
        return float(np.sqrt(np.mean((self.mean - self.measured) ** 2)))

    @property
    def beyond(self) -> int:
        """Levels off by more than twice the combined standard uncertainty."""
        spread = np.hypot(self.deviation, self.measured_u)
        return int(np.sum(np.abs(self.mean - self.measured) > 2 * spread))


@dataclass(frozen=True)
class Update:
    """The updated model."""

    estimates: tuple[Estimate, ...]
    """Of all parameters that the model tells."""
    correlation: Array
    """Of the estimates, (p, p)."""
    chi2_reduced: float
    """Above 1 where the model misses more than uncertainties explain."""
    draws: Array
    """Of the posterior, in prior deviations from the prior, (d, k)."""
    at_bounds: tuple[str, ...]
    """Unknowns at the edge of what the model is good for: their intervals mean nothing."""
    forward: Forward

    def __getitem__(self, name: str) -> Estimate:
        return next(one for one in self.estimates if one.name == name)

    def predict(self, held_out: Measured) -> tuple[Prediction, Prediction]:
        """Angles and forces of a run that was not used."""
        answers = [self.forward.answers(draw, held_out) for draw in self.draws]
        both = [np.array([one[i] for one in answers]) for i in (0, 1)]
        return (
            Prediction(
                held_out.angle_pressure,
                both[0].mean(axis=0),
                both[0].std(axis=0),
                held_out.angle,
                held_out.angle_u,
            ),
            Prediction(
                held_out.force_pressure,
                both[1].mean(axis=0),
                both[1].std(axis=0),
                held_out.force,
                held_out.force_u,
            ),
        )


def update_model(forward: Forward, run: Measured, *, mcmc: int = 0, seed: int = 0) -> Update:
    """Estimate the parameters of a model from a run.

    With `mcmc` steps of emcee the posterior is sampled as it is; otherwise it is taken for normal
    around its maximum. Raises StudyError for too few levels.
    """
    unknowns = len(forward.names)
    if run.count < unknowns:
        raise StudyError(
            f"the run has {run.count} levels; expected at least {unknowns}, as many as there are "
            f"parameters to estimate."
        )
    angle_error, force_error = forward.error(run)
    run = replace(
        run,
        angle_u=np.hypot(run.angle_u, angle_error),
        force_u=np.hypot(run.force_u, force_error),
    )
    best, covariance = _fitted(forward, run)
    levels = _residual(forward, best, run)[: run.count]
    chi2 = float(levels @ levels) / max(run.count - unknowns, 1)
    if chi2 > 1:
        wider = np.sqrt(chi2)
        run = replace(run, angle_u=wider * run.angle_u, force_u=wider * run.force_u)
        best, covariance = _fitted(forward, run)
    if mcmc:
        draws = _sampled(forward, run, best, covariance, mcmc, seed)
        best = draws.mean(axis=0)
    else:
        rng = np.random.default_rng(seed)
        draws = np.clip(rng.multivariate_normal(best, covariance, size=500), *forward.bounds.T)
    return Update(
        estimates=_estimates(forward, best, draws),
        correlation=np.asarray(np.corrcoef(_physical(forward, draws).T)),
        chi2_reduced=chi2,
        draws=draws,
        at_bounds=tuple(
            name
            for name, value, bounds in zip(forward.names, best, forward.bounds, strict=True)
            if np.min(np.abs(value - bounds)) < _EDGE
        ),
        forward=forward,
    )


def _residual(forward: Forward, unit: Array, run: Measured) -> Array:
    """Differences over their standard uncertainties, those from the prior last."""
    angle, force = forward.answers(unit, run)
    return np.concatenate(
        [(angle - run.angle) / run.angle_u, (force - run.force) / run.force_u, unit]
    )


def _fitted(forward: Forward, run: Measured) -> tuple[Array, Array]:
    """Parameters of the largest posterior, in prior deviations, and their covariance."""
    import lmfit

    parameters = lmfit.Parameters()
    for name, (low, high) in zip(forward.names, forward.bounds.tolist(), strict=True):
        parameters.add(name, value=0.0, min=low, max=high)

    def residual(p: Any) -> Array:
        return _residual(forward, np.array([p[name].value for name in forward.names]), run)

    found = lmfit.minimize(residual, parameters, method="least_squares", scale_covar=False)
    return np.array([found.params[name].value for name in forward.names]), np.asarray(found.covar)


def _physical(forward: Forward, draws: Array) -> Array:
    return np.array([list(forward.parameters(draw).values()) for draw in draws])


def _estimates(forward: Forward, best: Array, draws: Array) -> tuple[Estimate, ...]:
    spread = _physical(forward, draws).std(axis=0, ddof=1)
    before, after = forward.parameters(np.zeros(len(best))), forward.parameters(best)
    steps = [forward.parameters(step) for step in np.eye(len(best))]
    return tuple(
        Estimate(
            name,
            before[name],
            float(np.hypot.reduce([step[name] - before[name] for step in steps])),
            after[name],
            float(deviation),
        )
        for name, deviation in zip(before, spread, strict=True)
    )


def _sampled(
    forward: Forward,
    run: Measured,
    best: Array,
    covariance: Array,
    steps: int,
    seed: int,
) -> Array:
    """Draws of the posterior by emcee's affine-invariant walkers, the first half thrown away."""
    import emcee

    def log_probability(unit: Array) -> float:
        if np.any(unit < low) or np.any(unit > high):
            return -np.inf
        residual = _residual(forward, unit, run)
        return -0.5 * float(residual @ residual)

    low, high = forward.bounds.T
    rng = np.random.default_rng(seed)
    walkers = 4 * best.size
    start = rng.multivariate_normal(best, covariance / 4, size=walkers)
    start = np.clip(start, 0.95 * low, 0.95 * high)
    sampler = emcee.EnsembleSampler(walkers, best.size, log_probability)
    sampler.random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(start, steps)
    return np.asarray(sampler.get_chain(discard=steps // 2, flat=True))
