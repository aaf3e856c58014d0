"""The actuator on the virtual bench: printed imperfectly, so never the one under validation.

Its wall thickness and modulus are drawn around the drawing's; its response starts from the beam
model of that *perturbed* actuator and is then bent away from it by three documented additions
until the finite-element model supplies the response:

1. Stiffening. The beam theory is linear in pressure; a real bellow stiffens as its convolutions
   unfold, as material stretches, and as the hanging weight is lifted. With the linear angle T and
   force F of the perturbed beam,

       angle = offset + T / (1 + s T / 90 deg),
       force = F / (1 + s F / F_limit),    F_limit = F at the actuator's pressure limit,

   so that the strength s is the relative loss at 90 degrees and at the limit. The force loses,
   too: an actuator held at the tip bows between clamp and stop and its troughs close.
2. Gravity. Hanging with its bellow on one side, the actuator already bends by `offset` at zero
   pressure (Yao, He and Maiolino, Section V: "due to gravity, ... an offset at 0 kPa"). The
   restoring torque that grows with the angle is part of s.
3. Volume. Free: the cavity at the angle, straight on where its convolutions end. Blocked: the tip
   touches but may turn, as the propped cantilever of `rig.mechanics.blocked`: the flexible length
   L with the stop at c turns by 1 - 3 (c L - L^2/2)^2 / (L (c^3 - (c - L)^3)) of the free angle,
   a quarter for c = L.

Below zero pressure angle and force continue straight. Creep and hysteresis are dynamics: the
specimen only carries their parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from rig.mechanics.bellow import BellowShape, bending_geometry
from rig.mechanics.model import predict
from rig.mechanics.profile import cavity_volume, unfolding_angle
from rig.plant.errors import SpecimenError
from rig.spec.actuator import ActuatorSpec, BellowBendingGeometry
from rig.spec.bench import SpecimenVariation
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]

STIFFENING_ANGLE = np.pi / 2
"""rad; the angle that loses the share `stiffening`."""

_LOWEST = -2e3  # Pa, start of the tables
_HIGHEST = 20e3  # Pa, their end, or further for strong actuators
_MARGIN = 5 / 3  # the tables reach at least this multiple of the actuator's limit
_STEP = 50.0  # Pa
_OUTERMOST = 3.0  # standard deviations: rarer draws are moved there, so that no wall vanishes
_SAME = np.deg2rad(0.1)  # a specimen closer to the model than this everywhere is the model
_UNFOLDED_SHARE = 0.85  # of the angle at which the convolutions are straight: the volume's bend


@dataclass(frozen=True)
class Specimen:
    """Quasi-static response over uniform gauge pressures, and what time does to it.

    The tables have one shape (n,), SI units, and grow strictly with pressure.
    """

    pressure: Array
    """Gauge pressure in Pa, uniform, from a slight vacuum to well above the limit."""
    angle: Array
    """Bending angle in rad, tip free."""
    blocked_force: Array
    """Force on the stop in N, zero at zero pressure."""
    volume_free: Array
    """Volume of the cavity in m3, tip free."""
    volume_blocked: Array
    """Volume of the cavity in m3, tip at the stop."""
    geometry: BellowBendingGeometry
    """As printed."""
    young_modulus: float
    """As printed, Pa."""
    gravity_offset: float
    """Bending angle at zero pressure in rad."""
    stiffening: float
    """Relative loss of angle at 90 degrees, and of force at the pressure limit."""
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
        for name in ("pressure", "angle", "blocked_force", "volume_free", "volume_blocked"):
            values = getattr(self, name)
            if values.shape != self.pressure.shape or not np.all(np.diff(values) > 0):
                raise SpecimenError(
                    f"The specimen's {name.replace('_', ' ')} does not grow with pressure all the "
                    "way, so the virtual bench cannot use it. Reduce 'virtual.specimen.stiffening' "
                    "in the bench file or check the actuator's geometry."
                )
            values.flags.writeable = False


def draw_specimen(
    actuator: ActuatorSpec,
    material: MaterialSpec,
    variation: SpecimenVariation,
    rng: np.random.Generator,
) -> Specimen:
    """Print one actuator: draw its deviations and tabulate its response.

    Deviations are normal with the standard deviations of `variation`, at most three of them from
    the mean. Raises SpecimenError if the drawn actuator cannot exist or is indistinguishable from
    the model, MechanicsError if the beam model does not cover it.
    """
    deviations = np.clip(rng.standard_normal(4), -_OUTERMOST, _OUTERMOST)
    wall, modulus, offset, stiffening = deviations.tolist()
    geometry = _printed(actuator, 1 + variation.wall_thickness * wall)
    young_modulus = material.young_modulus.value * (1 + variation.young_modulus * modulus)
    strength = max(variation.stiffening * (1 + variation.stiffening_spread * stiffening), 0.0)
    at_rest = variation.gravity_offset + variation.gravity_offset_spread * offset

    limit = actuator.limits.pressure
    highest = max(_HIGHEST, _MARGIN * limit)
    count = int(np.ceil((highest - _LOWEST) / _STEP)) + 1
    pressure = _LOWEST + _STEP * np.arange(count, dtype=np.float64)
    printed = actuator.model_copy(update={"geometry": geometry})
    angle_slope, force_slope = _beam_slopes(printed, _of_modulus(material, young_modulus))
    bend = stiffened(angle_slope * pressure, STIFFENING_ANGLE, strength)
    specimen = Specimen(
        pressure=pressure,
        angle=at_rest + bend,
        blocked_force=stiffened(force_slope * pressure, force_slope * limit, strength),
        volume_free=_volume(geometry, at_rest + bend),
        volume_blocked=_volume(geometry, _turn_when_blocked(geometry) * bend),
        geometry=geometry,
        young_modulus=young_modulus,
        gravity_offset=at_rest,
        stiffening=strength,
        creep_share=variation.creep,
        creep_time=variation.creep_time,
        hysteresis=variation.hysteresis,
    )
    _require_difference(specimen, actuator, material)
    return specimen


def stiffened(linear: Array, reference: float, strength: float) -> Array:
    """`linear` / (1 + `strength` `linear` / `reference`); unchanged where it is negative.

    Smooth in value and slope at zero, strictly growing, and `strength` is about the relative loss
    where `linear` equals `reference`.
    """
    return linear / (1 + strength * np.maximum(linear, 0.0) / reference)


def _printed(actuator: ActuatorSpec, wall_factor: float) -> BellowBendingGeometry:
    """The geometry with another wall, checked again: the constraints bind prints, too."""
    geometry = bending_geometry(actuator, "The virtual bench")
    thickness = geometry.wall_thickness * wall_factor
    try:
        return BellowBendingGeometry.model_validate(
            geometry.model_dump(mode="json") | {"wall_thickness": f"{thickness!r} m"}
        )
    except ValidationError as error:
        raise SpecimenError(
            f"The virtual specimen of '{actuator.name}' came out with a wall of "
            f"{thickness * 1e3:.4g} mm, which is impossible: {error.errors()[0]['msg']}. Reduce "
            "'virtual.specimen.wall_thickness' in the bench file or take another seed."
        ) from None


def _of_modulus(material: MaterialSpec, young_modulus: float) -> MaterialSpec:
    modulus = material.young_modulus.model_copy(update={"value": young_modulus})
    return material.model_copy(update={"young_modulus": modulus})


def _beam_slopes(actuator: ActuatorSpec, material: MaterialSpec) -> tuple[float, float]:
    """Angle (rad) and blocked force (N) per pascal of the linear beam model.

    Asked at half the limit: a soft specimen must not run into the end of the model's geometry.
    """
    pressure = 0.5 * actuator.limits.pressure
    response = predict(actuator, material, "beam", [pressure])
    if response.angle is None or response.blocked_force is None:
        raise SpecimenError(
            f"The beam model gives no angle or blocked force for '{actuator.name}', so that the "
            "virtual bench has nothing for camera or load cell; use another actuator family."
        )
    return float(response.angle[0]) / pressure, float(response.blocked_force[0]) / pressure


def _volume(geometry: BellowBendingGeometry, angle: Array) -> Array:
    """Cavity volume in m3 at each angle in rad.

    It continues straight from shortly before the convolutions are unfolded: there the profile
    flattens, its volume stalls, and the rubber's stretching, which would go on, is not modelled.
    """
    last = _UNFOLDED_SHARE * unfolding_angle(geometry)
    before, at_last = cavity_volume(geometry, np.array([last - 1e-3, last]))
    slope = (at_last - before) / 1e-3
    inside = cavity_volume(geometry, np.minimum(angle, last))
    volume: Array = inside + slope * np.maximum(angle - last, 0.0)
    return volume


def _turn_when_blocked(geometry: BellowBendingGeometry) -> float:
    """Angle of the tip against its stop, relative to the free angle at the same pressure."""
    shape = BellowShape.of(geometry)
    flexible, contact = shape.effective_length, shape.tip
    by_moment = contact * flexible - flexible**2 / 2
    return 1 - 3 * by_moment**2 / (flexible * (contact**3 - (contact - flexible) ** 3))


def _require_difference(specimen: Specimen, actuator: ActuatorSpec, material: MaterialSpec) -> None:
    slope, _ = _beam_slopes(actuator, material)
    used = (specimen.pressure >= 0) & (specimen.pressure <= actuator.limits.pressure)
    difference = np.abs(specimen.angle - slope * specimen.pressure)[used]
    if difference.max() < _SAME:
        raise SpecimenError(
            f"The virtual specimen of '{actuator.name}' would be the very model that is to be "
            "validated on it: nothing in 'virtual.specimen' makes it differ. Give it a "
            "gravity_offset, stiffening or tolerances in the bench file."
        )
