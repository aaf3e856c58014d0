"""From distorted pixels to the plane of the picture: lens, then the plane of the ruler.

Straight lines stay straight in ideal (undistorted) pixels and under a homography, so edges are
fitted in ideal pixels and only their directions are taken into the plane. In-plane geometry is
used throughout: the pose of a plane seen head-on is ambiguous, its homography is not.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from rig.spec.calibration import CameraCalibration, RulerCalibration
from rig.vision.errors import UntrustedFrameError, VisionError
from rig.vision.lines import FloatArray
from rig.vision.ruler import RulerMarks
from rig.vision.segment import Image

MAX_RESIDUAL_PX = 1.0  # rms: worse marks are no plane grid, or belong to another ruler
MARK_FLOOR_PX = 0.02  # centroid noise assumed at least
GAUSS_NEWTON_STEPS = 2  # quadratic convergence from the linear solution, pixels away at most


def require_picture(image: Image, camera: CameraCalibration | None) -> None:
    """Raises VisionError for what is no 8-bit BGR picture, or not of the camera's mode."""
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or not image.size:
        raise VisionError(
            f"Expected a colour image of shape (height, width, 3) with 8 bits a channel, got "
            f"shape {image.shape} of {image.dtype}; convert it to 8-bit BGR first."
        )
    height, width = image.shape[:2]
    if camera and (camera.width, camera.height) != (width, height):
        raise VisionError(
            f"The image is {width}x{height}, but the camera calibration is for "
            f"{camera.width}x{camera.height}; use the calibration of this camera mode, or none."
        )


@dataclass(frozen=True)
class Rectification:
    """Homography from the ruler's plane to ideal pixels and what it is worth.

    Plane coordinates are in pitches, centred on the mean of the marks.
    """

    homography: FloatArray  # (3, 3), last entry 1
    covariance: FloatArray  # (8, 8) of the first eight entries
    residual_px: float
    degrees_of_freedom: float
    pitch_mm: float
    squareness_u_rad: float

    def varied(self) -> FloatArray:
        """Homographies (9, 3, 3): this one, and with each entry a little off; for `u_of`."""
        varied = np.repeat(self.homography[None], 9, axis=0)
        varied.reshape(9, 9)[1:, :8] += np.diag(self._steps)
        return varied

    def u_of(self, changes: FloatArray) -> float:
        """Standard uncertainty, from the marks, of what changes by (8,) in the `varied` planes."""
        gradient = changes / self._steps
        return float(np.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0)))

    @property
    def _steps(self) -> FloatArray:
        steps: FloatArray = 0.1 * np.sqrt(np.diag(self.covariance)) + 1e-15
        return steps


@dataclass(frozen=True)
class PicturePlane:
    """Maps points of a frame; without a camera no lens, without a ruler no rectification."""

    camera: CameraCalibration | None
    rectification: Rectification | None = None

    def undistort(self, pixels: FloatArray) -> FloatArray:
        """Ideal pixels (n, 2) of distorted ones (n, 2)."""
        if self.camera is None:
            return pixels
        matrix = _camera_matrix(self.camera)
        ideal = cv2.undistortPoints(
            np.ascontiguousarray(pixels).reshape(-1, 1, 2),
            matrix,
            np.array(self.camera.distortion, dtype=np.float64),
            P=matrix,
        )
        return np.asarray(ideal, dtype=np.float64).reshape(-1, 2)

    def turn(self, first: FloatArray, second: FloatArray) -> float:
        """Angle in rad, modulo pi, from the first to the second segment (2, 2) of ideal pixels.

        Positive turns from the picture's x axis to its y axis, clockwise to the eye.
        """
        return float(_turns(self._homographies(), first, second)[0])

    def u_turn(self, first: FloatArray, second: FloatArray) -> float:
        """Standard uncertainty of `turn`, rad, from marks and squareness of the ruler."""
        plane = self.rectification
        if plane is None:
            return 0.0
        turns = _turns(plane.varied(), first, second)
        marks = plane.u_of((turns[1:] - turns[0] + np.pi / 2) % np.pi - np.pi / 2)
        # A leg that leans by e shears the plane: directions d turn by e sin^2 d.
        here = self._homographies()
        lean = np.sin(_directions(here, second)[0]) ** 2 - np.sin(_directions(here, first)[0]) ** 2
        return float(np.hypot(marks, plane.squareness_u_rad * lean))

    def _homographies(self) -> FloatArray:
        """Plane to ideal pixels, (1, 3, 3); without a ruler they are the same."""
        if self.rectification is None:
            return np.eye(3)[None]
        return self.rectification.homography[None]

    def places_mm(self, pixels: FloatArray) -> FloatArray:
        """Places (n, 2) in mm in the plane of the ruler of distorted pixels (n, 2).

        x and y along the ruler's legs, from the mean of its marks; needs a ruler.
        """
        assert self.rectification is not None
        places = _to_plane(self._homographies(), self.undistort(pixels))[0]
        inside: FloatArray = self.rectification.pitch_mm * places
        return inside

    def varied_places_mm(self, pixels: FloatArray) -> FloatArray:
        """`places_mm` (9, n, 2) in each of the planes of `Rectification.varied`."""
        assert self.rectification is not None
        places = _to_plane(self.rectification.varied(), self.undistort(pixels))
        varied: FloatArray = self.rectification.pitch_mm * places
        return varied

    def distance_mm(self, pixel: FloatArray) -> float:
        """Of the camera from the plane at `pixel` (2,); infinite without a lens or a ruler."""
        scale = self.scale_mm_per_px(pixel)
        if self.camera is None or scale is None:
            return np.inf
        return scale * float(np.sqrt(self.camera.focal_x * self.camera.focal_y))

    def scale_mm_per_px(self, pixel: FloatArray) -> float | None:
        """Size of a pixel at `pixel` (2,), mm; None without a ruler."""
        if self.rectification is None:
            return None
        ideal = self.undistort(
            pixel[None] + np.array([[-0.5, 0.0], [0.5, 0.0], [0, -0.5], [0, 0.5]])
        )
        places = _to_plane(self._homographies(), ideal)[0]
        along, down = places[1] - places[0], places[3] - places[2]
        area = abs(float(along[0] * down[1] - along[1] * down[0]))
        return self.rectification.pitch_mm * float(np.sqrt(area))


def rectify(
    camera: CameraCalibration | None, ruler: RulerCalibration, marks: RulerMarks
) -> PicturePlane:
    """The plane of the ruler from its marks; raises UntrustedFrameError if they do not fit one.

    Least squares in the image, where the noise is; two legs with two marks each beside the
    corner would be enough, the rest gives the residual.
    """
    lens = PicturePlane(camera)
    pixels = lens.undistort(marks.pixels)
    grid = marks.grid - marks.grid.mean(axis=0)
    start = cv2.findHomography(grid, pixels, 0)[0]
    if start is None:
        raise UntrustedFrameError("ruler marks do not span a plane")
    parameters = (np.asarray(start, dtype=np.float64) / start[2, 2]).ravel()[:8]
    for _ in range(GAUSS_NEWTON_STEPS):
        predicted, jacobian = _project(parameters, grid)
        parameters = (
            parameters + _normal_inverse(jacobian) @ jacobian.T @ (pixels - predicted).ravel()
        )
    predicted, jacobian = _project(parameters, grid)
    freedom = 2 * len(grid) - 8
    misfit = float(((pixels - predicted) ** 2).sum())
    residual = float(np.sqrt(misfit / len(grid)))
    if not residual < MAX_RESIDUAL_PX:
        raise UntrustedFrameError(
            f"ruler marks miss a plane grid by {residual:.2f} px; is the ruler bent, or its "
            "calibration or the camera's for another one?"
        )
    variance = max(misfit / max(freedom, 1), MARK_FLOOR_PX**2)
    return PicturePlane(
        camera,
        Rectification(
            homography=np.append(parameters, 1.0).reshape(3, 3),
            covariance=variance * _normal_inverse(jacobian),
            residual_px=residual,
            degrees_of_freedom=float(max(freedom, 1)),
            pitch_mm=ruler.pitch * 1e3,
            squareness_u_rad=float(np.radians(ruler.squareness_u_deg)),
        ),
    )


def _camera_matrix(camera: CameraCalibration) -> FloatArray:
    return np.array(
        [
            [camera.focal_x, 0.0, camera.centre_x],
            [0.0, camera.focal_y, camera.centre_y],
            [0.0, 0.0, 1.0],
        ]
    )


def _project(parameters: FloatArray, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ideal pixels (n, 2) of plane points (n, 2), and the Jacobian (2n, 8)."""
    x, y = grid.T
    a, b, c, d, e, f, g, h = parameters
    depth = g * x + h * y + 1.0
    u, v = (a * x + b * y + c) / depth, (d * x + e * y + f) / depth
    zero, one = np.zeros_like(x), np.ones_like(x)
    rows_u = np.stack([x, y, one, zero, zero, zero, -u * x, -u * y], axis=1) / depth[:, None]
    rows_v = np.stack([zero, zero, zero, x, y, one, -v * x, -v * y], axis=1) / depth[:, None]
    jacobian = np.stack([rows_u, rows_v], axis=1).reshape(-1, 8)
    return np.stack([u, v], axis=1), jacobian


def _normal_inverse(jacobian: FloatArray) -> FloatArray:
    try:
        return np.asarray(np.linalg.inv(jacobian.T @ jacobian), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise UntrustedFrameError("ruler marks do not span a plane") from None


def _to_plane(homographies: FloatArray, ideal: FloatArray) -> FloatArray:
    """Plane points (m, n, 2) of ideal pixels (n, 2) under each homography (m, 3, 3)."""
    places = np.column_stack([ideal, np.ones(len(ideal))]) @ np.linalg.inv(homographies).mT
    flat: FloatArray = places[..., :2] / places[..., 2:]
    return flat


def _directions(homographies: FloatArray, segment: FloatArray) -> FloatArray:
    """Directions (m,) in rad of a segment (2, 2) in each plane."""
    ends = _to_plane(homographies, segment)
    along = ends[:, 1] - ends[:, 0]
    directions: FloatArray = np.arctan2(along[:, 1], along[:, 0])
    return directions


def _turns(homographies: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    turns: FloatArray = (
        _directions(homographies, second) - _directions(homographies, first)
    ) % np.pi
    return turns
