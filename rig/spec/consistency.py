"""What no single file can get wrong: specs that do not fit each other."""

from __future__ import annotations

from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec


def pressure_beyond_material(actuator: ActuatorSpec, material: MaterialSpec) -> str | None:
    """Why the actuator's pressure limit would tear the material; None if it would not.

    Compares the membrane stress of a thin tube, p ro / t with the outer radius ro of the cavity,
    with the lower tensile strength: an order of magnitude, which bending of the bellow's wall
    exceeds, so it refuses only what cannot be right. None without a sourced strength.
    """
    if material.tensile_strength is None:
        return None
    geometry = actuator.geometry
    radius = geometry.cavity_radius
    stress = actuator.limits.pressure * radius / geometry.wall_thickness
    strength = material.tensile_strength.low
    if stress < strength:
        return None
    limit = strength * geometry.wall_thickness / radius
    return (
        f"{actuator.limits.pressure / 1e3:g} kPa would tear the wall: as a thin tube it carries "
        f"p ro / t = {stress / 1e6:.3g} MPa, {material.name} breaks from {strength / 1e6:.3g} MPa; "
        f"expected well below {limit / 1e3:.3g} kPa"
    )
