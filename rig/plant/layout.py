"""Where things stand before the camera: frame, connector, actuator and right-angle ruler.

The actuator hangs: the profile's +x points down, its +z to the right, so that it curls left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rig.mechanics.outline import FLAG_PAPER
from rig.mechanics.response import SideProfile
from rig.plant.errors import SceneError
from rig.plant.optics import Array, Projection
from rig.spec.actuator import Geometry
from rig.spec.calibration import RulerCalibration
from rig.spec.measurand import Deformation

ProfileFunction = Callable[[Geometry, float], SideProfile]
"""Side profile of a geometry at a bending angle in rad or an elongation in m."""

RULER_WIDTH = 0.012
MARK_DIAMETER = 0.003
RANGES: dict[Deformation, tuple[float, float]] = {
    "bending": (np.deg2rad(-10.0), np.deg2rad(150.0)),
    "elongation": (-0.002, 0.024),
}
"""Bending angles in rad or elongations in m at which all of an actuator must be in the picture."""

_PAPER = FLAG_PAPER / 2 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
_VISIBLE_FRAME = 0.08  # of the height of the view
_MARGIN = 0.035  # kept free along the borders of the picture, of the height of the view
_CLEARANCE = 0.004  # between the actuator and the ruler, metres


@dataclass(frozen=True)
class Layout:
    """Places in the bench plane, metres, x right and y down."""

    origin: tuple[float, float]
    """Of the side profile: where the cavity begins on the revolving axis."""
    frame_edge: float
    """y of the lower edge of the frame, where the connector hangs."""
    ruler_corner: tuple[float, float]
    """Centre of the ruler's corner mark; one leg points up, the other to the right."""
    ruler_lean: float = 0.0
    """By how many rad the angle between the legs is less than a right one."""

    def place(self, outline: Array) -> Array:
        """Bench coordinates (n, 2) of a profile outline (n, 2) of x along the axis and z."""
        return outline[:, ::-1] + self.origin


def ruler_outline(corner: tuple[float, float], ruler: RulerCalibration) -> Array:
    """The ruler's L (6, 2) in bench metres."""
    half = RULER_WIDTH / 2
    leg = ruler.marks * ruler.pitch
    x, y = corner
    return np.array(
        [
            (x - half, y + half),
            (x - half, y - leg - half),
            (x + half, y - leg - half),
            (x + half, y - half),
            (x + leg + half, y - half),
            (x + leg + half, y + half),
        ]
    )


def mark_centres(corner: tuple[float, float], ruler: RulerCalibration, lean: float = 0.0) -> Array:
    """Centres (2 marks + 1, 2) in bench metres: the corner, then upwards, then to the right.

    The upright leg leans by `lean` rad towards the other one.
    """
    steps = np.arange(1, ruler.marks + 1) * ruler.pitch
    offsets = np.zeros((2 * ruler.marks + 1, 2))
    offsets[1 : ruler.marks + 1, 0] = np.tan(lean) * steps
    offsets[1 : ruler.marks + 1, 1] = -steps
    offsets[ruler.marks + 1 :, 0] = steps
    return offsets + corner


def lay_out(
    geometry: Geometry,
    ruler: RulerCalibration,
    projection: Projection,
    profile: ProfileFunction,
) -> Layout:
    """Place frame, actuator and ruler so that the camera sees all of them over their `RANGES`.

    Raises SceneError if they do not fit into the picture.
    """
    left, top, right, bottom = projection.view()
    height = bottom - top
    margin = _MARGIN * height
    sweep = _swept_outlines(geometry, profile)
    points = np.concatenate(sweep)[:, ::-1]
    low, high = points.min(axis=0), points.max(axis=0)
    leg = ruler.marks * ruler.pitch + RULER_WIDTH
    spare = (right - left) - 2 * margin - (high[0] - low[0]) - _CLEARANCE - leg
    # A third of the spare width left of the actuator, between it and the ruler, and at the right.
    gap = max(spare, 0.0) / 3
    frame_edge = top + _VISIBLE_FRAME * height
    origin_x = left + margin + gap - low[0]
    ruler_left = origin_x + high[0] + _CLEARANCE + gap
    middle = 0.5 * (frame_edge + bottom)
    layout = Layout(
        origin=(float(origin_x), float(frame_edge - low[1])),
        frame_edge=float(frame_edge),
        ruler_corner=(
            float(ruler_left + RULER_WIDTH / 2),
            float(middle + leg / 2 - RULER_WIDTH / 2),
        ),
    )
    _require_in_view("the actuator", [layout.place(o) for o in sweep], projection)
    outline = ruler_outline(layout.ruler_corner, ruler)
    _require_in_view("the right-angle ruler", [outline], projection)
    if outline[:, 1].min() < frame_edge:
        raise SceneError(
            f"The right-angle ruler does not fit below the frame: its legs are {leg * 1e3:.4g} mm "
            f"long and {(bottom - frame_edge) * 1e3:.4g} mm are seen. Reduce 'marks' or 'pitch' in "
            "the ruler calibration or increase 'virtual.optics.distance' in the bench file."
        )
    return layout


def _swept_outlines(geometry: Geometry, profile: ProfileFunction) -> list[Array]:
    outlines = []
    for deformation in np.linspace(*RANGES[geometry.deformation], 17):
        shape = profile(geometry, float(deformation))
        outlines += [shape.connector, *shape.soft, shape.end_cap]
        if shape.flags is not None:
            outlines += [centre + _PAPER for centre in shape.flags]
    return outlines


def _require_in_view(what: str, outlines: list[Array], projection: Projection) -> None:
    pixels = projection.project(np.concatenate(outlines))
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    if low.min() < 0 or high[0] > projection.width - 1 or high[1] > projection.height - 1:
        raise SceneError(
            f"The virtual camera does not see all of {what}: it reaches from "
            f"({low[0]:.0f}, {low[1]:.0f}) to ({high[0]:.0f}, {high[1]:.0f}) in a picture of "
            f"{projection.width} x {projection.height} pixels. Increase "
            "'virtual.optics.distance' in the bench file, or use a camera calibration with a "
            "shorter focal length."
        )
