"""A finished study in place of its model: response surfaces of modulus and wall, over pressure.

One finite element answer takes minutes, an estimate takes thousands; so a study's surfaces answer,
and their error at the study's check points counts as uncertainty. They are asked between the
study's levels only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.table import GRAM_FORCE
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec
from rig.spec.study import StudyResponse
from rig.study.analysis import check_of, model_terms, surface_of
from rig.study.errors import StudyError
from rig.study.factors import Array, Factor, Term, coded, model_matrix
from rig.study.forward import REACH, Priors
from rig.study.measured import Measured
from rig.study.run import Study

_FIELDS = {
    "material.young_modulus.value": "modulus",
    "actuator.geometry.wall_thickness": "wall",
}
_FEWEST = 3
"""Pressures that make a curve."""
_BEYOND = 0.02
"""Of the study's range of pressures: so far beyond it a curve is continued, as settled pressures
are not quite those that were asked for."""


@dataclass(frozen=True)
class Curve:
    """Surfaces of one quantity at ascending pressures in Pa, (n,), and what makes them SI."""

    quantity: str
    pressure: Array
    terms: tuple[Term, ...]
    coefficients: Array
    """Of the surfaces' terms in coded factors, (n, t)."""
    error: Array
    """Root mean square at the check points, in the surfaces' unit, (n,)."""
    factor: float

    @classmethod
    def of(cls, study: Study, quantity: str, factor: float, *, zero_at_rest: bool) -> Curve:
        """Raises StudyError for too few pressures, and for surfaces that were not checked."""
        if not study.checked:
            raise StudyError(
                f"the surfaces of study '{study.plan.spec.name}' were not checked, so their "
                f"error is not known; give it check_points and run it again."
            )
        terms = model_terms(study.plan)
        found = {one.pressure: _fitted(study, one.name) for one in _responses(study, quantity)}
        if zero_at_rest:
            found[0.0] = (np.zeros(len(terms)), 0.0)
        if len(found) < _FEWEST:
            raise StudyError(
                f"study '{study.plan.spec.name}' has {len(found)} pressures for {quantity}; "
                f"expected at least {_FEWEST} responses of this quantity."
            )
        pressure = sorted(found)
        return cls(
            quantity,
            np.array(pressure),
            terms,
            np.array([found[p][0] for p in pressure]),
            np.array([found[p][1] for p in pressure]),
            factor,
        )

    def at(self, pressure: Array, point: Array) -> Array:
        """Values in SI at pressures (m,) for a coded point (k,)."""
        from scipy.interpolate import PchipInterpolator

        self._require_covered(pressure)
        values = self.coefficients @ model_matrix(point[None], self.terms)[0]
        return np.asarray(self.factor * PchipInterpolator(self.pressure, values)(pressure))

    def error_at(self, pressure: Array) -> Array:
        """The surfaces' error in SI, (m,)."""
        return np.asarray(self.factor * np.interp(pressure, self.pressure, self.error))

    def covers(self, pressure: Array) -> NDArray[np.bool_]:
        """Pressures that the responses reach, or nearly so, (m,)."""
        low, high = float(self.pressure[0]), float(self.pressure[-1])
        slack = _BEYOND * (high - low)
        return np.asarray((pressure >= low - slack) & (pressure <= high + slack))

    def _require_covered(self, pressure: Array) -> None:
        wrong = pressure[~self.covers(pressure)]
        if wrong.size:
            raise StudyError(
                f"the run has {self.quantity} at {wrong[0] / 1e3:.4g} kPa, the study from "
                f"{self.pressure[0] / 1e3:g} to {self.pressure[-1] / 1e3:g} kPa; add responses, or "
                f"leave these levels out."
            )


@dataclass(frozen=True)
class SurfaceForward:
    """The surfaces with an offset of the angle, less what had not come yet when levels were read:

        angle = offset + (1 - c) A,    force = (1 - c) F.

    Softening is the study's model's own.
    """

    factors: tuple[Factor, ...]
    """In SI, in the order of the study."""
    order: tuple[str, ...]
    """`modulus` and `wall` in the order of the factors."""
    prior: dict[str, float]
    """Values before the run, SI."""
    priors: Priors
    angles: Curve
    forces: Curve

    @classmethod
    def of(
        cls,
        study: Study,
        actuator: ActuatorSpec,
        material: MaterialSpec,
        priors: Priors | None = None,
    ) -> SurfaceForward:
        """Raises StudyError for a study of another actuator, of other factors, or unchecked."""
        plan = study.plan
        fields = [str(field) for field in plan.fields.values()]
        if sorted(fields) != sorted(_FIELDS):
            raise StudyError(
                f"study '{plan.spec.name}' varies {', '.join(fields)}; expected "
                f"{' and '.join(_FIELDS)}, which an update estimates."
            )
        if (plan.space.actuator.geometry, plan.space.material) != (actuator.geometry, material):
            raise StudyError(
                f"study '{plan.spec.name}' is of actuator '{plan.space.actuator.name}' of "
                f"{plan.space.material.name}, the run of another geometry or material; expected a "
                f"study around the actuator that was measured."
            )
        prior = {
            "modulus": material.young_modulus.value,
            "wall": actuator.geometry.wall_thickness,
        }
        return cls(
            plan.factors,
            tuple(_FIELDS[field] for field in fields),
            prior,
            priors or Priors(),
            Curve.of(study, "angle", float(np.radians(1.0)), zero_at_rest=False),
            Curve.of(study, "blocked_force", GRAM_FORCE, zero_at_rest=True),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Unknowns, in their order."""
        return ("modulus", "wall", "offset", "creep")

    @property
    def bounds(self) -> Array:
        """The study's levels."""
        found = []
        for name in ("modulus", "wall"):
            factor = self.factors[self.order.index(name)]
            step = self.prior[name] * getattr(self.priors, name)
            found.append([(level - self.prior[name]) / step for level in (factor.low, factor.high)])
        return np.array([*found, *[[-REACH, REACH]] * 2])

    def covered(self, at: Measured) -> Measured:
        """Levels between the study's pressures."""
        return at.only(self.angles.covers(at.angle_pressure), self.forces.covers(at.force_pressure))

    def parameters(self, unit: Array) -> dict[str, float]:
        """Physical values, SI."""
        return {
            "modulus": self.prior["modulus"] * (1 + self.priors.modulus * unit[0]),
            "wall": self.prior["wall"] * (1 + self.priors.wall * unit[1]),
            "offset": self.priors.offset * unit[2],
            "creep": self.priors.creep * unit[3],
        }

    def answers(self, unit: Array, at: Measured) -> tuple[Array, Array]:
        """Angles in rad and forces in N at the levels of `at`."""
        p = self.parameters(unit)
        come = 1 - p["creep"]
        point = coded(self.factors, np.array([[p[name] for name in self.order]]))[0]
        return (
            p["offset"] + come * self.angles.at(at.angle_pressure, point),
            come * self.forces.at(at.force_pressure, point),
        )

    def error(self, at: Measured) -> tuple[Array, Array]:
        """Of the surfaces at the study's check points."""
        return self.angles.error_at(at.angle_pressure), self.forces.error_at(at.force_pressure)


def _fitted(study: Study, response: str) -> tuple[Array, float]:
    """Coefficients of a response's surface, and its error at the check points.

    Where the factors do not act, as at rest, there is a constant only.
    """
    values = [values[response] for _, values in (*study.fitted, *study.checked)]
    if np.ptp(values) == 0:
        return np.array([values[0] if not term else 0.0 for term in model_terms(study.plan)]), 0.0
    surface = surface_of(study, response)
    check = check_of(study, surface)
    assert check is not None
    return surface.coefficients, check.rmse


def _responses(study: Study, quantity: str) -> list[StudyResponse]:
    """Of one model: finite elements where the study has both."""
    own = [one for one in study.plan.spec.responses if one.quantity == quantity]
    models = {one.model for one in own}
    return [one for one in own if one.model == ("fe" if "fe" in models else "beam")]
