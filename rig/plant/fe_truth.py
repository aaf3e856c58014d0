"""The truth of a specimen that obeys finite elements, on a mesh that no model is predicted on.

The printed wall is meshed; the printed modulus needs no calculation of its own: all stiffness times
s is the same as pressure and weight divided by s, with forces times s. Gravity offset, stiffening
and the loss of blocked force come by themselves.

Above the highest rung that the finite elements reached and below zero the tables continue straight.
With the tip free they reach the actuator's limit, so only faults lead beyond. Blocked they end
where the first trough creases, for the default bellow between 8.8 and 10 kPa: from there to the
limit the force of a virtual specimen is a continuation, not a solution.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.job import Job
from rig.mechanics.response import interpolated
from rig.mechanics.simulate.prediction import inflations
from rig.plant.errors import SpecimenError
from rig.plant.truth_tables import TruthTables
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec
from rig.spec.measurand import Deformation

Array = NDArray[np.float64]

MEASURES: dict[Deformation, str] = {"bending": "angle", "elongation": "displacement"}
"""What the finite elements call it."""
_LEAST_RUNGS = 4
"""Equilibria below which a table would be mostly extrapolated."""


def finite_element_truth(
    printed: ActuatorSpec, material: MaterialSpec, stiffness: float, pressure: Array, job: Job
) -> TruthTables:
    """Tables of the printed actuator over `pressure` in Pa, (n,).

    `stiffness` is the print's modulus relative to the material's. Raises SpecimenError where the
    finite elements got no way, or were stopped.
    """
    limit = printed.limits.pressure / stiffness
    density = material.density
    lighter = material.model_copy(
        update={"density": density.model_copy(update={"value": density.value / stiffness})}
    )
    scaled = printed.model_copy(
        update={"limits": printed.limits.model_copy(update={"pressure": limit})}
    )
    free, blocked = inflations(scaled, lighter, limit, job, specimen=True)
    for what, curves in (("tip free", free), ("tip blocked", blocked)):
        if curves.cancelled or curves.pressure.size < _LEAST_RUNGS:
            raise SpecimenError(
                f"The virtual specimen of '{printed.name}' has no response, {what}: "
                f"{curves.stopped} Run the command again to go on from there; with "
                "'virtual.specimen.response: beam' in the bench file the specimen needs no "
                "finite elements."
            )
    at, deformation = pressure / stiffness, printed.geometry.deformation
    # the bench sets the stop so that the hanging weight alone does not press on it
    force = blocked.measured["force"]
    return TruthTables(
        deformation=_extended(free.pressure, free.measured[MEASURES[deformation]], at),
        blocked_force=_extended(blocked.pressure, force - force[0], at) * stiffness,
        volume_free=_extended(free.pressure, free.measured["volume"], at),
        volume_blocked=_extended(blocked.pressure, blocked.measured["volume"], at),
    )


def _extended(pressure: Array, values: Array, at: Array) -> Array:
    """`interpolated`, and straight on with the slope between the outermost two beyond them."""
    first = (values[1] - values[0]) / (pressure[1] - pressure[0])
    last = (values[-1] - values[-2]) / (pressure[-1] - pressure[-2])
    inside = interpolated(pressure, values, np.clip(at, pressure[0], pressure[-1]))
    below = first * np.minimum(at - pressure[0], 0.0)
    above = last * np.maximum(at - pressure[-1], 0.0)
    return np.asarray(inside + below + above)
