"""The truth of a specimen that obeys beam theory, bent away from it as the bench says.

The response starts from the beam model of the *perturbed* actuator and is then bent away from it
by three documented additions:

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

Below zero pressure angle and force continue straight.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.bellow import BellowShape, bending_geometry
from rig.mechanics.model import predict
from rig.mechanics.profile import cavity_volume, unfolding_angle
from rig.plant.errors import SpecimenError
from rig.plant.truth_tables import TruthTables
from rig.spec.actuator import ActuatorSpec, BellowBendingGeometry
from rig.spec.bench import BeamSpecimen
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]

STIFFENING_ANGLE = np.pi / 2
"""rad; the angle that loses the share `stiffening`."""

_SAME = np.deg2rad(0.1)  # a specimen closer to the model than this everywhere is the model
_UNFOLDED_SHARE = 0.85  # of the angle at which the convolutions are straight: the volume's bend


def beam_truth(
    actuator: ActuatorSpec,
    printed: ActuatorSpec,
    material: MaterialSpec,
    stiffness: float,
    variation: BeamSpecimen,
    deviations: tuple[float, float],
    pressure: Array,
) -> TruthTables:
    """Tables of the printed actuator over `pressure` in Pa, (n,).

    `actuator` and `material` are those of the drawing, `stiffness` is the print's modulus relative
    to it; `deviations` are those of the offset by gravity and of the stiffening, in standard
    deviations. Raises SpecimenError if the result is
    indistinguishable from the model of the drawing, MechanicsError if the beam model does not
    cover it.
    """
    by_offset, by_stiffening = deviations
    strength = max(variation.stiffening * (1 + variation.stiffening_spread * by_stiffening), 0.0)
    at_rest = variation.gravity_offset + variation.gravity_offset_spread * by_offset
    limit = actuator.limits.pressure
    angle_slope, force_slope = _beam_slopes(printed, _of_modulus(material, stiffness))
    bend = stiffened(angle_slope * pressure, STIFFENING_ANGLE, strength)
    angle = at_rest + bend
    geometry = bending_geometry(printed, "The virtual bench")
    _require_difference(pressure, angle, actuator, material)
    return TruthTables(
        deformation=angle,
        blocked_force=stiffened(force_slope * pressure, force_slope * limit, strength),
        volume_free=_volume(geometry, angle),
        volume_blocked=_volume(geometry, _turn_when_blocked(geometry) * bend),
    )


def stiffened(linear: Array, reference: float, strength: float) -> Array:
    """`linear` / (1 + `strength` `linear` / `reference`); unchanged where it is negative.

    Smooth in value and slope at zero, strictly growing, and `strength` is about the relative loss
    where `linear` equals `reference`.
    """
    return linear / (1 + strength * np.maximum(linear, 0.0) / reference)


def _of_modulus(material: MaterialSpec, stiffness: float) -> MaterialSpec:
    young = material.young_modulus
    relative = young.model_copy(update={"value": young.value * stiffness})
    return material.model_copy(update={"young_modulus": relative})


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


def _require_difference(
    pressure: Array, angle: Array, actuator: ActuatorSpec, material: MaterialSpec
) -> None:
    slope, _ = _beam_slopes(actuator, material)
    used = (pressure >= 0) & (pressure <= actuator.limits.pressure)
    if np.abs(angle - slope * pressure)[used].max() < _SAME:
        raise SpecimenError(
            f"The virtual specimen of '{actuator.name}' would be the very model that is to be "
            "validated on it: nothing in 'virtual.specimen' makes it differ. Give it a "
            "gravity_offset, stiffening or tolerances in the bench file."
        )
