"""Blocked force of the bending bellow by virtual work and a propped cantilever.

This is NOT in the paper, whose theory gives angles only; it is our extension, told in
docs/theory/beam.md. Pressure acts on the straight actuator as a uniform bending moment: by
virtual work M_p = p dV/dTheta at Theta = 0, with the cavity volume of `rig.mechanics.profile`.
The length L is flexible, end wall and cap beyond it are rigid, and the tip rests at c = L + 2 t.
Equal and opposite tip deflections of moment and force, with any uniform bending stiffness, give

    F = M_p * 3 (c L - L^2 / 2) / (c^3 - (c - L)^3),

the propped cantilever's 3 M / (2 L) for c = L.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.mechanics.bellow import BellowShape
from rig.mechanics.profile import cavity_volume
from rig.spec.actuator import BellowBendingGeometry

Array = NDArray[np.float64]

_STEP = 1e-3
"""Half step in rad of the central difference dV/dTheta."""


def pressure_moment(geometry: BellowBendingGeometry, pressure: ArrayLike) -> Array:
    """Bending moment in N m of each gauge pressure in Pa on the straight actuator."""
    below, above = cavity_volume(geometry, np.array([-_STEP, _STEP]))
    return np.asarray(np.asarray(pressure, dtype=float) * (above - below) / (2 * _STEP))


def blocked_force(geometry: BellowBendingGeometry, pressure: ArrayLike) -> Array:
    """Force in N on a rigid stop under the tip at each gauge pressure in Pa.

    Independent of the modulus, since moment and prop act on the same stiffness; an upper
    estimate, since real actuators bow and flatten between clamp and stop.
    """
    shape = BellowShape.of(geometry)
    flexible, contact = shape.effective_length, shape.tip
    by_moment = contact * flexible - flexible**2 / 2
    by_force = (contact**3 - (contact - flexible) ** 3) / 3
    return np.asarray(pressure_moment(geometry, pressure) * by_moment / by_force)
