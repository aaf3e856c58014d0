"""The bending angle between two ArUco markers, one on the connector, one on the end cap.

In-plane geometry alone: each of the four sides of one marker is laid on the same side of the other
in the plane of the picture. A marker's own pose, which flips where it is seen head-on, is never
asked for.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rig.spec.calibration import CameraCalibration, RulerCalibration
from rig.vision.errors import UntrustedFrameError
from rig.vision.lines import FloatArray
from rig.vision.markers import both, everywhere, find_markers
from rig.vision.measure import (
    AngleMeasurement,
    FrameGeometry,
    Limits,
    PartGeometry,
    Side,
)
from rig.vision.plane import PicturePlane, rectify, require_picture
from rig.vision.ruler import find_ruler
from rig.vision.segment import Image, pyramid

CORNER_U_PX = 0.06
"""Standard uncertainty of a corner across a side, seen on rendered markers."""


@dataclass(frozen=True)
class MarkerAngleMeter:
    """Measures the turn from the marker `fixed` to the marker `moving` (names in 4X4_50).

    Their sides are parallel, as printed, when the actuator is straight; `mounting_u_deg` says how
    well they were glued. Camera, ruler and `bends` are those of `AngleMeter`.
    """

    camera: CameraCalibration | None = None
    ruler: RulerCalibration | None = None
    bends: Side = "left"
    fixed: int = 0
    moving: int = 1
    mounting_u_deg: float = 0.5
    unrectified_u_deg: float = 1.0
    limits: Limits = field(default_factory=Limits)

    def measure(self, image_bgr: Image) -> AngleMeasurement:
        """Bending angle in `image_bgr` (h, w, 3) uint8; raises VisionError as `AngleMeter` does."""
        require_picture(image_bgr, self.camera)
        try:
            return self._measured(image_bgr)
        except UntrustedFrameError as why:
            return AngleMeasurement(None, 0.0, 0.0, False, str(why), None, FrameGeometry())

    def _measured(self, image: Image) -> AngleMeasurement:
        corners = both(find_markers(image, *everywhere(image)), (self.fixed, self.moving))
        plane, marks = PicturePlane(self.camera), np.empty((0, 2))
        if self.ruler is not None:
            seen = find_ruler(pyramid(image), self.ruler.marks)
            plane, marks = rectify(self.camera, self.ruler, seen), seen.pixels
        sides = [_sides(plane.undistort(four)) for four in corners]
        turns = np.array([_turn(plane, *pair) for pair in zip(*sides, strict=True)])
        turns = turns[0] + (turns - turns[0] + np.pi) % (2 * np.pi) - np.pi
        # curling left turns the cap clockwise to the eye, which is positive in pixel axes
        turned = float(np.degrees(turns.mean())) * (1.0 if self.bends == "left" else -1.0)
        lowest, highest = self.limits.lowest_deg, self.limits.highest_deg
        spare = 0.5 * (360.0 - highest + lowest)
        angle = (turned - lowest + spare) % 360.0 + lowest - spare
        if not lowest <= angle <= highest:
            raise UntrustedFrameError(f"a bending angle of {angle:.0f} deg is not plausible")
        u = float(
            np.linalg.norm(
                [
                    np.degrees(turns.std(ddof=1) / np.sqrt(len(turns))),
                    *(np.degrees(CORNER_U_PX / _length(four)) for four in corners),
                    np.degrees(plane.u_turn(sides[0][0], sides[1][0])),
                    self.camera.angle_u_deg if self.camera else 0.0,
                    self.unrectified_u_deg if plane.rectification is None else 0.0,
                    self.mounting_u_deg,
                ]
            )
        )
        if u > self.limits.max_u_deg:
            raise UntrustedFrameError(f"the angle would be uncertain by {u:.1f} deg")
        connector, cap = (PartGeometry(four, (four[:2], four[3:1:-1])) for four in corners)
        return AngleMeasurement(
            angle,
            u,
            1.0 - u / self.limits.max_u_deg,
            True,
            "",
            plane.scale_mm_per_px(0.5 * (corners[0].mean(axis=0) + corners[1].mean(axis=0))),
            FrameGeometry(connector, cap, (), marks),
        )


def _sides(corners: FloatArray) -> list[FloatArray]:
    """Of a marker with corners (4, 2), each (2, 2): upper, lower, left and right."""
    return [corners[[0, 1]], corners[[3, 2]], corners[[0, 3]], corners[[1, 2]]]


def _turn(plane: PicturePlane, one: FloatArray, other: FloatArray) -> float:
    """Turn in rad from one side (2, 2) to another in the plane, their ends told apart.

    In the plane a line has no ends; they are told by the picture, in which turns are nearly right.
    """
    along, across = one[1] - one[0], other[1] - other[0]
    seen = np.arctan2(along[0] * across[1] - along[1] * across[0], float(along @ across))
    return float(seen + (plane.turn(one, other) - seen + np.pi / 2) % np.pi - np.pi / 2)


def _length(corners: FloatArray) -> float:
    """Mean length in px of the sides of a marker."""
    return float(np.mean([np.hypot(*(side[1] - side[0])) for side in _sides(corners)]))
