"""The actuator on the virtual bench: printed imperfectly, so never the one under validation.

Its wall thickness and modulus are drawn around the drawing's. The response of that *perturbed*
actuator comes from finite elements on a mesh of its own (`rig.plant.fe_truth`) or from beam
theory bent away from itself (`rig.plant.beam_truth`), as the bench says. Creep and hysteresis are
dynamics: the specimen only carries their parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from rig.mechanics.job import Job
from rig.plant.beam_truth import beam_truth
from rig.plant.errors import SpecimenError
from rig.plant.fe_truth import finite_element_truth
from rig.spec.actuator import ActuatorSpec, Geometry
from rig.spec.bench import BeamSpecimen, FiniteElementSpecimen
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]

_LOWEST = -2e3  # Pa, start of the tables
_HIGHEST = 20e3  # Pa, their end, or further for strong actuators
_MARGIN = 5 / 3  # the tables reach at least this multiple of the actuator's limit
_STEP = 50.0  # Pa
_OUTERMOST = 3.0  # standard deviations: rarer draws are moved there, so that no wall vanishes


@dataclass(frozen=True)
class Specimen:
    """Quasi-static response over uniform gauge pressures, and what time does to it.

    The tables have one shape (n,), SI units, and grow strictly with pressure.
    """

    pressure: Array
    """Gauge pressure in Pa, uniform, from a slight vacuum to well above the limit."""
    deformation: Array
    """Bending angle in rad or elongation in m, tip free."""
    blocked_force: Array
    """Force on the stop in N."""
    volume_free: Array
    """Volume of the cavity in m3, tip free."""
    volume_blocked: Array
    """Volume of the cavity in m3, tip at the stop."""
    geometry: Geometry
    """As printed."""
    young_modulus: float
    """As printed, Pa."""
    density: float
    """Of its material, kg/m3."""
    creep_share: float
    """Share of the response that comes by creep."""
    creep_time: float
    """Time constant of the creep in s."""
    hysteresis: float
    """Share of the response that goes through play operators."""

    def __post_init__(self) -> None:
        steps = np.diff(self.pressure)
        if not np.allclose(steps, steps[0]):
            raise SpecimenError("The pressures of a specimen's tables must be equally spaced.")
        for name in ("pressure", "deformation", "blocked_force", "volume_free", "volume_blocked"):
            values = getattr(self, name)
            if values.shape != self.pressure.shape or not np.all(np.diff(values) > 0):
                raise SpecimenError(
                    f"The specimen's {name.replace('_', ' ')} does not grow with pressure all the "
                    "way, so the virtual bench cannot use it. Reduce 'virtual.specimen.stiffening' "
                    "in the bench file if it has one, or check the actuator's geometry."
                )
            values.flags.writeable = False


def draw_specimen(
    actuator: ActuatorSpec,
    material: MaterialSpec,
    variation: FiniteElementSpecimen | BeamSpecimen,
    rng: np.random.Generator,
    job: Job | None = None,
) -> Specimen:
    """Print one actuator: draw its deviations and tabulate its response.

    Deviations are normal with the standard deviations of `variation`, at most three of them from
    the mean. `job` is how finite elements are carried out. Raises SpecimenError if the drawn
    actuator cannot exist or is indistinguishable from the model, MechanicsError if its response
    cannot be computed.
    """
    deviations = np.clip(rng.standard_normal(4), -_OUTERMOST, _OUTERMOST)
    wall, modulus, *others = deviations.tolist()
    geometry = _printed(actuator, 1 + variation.wall_thickness * wall)
    printed = actuator.model_copy(update={"geometry": geometry})
    stiffness = 1 + variation.young_modulus * modulus

    highest = max(_HIGHEST, _MARGIN * actuator.limits.pressure)
    count = int(np.ceil((highest - _LOWEST) / _STEP)) + 1
    pressure = _LOWEST + _STEP * np.arange(count, dtype=np.float64)
    if isinstance(variation, BeamSpecimen):
        tables = beam_truth(
            actuator,
            printed,
            material,
            stiffness,
            variation,
            (others[0], others[1]),
            pressure,
        )
    else:
        tables = finite_element_truth(printed, material, stiffness, pressure, job or Job())
    return Specimen(
        pressure=pressure,
        deformation=tables.deformation,
        blocked_force=tables.blocked_force,
        volume_free=tables.volume_free,
        volume_blocked=tables.volume_blocked,
        geometry=geometry,
        young_modulus=material.young_modulus.value * stiffness,
        density=material.density.value,
        creep_share=variation.creep,
        creep_time=variation.creep_time,
        hysteresis=variation.hysteresis,
    )


def _printed(actuator: ActuatorSpec, wall_factor: float) -> Geometry:
    """The geometry with another wall, checked again: the constraints bind prints, too."""
    geometry = actuator.geometry
    thickness = geometry.wall_thickness * wall_factor
    try:
        return geometry.with_wall(thickness)
    except ValidationError as error:
        raise SpecimenError(
            f"The virtual specimen of '{actuator.name}' came out with a wall of "
            f"{thickness * 1e3:.4g} mm, which is impossible: {error.errors()[0]['msg']}. Reduce "
            "'virtual.specimen.wall_thickness' in the bench file or take another seed."
        ) from None
