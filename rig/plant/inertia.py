"""How the actuator's mass slows its deformation u: one generalised coordinate, its shape.

Rayleigh's quotient with the arc that a constant curvature makes, or an even stretch. Told by the
pressure s of the
quasi-static response, the shape has the kinetic energy 1/2 J (du/ds)^2 s'^2 and takes the work
s dV from the fluid, so its elastic energy is 1/2 (dV/ds) s^2, and

    J (du/ds)^2 s'' + (dV/ds) s = (dV/ds) p.
"""

from __future__ import annotations

import numpy as np

from rig.mechanics.outline import body_of
from rig.plant.specimen import Specimen


def deformation_inertia(specimen: Specimen, fluid_density: float) -> float:
    """Kinetic energy over half the squared rate of the deformation: in kg m2 of bending about the
    clamped end, in kg of lengthening.

    Bent, a slice at x goes sideways by theta x^2 / 2 L: what is spread along the length L counts
    L^2/20, the cap at its end L^2/4. Stretched evenly, it moves by d x / L: a third and one.
    `fluid_density` in kg/m3 is of what fills the cavity.
    """
    body = body_of(specimen.geometry)
    cavity = float(np.interp(0.0, specimen.pressure, specimen.volume_free))
    spread = body.soft_mass(specimen.density) + fluid_density * cavity
    cap = body.cap_mass(specimen.density)
    if specimen.geometry.deformation == "elongation":
        return spread / 3 + cap
    square = body.effective_length**2
    return spread * square / 20 + cap * square / 4


def shape_inertia(specimen: Specimen, pressure_limit: float, fluid_density: float) -> float:
    """Factor in s2 of s'' in the equation above, divided by dV/ds.

    Slopes are the mean ones up to `pressure_limit` in Pa. One over its root is the angular
    frequency of the actuator at a held pressure.
    """
    ends = np.array([0.0, pressure_limit])
    moved = float(np.diff(np.interp(ends, specimen.pressure, specimen.deformation))[0])
    growth = float(np.diff(np.interp(ends, specimen.pressure, specimen.volume_free))[0])
    return deformation_inertia(specimen, fluid_density) * moved**2 / (growth * pressure_limit)
