"""Prediction by name: one registry of (geometry family, model), one function `predict`.

A new family or model registers a `Predictor`; nothing else changes. Finite elements are imported
when they are asked for: beam theory alone must answer at once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.mechanics.beam import BeamTheory
from rig.mechanics.bellow import bending_geometry
from rig.mechanics.blocked import blocked_force
from rig.mechanics.errors import MechanicsError
from rig.mechanics.job import Job
from rig.mechanics.profile import cavity_volume
from rig.mechanics.response import Response
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]
Predictor = Callable[[ActuatorSpec, MaterialSpec, Array, Job, bool], Response]
"""Actuator, material, pressures in Pa, how to carry it out and whether the blocked force is wanted,
to the response."""


def beam_of_bending_bellow(
    actuator: ActuatorSpec, material: MaterialSpec, pressures: Array, _job: Job, _blocked: bool
) -> Response:
    """Beam theory of the paper with our blocked force; MechanicsError where geometry runs out."""
    geometry = bending_geometry(actuator, "Beam theory")
    theory = BeamTheory.of(geometry, material)
    highest = float(pressures[-1])
    if highest > theory.limit_pressure:
        unfolds = theory.unfolding_pressure < theory.half_turn_pressure
        why = "the convolutions are completely unfolded" if unfolds else "the bend is a half turn"
        raise MechanicsError(
            f"the beam model ends at {theory.limit_pressure / 1e3:.4g} kPa, where {why}; "
            f"{highest / 1e3:.4g} kPa was asked for. Ask for lower pressures, or stiffen the "
            f"actuator (wall_thickness, material)."
        )
    angle = theory.angle(pressures)
    return Response(
        model="beam",
        pressure=pressures,
        angle=angle,
        displacement=theory.length_difference(pressures),
        blocked_force=blocked_force(geometry, pressures),
        volume=cavity_volume(geometry, angle),
    )


def finite_elements(
    actuator: ActuatorSpec, material: MaterialSpec, pressures: Array, job: Job, blocked: bool
) -> Response:
    """The family's finite element model; not a number beyond the pressure that it reached."""
    from rig.mechanics.simulate.prediction import finite_element_response

    return finite_element_response(actuator, material, pressures, job, blocked=blocked)


_PREDICTORS: dict[tuple[str, str], Predictor] = {
    ("bellow-bending", "beam"): beam_of_bending_bellow,
    ("bellow-bending", "fe"): finite_elements,
    ("bellow-axisymmetric", "fe"): finite_elements,
    ("bellow-gripper", "fe"): finite_elements,
    ("bellow-joint", "fe"): finite_elements,
    ("bellow-rectangular", "fe"): finite_elements,
    ("multi-chamber-bending", "fe"): finite_elements,
    ("multi-chamber-linear", "fe"): finite_elements,
    ("shell-reinforced-bending", "fe"): finite_elements,
    ("shell-reinforced-linear", "fe"): finite_elements,
}


def available_models(family: str) -> tuple[str, ...]:
    """Names of the models of a geometry family, sorted."""
    return tuple(sorted(model for kind, model in _PREDICTORS if kind == family))


def predict(
    actuator: ActuatorSpec,
    material: MaterialSpec,
    model: str,
    pressures: ArrayLike,
    job: Job | None = None,
    *,
    blocked: bool = True,
) -> Response:
    """Response of `actuator` made of `material` at gauge `pressures` in Pa, (n,), ascending.

    `job` says where long calculations keep their results and who watches them. Without `blocked`
    the blocked force is left out where it would take a calculation of its own.

    Raises MechanicsError for a model this version does not have, pressures that are not finite,
    negative or not ascending, above the actuator's limit, or beyond the model's range.
    """
    family = actuator.geometry.family
    predictor = _PREDICTORS.get((family, model))
    if predictor is None:
        raise MechanicsError(
            f"there is no model '{model}' for the family '{family}'; this version has: "
            f"{', '.join(available_models(family)) or 'none'}."
        )
    return predictor(actuator, material, _checked(actuator, pressures), job or Job(), blocked)


def _checked(actuator: ActuatorSpec, pressures: ArrayLike) -> Array:
    values = np.atleast_1d(np.asarray(pressures, dtype=float))
    if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values)):
        raise MechanicsError(
            "pressures must be a non-empty row of finite numbers; check the range."
        )
    if np.any(np.diff(values) <= 0):
        raise MechanicsError("pressures must ascend without repeating; sort them first.")
    if values[0] < 0:
        raise MechanicsError(
            f"the lowest pressure is {values[0] / 1e3:.4g} kPa; the models cover gauge pressures "
            f"from 0 up. Start at 0."
        )
    limit = actuator.limits.pressure
    if values[-1] > limit * (1 + 1e-12):
        raise MechanicsError(
            f"{values[-1] / 1e3:.4g} kPa is above the limit of {limit / 1e3:.4g} kPa of actuator "
            f"'{actuator.name}'. Ask for lower pressures, or raise limits.pressure in its spec if "
            f"the actuator stands it."
        )
    return values
