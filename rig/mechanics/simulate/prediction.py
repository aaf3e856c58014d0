"""What the finite elements answer when `rig.mechanics.model` asks them for a response."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe.threads import side_by_side
from rig.mechanics.hyperelastic.stability import material_stability
from rig.mechanics.job import Job, SharedWatch
from rig.mechanics.response import Response, interpolated
from rig.mechanics.simulate.families import FAMILIES, Meshing
from rig.mechanics.simulate.inflation import Curves, Inflation
from rig.mechanics.store import content_key
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]


def free_inflation(
    actuator: ActuatorSpec, material: MaterialSpec, *, specimen: bool = False
) -> Inflation:
    """The actuator of a family in FAMILIES, inflated with its tip free.

    `specimen` takes the mesh of virtual specimens.
    """
    geometry = actuator.geometry
    meshing = _meshing(actuator, specimen)
    return Inflation(
        "tip free",
        lambda: meshing.free(geometry, material),
        _key("free", actuator, material, specimen),
        actuator.limits.pressure,
        meshing.free_options,
    )


def blocked_inflation(
    actuator: ActuatorSpec, material: MaterialSpec, *, specimen: bool = False
) -> Inflation:
    """The same with its tip held by a stop."""
    geometry = actuator.geometry
    meshing = _meshing(actuator, specimen)
    return Inflation(
        "tip blocked",
        lambda: meshing.blocked(geometry, material),
        _key("blocked", actuator, material, specimen),
        actuator.limits.pressure,
        meshing.blocked_options,
    )


def _meshing(actuator: ActuatorSpec, specimen: bool) -> Meshing:
    family = FAMILIES[actuator.geometry.family]
    return family.specimen if specimen else family.model


def _key(experiment: str, actuator: ActuatorSpec, material: MaterialSpec, specimen: bool) -> str:
    return content_key(
        experiment=experiment,
        geometry=actuator.geometry.model_dump(mode="json"),
        material=material.model_dump(mode="json"),
        limit=actuator.limits.pressure,
        specimen=specimen,
    )


def inflations(
    actuator: ActuatorSpec,
    material: MaterialSpec,
    top: float,
    job: Job,
    *,
    specimen: bool = False,
) -> tuple[Curves, Curves]:
    """Curves up to `top` in Pa, with the tip free and blocked.

    Both are computed at once where there is more than one thread.
    """
    questions = [
        free_inflation(actuator, material, specimen=specimen),
        blocked_inflation(actuator, material, specimen=specimen),
    ]
    shared = SharedWatch(job.watch)
    beside = replace(job, watch=shared)
    free, blocked = side_by_side([partial(q.curves, top, beside) for q in questions], shared.stop)
    return free, blocked


def finite_element_response(
    actuator: ActuatorSpec,
    material: MaterialSpec,
    pressures: Array,
    job: Job,
    *,
    blocked: bool = True,
) -> Response:
    """The response at `pressures` in Pa, (n,), ascending; its blocked force only with `blocked`.

    The blocked force is that beyond the hanging weight's, which is there without pressure. Not a
    number beyond the pressures that the calculations reached. Raises MechanicsError where one
    reached none.
    """
    top = float(pressures[-1])
    held: Curves | None = None
    if blocked:
        free, held = inflations(actuator, material, top, job)
    else:
        free = free_inflation(actuator, material).curves(top, job)
    answers = [("tip free", free)] + ([("tip blocked", held)] if held is not None else [])
    for name, curves in answers:
        if not curves.pressure.size:
            raise MechanicsError(
                f"the finite elements of '{actuator.name}' found no equilibrium, not even at "
                f"0 kPa, {name}: {curves.stopped}"
            )

    def at(values: Array) -> Array:
        return interpolated(free.pressure, values, pressures)

    measured = free.measured
    unstable = material_stability(material).warning
    return Response(
        model="fe",
        pressure=pressures,
        angle=at(measured["angle"]) if "angle" in measured else None,
        displacement=at(measured["displacement"]),
        blocked_force=None if held is None else _beyond_the_weight(held, pressures),
        volume=at(measured["volume"]),
        max_von_mises=at(np.array([e.von_mises.value for e in free.extremes])),
        shortfalls=tuple(
            f"{name}: {curves.stopped}" for name, curves in answers if curves.stopped is not None
        ),
        cautions=() if unstable is None else (f"{unstable}.",),
    )


def _beyond_the_weight(blocked: Curves, pressures: Array) -> Array:
    force = blocked.measured["force"]
    return interpolated(blocked.pressure, force - force[0], pressures)
