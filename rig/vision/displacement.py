"""Linear displacement between two ArUco markers, one at each end of an actuator.

In-plane geometry alone: a marker's place is where its diagonals cross, which perspective leaves in
the middle, mapped through lens and ruler. A marker's own pose is never asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from rig.spec.calibration import CameraCalibration, RulerCalibration
from rig.vision.errors import UntrustedFrameError
from rig.vision.lines import FloatArray
from rig.vision.motion import ConstantVelocity, require_later
from rig.vision.plane import PicturePlane, rectify, require_picture
from rig.vision.ruler import find_ruler
from rig.vision.segment import Image, pyramid

PLACE_U_PX = 0.08
"""Standard uncertainty of a marker's place, seen on rendered films with motion blur."""
START_RATE_PX_S = 3000.0
ACCELERATION_PX_S2 = 60_000.0
GATE_SIGMAS = 5.0
LOST_AFTER_S = 0.25
FIXED_MOVE_PX = 1.0
"""If the marker at the fixed end has moved by more, so has the camera."""
MARGIN_SIDES = 2.0
"""Around a marker its detection needs white and the border of a picture at some distance, in
sides: with less it is not found in a window of its own."""


@dataclass(frozen=True)
class DisplacementMeasurement:
    """One frame's displacement, or why there is none."""

    displacement_mm: float | None
    """Of the moving marker from the fixed one, along their line in the first frame, since then."""
    u_mm: float
    """Standard uncertainty; 0 when rejected."""
    accepted: bool
    reason: str


class DisplacementTracker:
    """Follows the marker `moving` past the marker `fixed` (names in OpenCV's 4X4_50).

    Markers should be 30 px wide or more.

    The first frame in which both and the ruler are seen is the zero and gives the plane.
    """

    def __init__(
        self,
        camera: CameraCalibration | None,
        ruler: RulerCalibration,
        fixed: int = 0,
        moving: int = 1,
    ) -> None:
        self._camera = camera
        self._ruler = ruler
        self._names = (fixed, moving)
        self._zero: _Zero | None = None
        self._track: _Track | None = None

    def measure(self, image_bgr: Image, time_s: float) -> DisplacementMeasurement:
        """Displacement at `time_s`, which must grow.

        Raises VisionError for times that do not, and for what is no picture of the camera.
        """
        require_picture(image_bgr, self._camera)
        if self._track is not None:
            require_later(time_s, self._track.time_s)
        try:
            return self._measured(image_bgr, time_s)
        except UntrustedFrameError as why:
            return DisplacementMeasurement(None, 0.0, False, str(why))

    def _measured(self, image: Image, time_s: float) -> DisplacementMeasurement:
        track = self._track
        if track is not None and time_s - track.time_s > LOST_AFTER_S:
            track = None
        expected = None if track is None else track.predicted(time_s)
        corners = self._corners(image, expected)
        fixed, moving = (_crossing(four) for four in corners)
        if expected is not None:
            _require_near(moving, expected)
        if self._zero is None:
            levels = pyramid(image)
            plane = rectify(self._camera, self._ruler, find_ruler(levels, self._ruler.marks))
            start, end = plane.places_mm(np.stack([fixed, moving]))
            self._zero = _Zero(plane, fixed, end - start)
        if np.hypot(*(fixed - self._zero.fixed_px)) > FIXED_MOVE_PX:
            raise UntrustedFrameError("the marker at the fixed end has moved: so has the camera")
        side = float(np.hypot(*(corners[1][1] - corners[1][0])))
        state = (
            ConstantVelocity.begun(moving, np.full(2, PLACE_U_PX), np.full(2, START_RATE_PX_S))
            if expected is None
            else expected.updated(moving, np.full(2, PLACE_U_PX))
        )
        self._track = _Track(state, time_s, side)
        displacement, u = self._zero.displacement(fixed, moving, self._ruler)
        return DisplacementMeasurement(displacement, u, True, "")

    def _corners(self, image: Image, expected: ConstantVelocity | None) -> list[FloatArray]:
        """Corners (4, 2) px of both markers: sought where they are expected, then everywhere."""
        found: dict[int, FloatArray] = {}
        if expected is not None and self._zero is not None and self._track is not None:
            side = self._track.side_px
            reach = side * (0.5 + MARGIN_SIDES)
            moved = GATE_SIGMAS * float(expected.u.max())
            found |= _markers(image, self._zero.fixed_px, reach)
            found |= _markers(image, expected.values, reach + moved)
        if any(name not in found for name in self._names):
            everywhere = 0.5 * np.array(image.shape[1::-1]), float(max(image.shape))
            found = _markers(image, *everywhere) | found
        missing = [str(name) for name in self._names if name not in found]
        if missing:
            raise UntrustedFrameError(f"marker {' and '.join(missing)} not found: hidden, blurred?")
        return [found[name] for name in self._names]


@dataclass(frozen=True)
class _Zero:
    """What the first frame gives."""

    plane: PicturePlane
    fixed_px: FloatArray
    apart_mm: FloatArray  # (2,) from the fixed to the moving marker

    def displacement(
        self, fixed: FloatArray, moving: FloatArray, ruler: RulerCalibration
    ) -> tuple[float, float]:
        """Displacement and standard uncertainty in mm."""
        start, end = self.plane.places_mm(np.stack([fixed, moving]))
        along = self.apart_mm / np.hypot(*self.apart_mm)
        displacement = float((end - start - self.apart_mm) @ along)
        scale = self.plane.scale_mm_per_px(moving)
        assert scale is not None
        # two markers, in this frame and in the first one
        places = 2.0 * PLACE_U_PX * scale
        return displacement, float(np.hypot(places, displacement * ruler.pitch_u / ruler.pitch))


@dataclass(frozen=True)
class _Track:
    """Where the moving marker was, and how large it is."""

    state: ConstantVelocity
    time_s: float
    side_px: float

    def predicted(self, time_s: float) -> ConstantVelocity:
        return self.state.predicted(time_s - self.time_s, np.full(2, ACCELERATION_PX_S2))


def _require_near(moving: FloatArray, expected: ConstantVelocity) -> None:
    apart = float(np.hypot(*(moving - expected.values)))
    allowed = GATE_SIGMAS * float(np.hypot(expected.u.max(), PLACE_U_PX))
    if apart > allowed:
        raise UntrustedFrameError(
            f"the moving marker jumps to {apart:.0f} px from where it is expected, give or take "
            f"{allowed:.0f} px"
        )


def _markers(image: Image, middle: FloatArray, reach: float) -> dict[int, FloatArray]:
    """Corners (4, 2) px by name of the markers in a window about `middle` (2,)."""
    high_limit = np.array(image.shape[1::-1])
    low = np.floor(middle - reach).astype(int).clip(0, high_limit)
    high = np.ceil(middle + reach).astype(int).clip(0, high_limit)
    window = image[low[1] : high[1], low[0] : high[0]]
    if min(window.shape[:2]) < 8:
        return {}
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    # cells of a few pixels: their rims, blurred, tell nothing of their colour
    parameters.perspectiveRemoveIgnoredMarginPerCell = 0.3
    parameters.adaptiveThreshWinSizeMax = 53
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    detector = cv2.aruco.ArucoDetector(dictionary, parameters)
    corners, names, _ = detector.detectMarkers(cv2.cvtColor(window, cv2.COLOR_BGR2GRAY))
    if names is None:
        return {}
    return {
        int(name): four.reshape(4, 2).astype(np.float64) + low
        for name, four in zip(names.ravel(), corners, strict=True)
    }


def _crossing(corners: FloatArray) -> FloatArray:
    """Where the diagonals of a quadrilateral (4, 2) cross."""
    one, other = corners[2] - corners[0], corners[3] - corners[1]
    share = np.linalg.solve(np.stack([one, -other], axis=1), corners[1] - corners[0])
    middle: FloatArray = corners[0] + share[0] * one
    return middle
