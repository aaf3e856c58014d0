"""Model updating: what modulus, wall and free parameter b a recorded run speaks for.

Beam theory alone is a straight line through zero; real bellows start off it by their weight and
soften as they unfold. So the model is

    angle = offset + T / (1 + s T / 90 deg),    force = F / (1 + s F / F_limit),

with T and F those of beam theory for modulus, wall and b. The angle alone speaks for one product of
the three, the force for the wall; what print and material tolerances say goes in as normal priors,
and the posterior says what the run added. Estimates are the least squares of measured and prior
differences over their standard uncertainties (maximum a posteriori). Where the model misses the
levels by more than their uncertainties, these are widened by the Birge ratio and the fit repeated.
Uncertainties of different pressures are taken for independent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.beam import BeamTheory, published_free_parameter
from rig.mechanics.bellow import bending_geometry
from rig.mechanics.blocked import blocked_force
from rig.mechanics.table import GRAM_FORCE
from rig.spec.actuator import ActuatorSpec, BellowBendingGeometry
from rig.spec.material import MaterialSpec
from rig.spec.workspace import Setup
from rig.study.errors import StudyError
from rig.study.factors import Array
from rig.study.summary import read_experiments

NAMES = ("modulus", "wall", "free_parameter", "stiffening", "offset")
REPORTED = (*NAMES, "effective_modulus")
"""What is reported: also E b, which angles determine although they determine neither E nor b."""
_WALLS = 9
"""Walls at which the blocked force is computed; between them it is interpolated."""
_REACH = 6.0
"""Prior deviations that estimates may be from their prior."""


@dataclass(frozen=True)
class Priors:
    """Standard deviations of what is known before the run."""

    modulus: float = 0.05
    """Of Young's modulus, relative."""
    wall: float = 0.02
    """Of the wall thickness, relative."""
    free_parameter: float = 0.05
    """Of b, relative to the published formula at the estimated modulus."""
    stiffening: float = 0.2
    """Of s, around zero."""
    offset: float = float(np.radians(5.0))
    """Of the angle at zero pressure, in rad, around zero."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise StudyError(
                    f"the prior deviation of {name} is {value:g}; expected one above 0."
                )


@dataclass(frozen=True)
class Measured:
    """A run's levels; arrays (n,) and (m,), SI."""

    angle_pressure: Array
    angle: Array
    angle_u: Array
    """Standard uncertainties."""
    force_pressure: Array
    force: Array
    force_u: Array

    @property
    def count(self) -> int:
        """Levels in all."""
        return self.angle.size + self.force.size


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
    """In the order of REPORTED."""
    correlation: Array
    """(6, 6)."""
    chi2_reduced: float
    """Above 1 where the model misses more than uncertainties explain."""
    draws: Array
    """Of the posterior, in prior deviations from the prior, (d, 5)."""
    forward: Forward

    def __getitem__(self, name: str) -> Estimate:
        return self.estimates[REPORTED.index(name)]

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


@dataclass(frozen=True)
class Forward:
    """The model of an actuator; parameters come in prior deviations from the prior, (5,)."""

    geometry: BellowBendingGeometry
    prior_modulus: float
    """In Pa."""
    top_pressure: float
    """Limit of the actuator, in Pa."""
    priors: Priors
    force_slope: Callable[[float], float]
    """Wall in m to blocked force per pascal in N."""

    @classmethod
    def of(cls, actuator: ActuatorSpec, material: MaterialSpec, priors: Priors) -> Forward:
        """Raises MechanicsError for another family than the bending bellow's."""
        from scipy.interpolate import PchipInterpolator

        geometry = bending_geometry(actuator, "Model updating")
        thickest = 0.999 * geometry.arc_radius / geometry.wall_thickness - 1
        reach = min(_REACH * priors.wall, 0.9, thickest)
        walls = geometry.wall_thickness * np.linspace(1 - reach, 1 + reach, _WALLS)
        slopes = [
            float(blocked_force(geometry.model_copy(update={"wall_thickness": w}), 1.0))
            for w in walls.tolist()
        ]
        curve = PchipInterpolator(walls, slopes)
        return cls(
            geometry,
            material.young_modulus.value,
            actuator.limits.pressure,
            priors,
            lambda wall: float(curve(wall)),
        )

    def parameters(self, unit: Array) -> dict[str, float]:
        """Physical values, SI."""
        modulus = self.prior_modulus * (1 + self.priors.modulus * unit[0])
        free = published_free_parameter(self.geometry, modulus) * (
            1 + self.priors.free_parameter * unit[2]
        )
        return {
            "modulus": modulus,
            "wall": self.geometry.wall_thickness * (1 + self.priors.wall * unit[1]),
            "free_parameter": free,
            "stiffening": self.priors.stiffening * unit[3],
            "offset": self.priors.offset * unit[4],
            "effective_modulus": modulus * free,
        }

    def answers(self, unit: Array, at: Measured) -> tuple[Array, Array]:
        """Angles in rad and forces in N at the levels of `at`."""
        p = self.parameters(unit)
        printed = self.geometry.model_copy(update={"wall_thickness": p["wall"]})
        linear = BeamTheory(printed, p["modulus"], p["free_parameter"]).angle(at.angle_pressure)
        slope = self.force_slope(p["wall"])
        force = slope * at.force_pressure
        limit = slope * self.top_pressure
        return (
            p["offset"] + linear / (1 + p["stiffening"] * linear / (np.pi / 2)),
            force / (1 + p["stiffening"] * force / limit),
        )

    def residual(self, unit: Array, run: Measured) -> Array:
        """Differences over their standard uncertainties, those from the prior last."""
        angle, force = self.answers(unit, run)
        return np.concatenate(
            [(angle - run.angle) / run.angle_u, (force - run.force) / run.force_u, unit]
        )


def update_model(
    actuator: ActuatorSpec,
    material: MaterialSpec,
    run: Measured,
    priors: Priors | None = None,
    *,
    mcmc: int = 0,
    seed: int = 0,
) -> Update:
    """Estimate the parameters from a run.

    With `mcmc` steps of emcee the posterior is sampled as it is; otherwise it is taken for normal
    around its maximum. Raises StudyError for too few levels, and MechanicsError for another family.
    """
    if run.count < len(NAMES):
        raise StudyError(
            f"the run has {run.count} levels; expected at least {len(NAMES)}, as many as there "
            f"are parameters to estimate."
        )
    forward = Forward.of(actuator, material, priors or Priors())
    best, covariance = _fitted(forward, run)
    levels = forward.residual(best, run)[: run.count]
    chi2 = float(levels @ levels) / max(run.count - len(NAMES), 1)
    if chi2 > 1:
        wider = np.sqrt(chi2)
        run = replace(run, angle_u=wider * run.angle_u, force_u=wider * run.force_u)
        best, covariance = _fitted(forward, run)
    if mcmc:
        draws = _sampled(forward, run, best, covariance, mcmc, seed)
        best = draws.mean(axis=0)
    else:
        rng = np.random.default_rng(seed)
        draws = np.clip(rng.multivariate_normal(best, covariance, size=500), -_REACH, _REACH)
    return Update(
        estimates=_estimates(forward, best, draws),
        correlation=np.asarray(np.corrcoef(_physical(forward, draws).T)),
        chi2_reduced=chi2,
        draws=draws,
        forward=forward,
    )


def _fitted(forward: Forward, run: Measured) -> tuple[Array, Array]:
    """Parameters of the largest posterior, in prior deviations, and their covariance."""
    import lmfit

    parameters = lmfit.Parameters()
    for name in NAMES:
        parameters.add(name, value=0.0, min=-_REACH, max=_REACH)

    def residual(p: Any) -> Array:
        return forward.residual(np.array([p[name].value for name in NAMES]), run)

    found = lmfit.minimize(residual, parameters, method="least_squares", scale_covar=False)
    return np.array([found.params[name].value for name in NAMES]), np.asarray(found.covar)


def _physical(forward: Forward, draws: Array) -> Array:
    return np.array([[forward.parameters(draw)[name] for name in REPORTED] for draw in draws])


def _estimates(forward: Forward, best: Array, draws: Array) -> tuple[Estimate, ...]:
    spread = _physical(forward, draws).std(axis=0, ddof=1)
    before, after = forward.parameters(np.zeros(len(NAMES))), forward.parameters(best)
    steps = [forward.parameters(step) for step in np.eye(len(NAMES))]
    return tuple(
        Estimate(
            name,
            before[name],
            float(np.hypot.reduce([step[name] - before[name] for step in steps])),
            after[name],
            float(deviation),
        )
        for name, deviation in zip(REPORTED, spread, strict=True)
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
        if np.any(np.abs(unit) > _REACH):
            return -np.inf
        residual = forward.residual(unit, run)
        return -0.5 * float(residual @ residual)

    rng = np.random.default_rng(seed)
    walkers = 4 * len(NAMES)
    start = np.clip(rng.multivariate_normal(best, covariance / 4, size=walkers), -5, 5)
    sampler = emcee.EnsembleSampler(walkers, len(NAMES), log_probability)
    sampler.random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(start, steps)
    return np.asarray(sampler.get_chain(discard=steps // 2, flat=True))


def read_measured(run: Path) -> Measured:
    """Levels of a run's summary, both branches; raises StudyError where there are none."""
    experiments = read_experiments(run)
    angle = _levels(experiments.get("deformation"), float(np.radians(1.0)))
    force = _levels(experiments.get("blocked_force"), GRAM_FORCE)
    if angle[0].size + force[0].size == 0:
        raise StudyError(f"{run}: the run measured neither angle nor blocked force.")
    return Measured(*angle, *force)


def _levels(experiment: Mapping[str, Any] | None, factor: float) -> tuple[Array, Array, Array]:
    """Pressures in Pa, means and standard uncertainties in SI."""
    points = [] if experiment is None else experiment["points"]
    rows = [
        (1e3 * p["measured_pressure_kpa"], factor * p["mean"], factor * p["u95"] / 2)
        for p in points
    ]
    table = np.array(rows, dtype=np.float64).reshape(len(rows), 3)
    return table[:, 0], table[:, 1], table[:, 2]


def without_pressures(run: Measured, held_out: Array) -> tuple[Measured, Measured]:
    """The run without levels within 0.2 kPa of the pressures in Pa, and those levels alone.

    Raises StudyError for pressures at which the run has no level.
    """

    def near(pressure: Array) -> NDArray[np.bool_]:
        """Levels (rows) against pressures to hold out (columns)."""
        return np.asarray(np.abs(pressure[:, None] - held_out[None, :]) < 200.0)

    def only(angles: NDArray[np.bool_], forces: NDArray[np.bool_]) -> Measured:
        return replace(
            run,
            angle_pressure=run.angle_pressure[angles],
            angle=run.angle[angles],
            angle_u=run.angle_u[angles],
            force_pressure=run.force_pressure[forces],
            force=run.force[forces],
            force_u=run.force_u[forces],
        )

    of_angle, of_force = near(run.angle_pressure), near(run.force_pressure)
    missed = held_out[~(of_angle.any(axis=0) | of_force.any(axis=0))]
    if missed.size:
        raise StudyError(
            f"no level of the run lies at {', '.join(f'{p / 1e3:g}' for p in missed)} kPa, which "
            f"you want to hold out."
        )
    angles, forces = np.any(of_angle, axis=1), np.any(of_force, axis=1)
    return only(~angles, ~forces), only(angles, forces)


def require_same_actuator(one: Setup, other: Setup) -> None:
    """Raise StudyError where two runs are of actuators of different geometry or material."""
    for what, own, others in (
        ("geometry", one.actuator.geometry, other.actuator.geometry),
        ("material", one.material, other.material),
    ):
        if own != others:
            raise StudyError(
                f"the run to be foretold is of another {what} ({other.actuator.name} of "
                f"{other.material.name}, not {one.actuator.name} of {one.material.name}); expected "
                f"a run of the same actuator."
            )
