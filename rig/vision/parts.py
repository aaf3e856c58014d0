"""What a picture itself tells of the uncertainty of a length, a curvature or an angle read from it.

Only what the picture tells: what calibrations add to it is in `rig.validate.picture_budget`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig.vision.lines import FloatArray

SMALL_RAD = 1e-4
"""A lean by which derivatives are taken."""


@dataclass(frozen=True)
class SeenParts:
    """Standard uncertainties in the unit of what was read, and what moves it."""

    scatter_u: float
    """Type A: of what was fitted, from its residuals."""
    scatter_dof: float
    marks_u: float
    """Type A: of the plane, from the residuals of the ruler's marks."""
    marks_dof: float
    pixel_u: float
    """Type B: an edge or a corner is found a little off, alike wherever it looks alike."""
    scale: float
    """Change by a relative change of the scale: the value of a length, zero for an angle."""
    shear: float
    """Change by a lean of the ruler's second leg, per rad."""
    lens: float
    """Change by a lens that turns directions, per rad. It strains lengths by about as much: both
    are entries of the gradient of one distortion."""
    distance_mm: float
    """Of the camera: a thing that stands before the ruler's plane by one part of it looks larger
    by as much."""


def sheared(places: FloatArray, lean_rad: float) -> FloatArray:
    """Places (..., 2) in a plane whose second leg leans towards the first."""
    return places + lean_rad * np.stack([places[..., 1], np.zeros(places.shape[:-1])], axis=-1)
