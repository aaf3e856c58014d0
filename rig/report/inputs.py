"""What the inputs of a model leave uncertain of its prediction: u_input of ASME V&V 20.

The printed part's modulus and wall thickness are known as its spec says (`tolerances`). Linear
propagation (V&V 20-2009, section 3-2).

Beam theory is asked again, by central differences. Finite elements are not solved again: with all
stiffness times s they give theta(p / s) and s F(p / s) (exact but for the weight), which is their
own sensitivity to the modulus; that to the wall thickness is taken, relative to the prediction,
from beam theory. Other inputs count as exact.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.errors import MechanicsError
from rig.mechanics.model import available_models, predict
from rig.mechanics.response import Response
from rig.record.documents import ExperimentName
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]
Predicted = Callable[[Response], Array | None]
"""What a response says of an experiment, (n,)."""

MODULUS, WALL = "input: modulus", "input: wall thickness"
STEP = 1e-3
"""Relative change of an input in a difference."""
STIFFNESS_POWER: dict[ExperimentName, int] = {"deformation": 0, "blocked_force": 1}
"""A stiffer actuator at a pressure as much higher bends the same and presses as much harder."""


def input_uncertainty(
    actuator: ActuatorSpec,
    material: MaterialSpec,
    model: str,
    experiment: ExperimentName,
    curve: Callable[[Array], Array],
    predicted: Predicted,
    kpa: Array,
) -> dict[str, Array]:
    """Change (n,) of a prediction at pressures `kpa` (n,) by one standard uncertainty of an input.

    `curve` is the model's prediction over pressure in kPa, `predicted` takes that of a response.
    Empty if the actuator states no tolerances; without the wall where beam theory does not reach.
    """
    tolerances = actuator.tolerances
    if tolerances is None:
        return {}
    here = curve(kpa)
    effects = {}
    relative = beam_sensitivity(actuator, material, predicted, kpa)
    if model == "beam" and relative is not None:
        effects[MODULUS] = tolerances.young_modulus * relative[MODULUS] * here
    else:
        effects[MODULUS] = tolerances.young_modulus * modulus_effect(curve, experiment, kpa)
    if relative is not None:
        effects[WALL] = tolerances.wall_thickness * relative[WALL] * here
    return effects


def modulus_effect(
    curve: Callable[[Array], Array], experiment: ExperimentName, kpa: Array
) -> Array:
    """Change (n,) of a prediction y by a relative change of all stiffness.

    From y(p; s) = s^m y(p / s): dy/ds = m y - p dy/dp at s = 1; the difference is taken downwards,
    where the model has answered.
    """
    here, below = curve(kpa), curve(kpa * (1 - STEP))
    return np.asarray(STIFFNESS_POWER[experiment] * here - (here - below) / STEP)


def beam_sensitivity(
    actuator: ActuatorSpec, material: MaterialSpec, predicted: Predicted, kpa: Array
) -> dict[str, Array] | None:
    """Relative change (n,) of beam theory's prediction by a relative change of each input.

    None where beam theory has no answer: for another family, or beyond its end.
    """
    if "beam" not in available_models(actuator.geometry.family):
        return None
    pressures = np.maximum(kpa, 0.0) * 1e3  # the mean of noise at 0 kPa may lie below

    def answer(modulus: float, wall: float) -> Array:
        changed = _with_wall(actuator, wall), _with_modulus(material, modulus)
        value = predicted(predict(*changed, "beam", pressures))
        assert value is not None  # beam theory answers for both experiments
        return value

    up, down = 1 + STEP, 1 - STEP
    try:
        here = answer(1, 1)
        changes = {
            MODULUS: answer(up, 1) - answer(down, 1),
            WALL: answer(1, up) - answer(1, down),
        }
    except MechanicsError:
        return None
    return {
        name: np.divide(change / (2 * STEP), here, out=np.zeros_like(here), where=here != 0)
        for name, change in changes.items()
    }


def _with_wall(actuator: ActuatorSpec, factor: float) -> ActuatorSpec:
    thickness = actuator.geometry.wall_thickness * factor
    geometry = actuator.geometry.model_copy(update={"wall_thickness": thickness})
    return actuator.model_copy(update={"geometry": geometry})


def _with_modulus(material: MaterialSpec, factor: float) -> MaterialSpec:
    value = material.young_modulus.value * factor
    modulus = material.young_modulus.model_copy(update={"value": value})
    return material.model_copy(update={"young_modulus": modulus})
