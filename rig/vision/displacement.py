"""Linear displacement between two ArUco markers, one at each end of an actuator.

In-plane geometry alone: a marker's place is where its diagonals cross, which perspective leaves in
the middle, mapped through lens and ruler. A marker's own pose is never asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rig.spec.calibration import CameraCalibration, RulerCalibration
from rig.vision.errors import UntrustedFrameError
from rig.vision.lines import FloatArray
from rig.vision.markers import both, everywhere, find_markers
from rig.vision.measure import FrameGeometry, PartGeometry
from rig.vision.motion import ConstantVelocity, require_later
from rig.vision.parts import SMALL_RAD, SeenParts, sheared
from rig.vision.plane import PicturePlane, rectify, require_picture
from rig.vision.ruler import find_ruler
from rig.vision.segment import Image, pyramid

PLACE_U_PX = 0.08
"""Of a marker's place, for the gate: how far it may be from where it is expected."""
PIXEL_U_PX = 0.06
"""Standard uncertainty of a marker's place that its four corners share, as they lie alike in their
pixels: seen on rendered films. At rest it is the same in every frame."""
SQUARE_DOF = 4
"""Of eight coordinates of corners place, turn and size of a square take four."""
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
    parts: SeenParts | None
    """Of its uncertainty, in mm; None when rejected."""
    accepted: bool
    reason: str
    geometry: FrameGeometry = field(default_factory=FrameGeometry)
    """What was found, for overlays: markers and ruler."""


@dataclass(frozen=True)
class DisplacementMeter:
    """Measures displacements since a frame at rest, in any number of frames, without memory.

    The frame at rest gives the plane: camera and ruler must not move after it.
    """

    rest: Rest
    camera: CameraCalibration | None

    @classmethod
    def at_rest(
        cls,
        image_bgr: Image,
        camera: CameraCalibration | None,
        ruler: RulerCalibration,
        fixed: int = 0,
        moving: int = 1,
    ) -> DisplacementMeter:
        """The meter whose zero is what this frame shows of the markers (names in 4X4_50).

        Raises UntrustedFrameError where they or the ruler are not seen, VisionError for what is no
        picture of the camera.
        """
        require_picture(image_bgr, camera)
        corners = both(find_markers(image_bgr, *everywhere(image_bgr)), (fixed, moving))
        return cls(Rest.seen(image_bgr, corners, (fixed, moving), camera, ruler), camera)

    def measure(self, image_bgr: Image) -> DisplacementMeasurement:
        """Displacement in `image_bgr` (h, w, 3) uint8; raises VisionError as `at_rest`."""
        require_picture(image_bgr, self.camera)
        try:
            found = find_markers(image_bgr, *everywhere(image_bgr))
            return self.rest.measured(both(found, self.rest.names))
        except UntrustedFrameError as why:
            return DisplacementMeasurement(None, None, False, str(why))


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
        self._zero: Rest | None = None
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
            return DisplacementMeasurement(None, None, False, str(why))

    def _measured(self, image: Image, time_s: float) -> DisplacementMeasurement:
        track = self._track
        if track is not None and time_s - track.time_s > LOST_AFTER_S:
            track = None
        expected = None if track is None else track.predicted(time_s)
        corners = self._corners(image, expected)
        moving = _crossing(corners[1])
        if expected is not None:
            _require_near(moving, expected)
        if self._zero is None:
            self._zero = Rest.seen(image, corners, self._names, self._camera, self._ruler)
        measurement = self._zero.measured(corners)
        side = float(np.hypot(*(corners[1][1] - corners[1][0])))
        state = (
            ConstantVelocity.begun(moving, np.full(2, PLACE_U_PX), np.full(2, START_RATE_PX_S))
            if expected is None
            else expected.updated(moving, np.full(2, PLACE_U_PX))
        )
        self._track = _Track(state, time_s, side)
        return measurement

    def _corners(self, image: Image, expected: ConstantVelocity | None) -> list[FloatArray]:
        """Corners (4, 2) px of both markers: sought where they are expected, then everywhere."""
        found: dict[int, FloatArray] = {}
        if expected is not None and self._zero is not None and self._track is not None:
            side = self._track.side_px
            reach = side * (0.5 + MARGIN_SIDES)
            moved = GATE_SIGMAS * float(expected.u.max())
            found |= find_markers(image, self._zero.places_px[0], reach)
            found |= find_markers(image, expected.values, reach + moved)
        if any(name not in found for name in self._names):
            found = find_markers(image, *everywhere(image)) | found
        return both(found, self._names)


@dataclass(frozen=True)
class Rest:
    """What the frame at rest gives."""

    names: tuple[int, int]
    """Of the fixed and the moving marker."""
    plane: PicturePlane
    places_px: FloatArray
    """(2, 2) of both."""
    misfit: float
    """Of their corners, mm2."""
    marks_px: FloatArray
    """Of the ruler, (n, 2)."""

    @classmethod
    def seen(
        cls,
        image: Image,
        corners: Sequence[FloatArray],
        names: tuple[int, int],
        camera: CameraCalibration | None,
        ruler: RulerCalibration,
    ) -> Rest:
        """Of markers with these `corners` (4, 2) px; raises UntrustedFrameError without a ruler."""
        marks = find_ruler(pyramid(image), ruler.marks)
        plane = rectify(camera, ruler, marks)
        places = np.stack([_crossing(four) for four in corners])
        return cls(names, plane, places, _misfit(plane, corners), marks.pixels)

    def measured(self, corners: Sequence[FloatArray]) -> DisplacementMeasurement:
        """The displacement of markers with these corners, (4, 2) px each.

        Raises UntrustedFrameError if the fixed one has moved.
        """
        places = np.stack([_crossing(four) for four in corners])
        if np.hypot(*(places[0] - self.places_px[0])) > FIXED_MOVE_PX:
            raise UntrustedFrameError("the marker at the fixed end has moved: so has the camera")
        displacement, parts = self._displacement(places, corners)
        fixed, moving = (PartGeometry(four, (four[:2], four[3:1:-1])) for four in corners)
        geometry = FrameGeometry(fixed, moving, (), self.marks_px)
        return DisplacementMeasurement(displacement, parts, True, "", geometry)

    def _displacement(
        self, places_px: FloatArray, corners: Sequence[FloatArray]
    ) -> tuple[float, SeenParts]:
        """Displacement in mm and what the picture tells of its uncertainty.

        `places_px` (2, 2) are of the fixed and the moving marker, `corners` (4, 2) of each.
        """
        plane, rectification = self.plane, self.plane.rectification
        assert rectification is not None
        then_and_now = np.concatenate([self.places_px, places_px])
        here = plane.places_mm(then_and_now)
        displacement = float(self._along(here))
        scale = plane.scale_mm_per_px(places_px[1])
        assert scale is not None
        dof = 4 * SQUARE_DOF
        corner_u = np.sqrt((self.misfit + _misfit(plane, corners)) / dof)
        varied = self._along(plane.varied_places_mm(then_and_now))
        return (
            displacement,
            SeenParts(
                scatter_u=float(
                    corner_u
                ),  # a place is the mean of four corners, there are four places
                scatter_dof=dof,
                marks_u=rectification.u_of(varied[1:] - varied[0]),
                marks_dof=rectification.degrees_of_freedom,
                pixel_u=float(np.sqrt(2.0) * PIXEL_U_PX * scale),  # the moving marker, then and now
                scale=displacement,
                shear=float(self._along(sheared(here, SMALL_RAD)) - displacement) / SMALL_RAD,
                lens=displacement,
                distance_mm=plane.distance_mm(places_px[1]),
            ),
        )

    def _along(self, places_mm: FloatArray) -> FloatArray:
        """Displacement from places (..., 4, 2): fixed and moving marker, then and now."""
        then = places_mm[..., 1, :] - places_mm[..., 0, :]
        now = places_mm[..., 3, :] - places_mm[..., 2, :]
        moved: FloatArray = ((now - then) * then).sum(axis=-1) / np.hypot(
            then[..., 0], then[..., 1]
        )
        return moved


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


def _misfit(plane: PicturePlane, corners: Sequence[FloatArray]) -> float:
    """Sum of squares, mm2, by which the corners (4, 2) px of markers miss squares in the plane."""
    square = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    total = 0.0
    for four in corners:
        places = plane.places_mm(four) @ [1, 1j]
        places = places - places.mean()
        # in a plane that is seen mirrored the corners go round the other way
        fits = [abs(np.vdot(way, places)) ** 2 / 4 for way in (square, square.conj())]
        total += float((abs(places) ** 2).sum() - max(fits) / 2)
    return total


def _crossing(corners: FloatArray) -> FloatArray:
    """Where the diagonals of a quadrilateral (4, 2) cross."""
    one, other = corners[2] - corners[0], corners[3] - corners[1]
    share = np.linalg.solve(np.stack([one, -other], axis=1), corners[1] - corners[0])
    middle: FloatArray = corners[0] + share[0] * one
    return middle
