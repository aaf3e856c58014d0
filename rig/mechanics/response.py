"""What a mechanical model answers: the quasi-static response of an actuator to pressure.

The interface is the same for beam theory and finite elements; the virtual specimen is one too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Response:
    """Quasi-static response; every array has the shape (n,) of `pressure`, SI units.

    A quantity that the model cannot give is None.
    """

    model: str
    pressure: Array
    """Gauge pressure in Pa, ascending."""
    angle: Array
    """Bending angle between connector and end cap in rad, tip free."""
    displacement: Array
    """Length difference between bellow and bottom layer (bending) or elongation (linear) in m."""
    blocked_force: Array | None
    """Tip force in N when the tip is held at zero angle."""
    volume: Array
    """Volume of the cavity in m3, tip free."""
    max_von_mises: Array | None = None
    """Largest von Mises stress in Pa, tip free."""


@dataclass(frozen=True)
class SideProfile:
    """Outlines in the plane of bending, each (n, 2) in metres, closed without a repeated point.

    Coordinates: x along the undeformed axis away from the connector's soft-side face (x = -t),
    z from the bottom layer towards the crests; origin on the revolving axis where the cavity
    begins. Positive bending curls the tip towards -z.
    """

    connector: Array
    bellow: Array
    bottom_layer: Array
    end_cap: Array
