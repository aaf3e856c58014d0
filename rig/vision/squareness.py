"""How square and even a right-angle ruler is, from views of it through a calibrated lens.

Every view has a pose of its own; all share one leaning leg and one ratio of the legs' pitches. A
tilted view tells a lean from perspective, a square one alone could not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares

from rig.spec.calibration import CameraCalibration
from rig.vision.errors import UntrustedFrameError, VisionError
from rig.vision.lines import FloatArray
from rig.vision.plane import PicturePlane, require_picture
from rig.vision.ruler import RulerMarks, find_ruler
from rig.vision.segment import Image, pyramid
from rig.vision.views import alike

MIN_VIEWS = 4
MAX_RMS_PX = 0.5
_POSE = 6


@dataclass(frozen=True)
class RulerShape:
    """What views tell of a ruler."""

    lean_deg: float
    """By how much the angle between the legs is less than a right one."""
    ratio: float
    """Pitch of the second leg over that of the first."""
    covariance: FloatArray
    """(2, 2) of both, from the scatter of the marks."""
    degrees_of_freedom: int
    rms_px: float
    views: int

    @property
    def lean_u_deg(self) -> float:
        """Standard uncertainty of the lean."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def ratio_u(self) -> float:
        """Standard uncertainty of the ratio."""
        return float(np.sqrt(self.covariance[1, 1]))


def collect(
    pictures: Iterable[Image], camera: CameraCalibration, marks: int, wanted: int
) -> list[RulerMarks]:
    """Views of a ruler with `marks` on each leg, until there are `wanted`.

    Pictures without it are passed over, and such as are like one before. Raises VisionError for
    pictures that are not of the camera's mode.
    """
    views: list[RulerMarks] = []
    for picture in pictures:
        require_picture(picture, camera)
        try:
            view = find_ruler(pyramid(picture), marks)
        except UntrustedFrameError:
            continue
        if any(alike(view.grid, view.pixels, o.grid, o.pixels, camera.width) for o in views):
            continue
        views.append(view)
        if len(views) >= wanted:
            break
    return views


def fit_shape(camera: CameraCalibration, views: list[RulerMarks]) -> RulerShape:
    """Least squares over all views; raises VisionError for too few, and for a bad fit."""
    if len(views) < MIN_VIEWS:
        raise VisionError(
            f"The ruler was found in {len(views)} pictures that differ; expected {MIN_VIEWS} or "
            "more, tilted in different directions."
        )
    lens = PicturePlane(camera)
    focal = np.array([camera.focal_x, camera.focal_y])
    centre = np.array([camera.centre_x, camera.centre_y])
    seen = [(lens.undistort(view.pixels) - centre) / focal for view in views]
    grids = [view.grid for view in views]
    start = np.concatenate([[0.0, 0.0], *map(_pose, grids, seen)])

    def misses(values: FloatArray) -> FloatArray:
        poses = values[2:].reshape(-1, _POSE)
        every = [
            (_project(_leaning(grid, values[0], values[1]), pose) - points) * focal
            for grid, pose, points in zip(grids, poses, seen, strict=True)
        ]
        return np.concatenate(every).ravel()

    found = least_squares(misses, start, x_scale="jac")
    freedom = len(found.fun) - len(start)
    rms = float(np.sqrt(2.0 * np.mean(found.fun**2)))
    if not found.success or rms > MAX_RMS_PX:
        raise VisionError(
            f"The views miss one flat ruler by {rms:.2f} px; expected at most {MAX_RMS_PX:g}. Is "
            "it bent, or the camera's calibration of another lens?"
        )
    covariance = np.linalg.inv(found.jac.T @ found.jac) * float(found.fun @ found.fun) / freedom
    unit = np.array([np.degrees(1.0), 1.0])
    return RulerShape(
        lean_deg=float(np.degrees(found.x[0])),
        ratio=1.0 + float(found.x[1]),
        covariance=covariance[:2, :2] * np.outer(unit, unit),
        degrees_of_freedom=freedom,
        rms_px=rms,
        views=len(views),
    )


def _leaning(grid: FloatArray, lean: float, stretch: float) -> FloatArray:
    """Places (n, 2) of marks in pitches, the second leg leaning to the first and stretched."""
    x, y = grid.T
    y = y * (1.0 + stretch)
    return np.stack([x + y * np.sin(lean), y * np.cos(lean)], axis=1)


def _pose(grid: FloatArray, points: FloatArray) -> FloatArray:
    flat = np.column_stack([grid, np.zeros(len(grid))])
    _, turn, move = cv2.solvePnP(flat, points, np.eye(3), None)
    return np.concatenate([turn.ravel(), move.ravel()])


def _project(places: FloatArray, pose: FloatArray) -> FloatArray:
    rotation = np.asarray(cv2.Rodrigues(pose[:3])[0], dtype=np.float64)
    points = places @ rotation[:, :2].T + pose[3:]
    flat: FloatArray = points[:, :2] / points[:, 2:]
    return flat
