"""Views of a flat target with named places, of which a film holds many that are alike."""

from __future__ import annotations

import numpy as np

from rig.vision.lines import FloatArray

SAME_SHARE = 0.02
"""Of the picture's width: a target that has moved less is seen no differently."""


def alike(
    places: FloatArray,
    pixels: FloatArray,
    other_places: FloatArray,
    other_pixels: FloatArray,
    width: int,
) -> bool:
    """Whether a target has hardly moved between two views: places and pixels (n, 2) of each.

    Errors of lens and marks are the same in views that are alike; they must not be counted as
    independent.
    """
    before = {tuple(place): pixel for place, pixel in zip(places, pixels, strict=True)}
    moved = [
        np.hypot(*(pixel - before[tuple(place)]))
        for place, pixel in zip(other_places, other_pixels, strict=True)
        if tuple(place) in before
    ]
    return bool(moved) and float(np.mean(moved)) < SAME_SHARE * width
