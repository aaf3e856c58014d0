"""What the finite elements answer when `rig.mechanics.model` asks them for a response."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.errors import MechanicsError
from rig.mechanics.job import Job
from rig.mechanics.response import Response, interpolated
from rig.mechanics.simulate.families import MODELS
from rig.mechanics.simulate.free import FreeInflation
from rig.mechanics.store import content_key
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]


def free_inflation(actuator: ActuatorSpec, material: MaterialSpec) -> FreeInflation:
    """The actuator of a family in MODELS, inflated with its tip free."""
    geometry = actuator.geometry
    build = MODELS[geometry.family]
    limit = actuator.limits.pressure
    key = content_key(
        experiment="free",
        geometry=geometry.model_dump(mode="json"),
        material=material.model_dump(mode="json"),
        limit=limit,
    )
    return FreeInflation(lambda: build(geometry, material), key, limit)


def finite_element_response(
    actuator: ActuatorSpec, material: MaterialSpec, pressures: Array, job: Job
) -> Response:
    """The response at `pressures` in Pa, (n,), ascending.

    Not a number beyond the pressure that the calculation reached. Raises MechanicsError where it
    reached none.
    """
    curves = free_inflation(actuator, material).curves(float(pressures[-1]), job)
    if not curves.pressure.size:
        raise MechanicsError(
            f"the finite elements of '{actuator.name}' found no equilibrium, not even at 0 kPa: "
            f"{curves.stopped}"
        )

    def at(values: Array) -> Array:
        return interpolated(curves.pressure, values, pressures)

    return Response(
        model="fe",
        pressure=pressures,
        angle=None if curves.angle is None else at(curves.angle),
        displacement=at(curves.displacement),
        blocked_force=None,
        volume=at(curves.volume),
        max_von_mises=at(curves.max_von_mises),
        notes=() if curves.stopped is None else (curves.stopped,),
    )
