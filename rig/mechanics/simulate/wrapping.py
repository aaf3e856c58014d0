"""Arms of rectangular bellows that wrap around a fixed cylinder: what it takes to grasp it.

Yin et al. (Rapid Design and Production of Soft Actuators, Section IV) put three arms around a tube
of 6 inches, "at a negative 45 degree angle from the horizon". That is the direction of the tube's
tangent at 45 degrees from its top, so that here an arm starts along the tangent, with its
strain-limiting layer a gap away from the tube. The paper does not tell the gap; the tube does not
yield and has no friction. Arms do not touch each other: one stands for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import Discretisation, Point, follow
from rig.mechanics.fe.contact import Contact, Sampling
from rig.mechanics.fe.obstacles import Cylinder
from rig.mechanics.mesh.chamber_row import RowResolution
from rig.mechanics.simulate.bending import FREE_OPTIONS
from rig.mechanics.simulate.chambers import rectangular_bellow_model
from rig.mechanics.simulate.shape import BendingShape
from rig.spec.chambers import BellowRectangularGeometry
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]

_PENALTY = 0.1
"""Of Young's modulus over the bellow's height. An arm touches with its tip and a few kPa: the tube
sinks in by less than the softness. On a harder tube Newton chatters when the tip arrives."""
_SOFTNESS = 5e-4
"""Over which contact sets in, metres, of a radius of 76 mm: without it each pressure moves the tip
further than it may sink in, 11 mm/kPa of an arm of 24 bellows."""
_TOLERANCE = 1e-5

_OPTIONS = replace(FREE_OPTIONS, iterations=20, alternate=False)
"""Steps on which the tip arrives take many iterations; plain ones do not get there."""


@dataclass(frozen=True)
class Wrap:
    """One arm around the cylinder, at the pressures that were reached; every array is (k,)."""

    pressure: Array
    """Pa."""
    volume: Array
    """That the arm has taken up since rest, m3."""
    angle: Array
    """Of the arm's tip against its root, rad."""
    grip: Array
    """Sum of the normal forces between arm and cylinder, whatever their direction, N."""
    contact: Array
    """Share of the layer's underside that touches."""
    failure: str | None
    """Why it went no further, if it did not."""


def wrap(
    geometry: BellowRectangularGeometry,
    material: MaterialSpec,
    pressures: Sequence[float],
    *,
    cylinder_radius: float,
    gap: float,
    resolution: RowResolution,
) -> Wrap:
    """Inflate an arm to `pressures` in Pa, ascending, beside a cylinder; lengths in m.

    Raises MechanicsError for a cylinder without a radius, a gap below zero, and a material without
    a volumetric energy.
    """
    if not (cylinder_radius > 0 and gap >= 0):
        raise MechanicsError(
            f"a cylinder of {1e3 * cylinder_radius:.4g} mm at a gap of {1e3 * gap:.4g} mm is "
            f"impossible: expected a radius above zero and a gap of zero or more."
        )
    penalty = _PENALTY * material.young_modulus.value / geometry.bellow_height
    contacts: list[Contact] = []

    def tube(d: Discretisation, shape: BendingShape) -> tuple[Contact]:
        axis = shape.underside - gap - cylinder_radius
        outside = d.facets_on("outside")
        # vertices come first among the nodes
        below = np.abs(d.mesh.p[2][d.mesh.facets[:, outside]] - shape.underside) < 1e-9
        contacts.append(
            Contact(
                Sampling.of_facets(d, outside[below.all(axis=0)]),
                Cylinder((0.0, 0.0, axis), (0.0, 1.0, 0.0), cylinder_radius),
                penalty=penalty,
                tolerance=_TOLERANCE,
                softness=_SOFTNESS,
            )
        )
        return (contacts[0],)

    bending = rectangular_bellow_model(geometry, material, resolution=resolution, items=tube)
    result = follow(bending.model, [Point(p) for p in (0.0, *pressures)], options=_OPTIONS)
    rest, *found = result.solutions
    area = float(contacts[0].sampling.weights.sum())
    touches = [contacts[0].touch(s.state.x) for s in found]
    return Wrap(
        pressure=np.array([s.pressure for s in found]),
        volume=np.array([bending.volume(s) - bending.volume(rest) for s in found]),
        angle=np.array([bending.angle(s.state) for s in found]),
        grip=np.array([2 * t.normal_force for t in touches]),
        contact=np.array([t.area / area for t in touches]),
        failure=result.failure,
    )
