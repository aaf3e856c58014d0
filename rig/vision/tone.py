"""Grey levels to light.

Lens blur mixes light, but a camera stores roughly its square root. In grey levels a bright edge
looks moved towards the dark, by more the stronger the contrast; in linear light the half-way
crossing is the edge. The exact tone curve of a camera is rarely known: the square is within a few
percent of sRGB and removes nearly all of the shift.
"""

from __future__ import annotations

import numpy as np

from rig.vision.lines import FloatArray


def to_light(levels: FloatArray) -> FloatArray:
    """Linear light of grey levels, both 0 to 255."""
    light: FloatArray = np.square(levels) / 255.0
    return light
