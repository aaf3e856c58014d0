"""The lens of a camera from views of a flat board, with the covariance of what was found.

Zhang, IEEE TPAMI 22 (2000) 1330, with the distortion of Brown (1971); k3 is held at zero. The
covariance is that of least squares with every view's pose eliminated, scaled by the residuals.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from rig.spec.calibration import CameraCalibration, Evidence, Fit, Provenance
from rig.vision.charuco import View
from rig.vision.errors import VisionError
from rig.vision.lines import FloatArray

NAMES = ("focal_x", "focal_y", "centre_x", "centre_y", "k1", "k2", "p1", "p2")
MIN_VIEWS = 5
MAX_RMS_PX = 1.0
"""Worse fits are of a board that is not flat, not as said, or of unsharp pictures."""
MAX_FOCAL_U = 0.02
"""Relative standard uncertainty of the focal lengths; head-on views alone leave far more."""
DRAWS = 40
"""Lenses drawn from the covariance to see what they make of angles."""
GRID = 9
"""Places along each border of the picture at which directions are compared."""
_SEED = 0


@dataclass(frozen=True)
class LensFit:
    """What views tell of a lens."""

    size: tuple[int, int]
    """Width and height of the pictures."""
    values: FloatArray
    """(8,) in the order of `NAMES`; focal lengths and centre in pixels."""
    covariance: FloatArray
    """(8, 8)"""
    residuals: tuple[FloatArray, ...]
    """Of every view, (n, 2) px, seen minus fitted."""
    pixels: tuple[FloatArray, ...]
    """Of every view, (n, 2) px, where they were seen."""
    degrees_of_freedom: int

    @property
    def rms_px(self) -> float:
        """Root mean square distance of corners from where the fit has them."""
        every = np.concatenate(self.residuals)
        return float(np.sqrt((every**2).sum(axis=1).mean()))

    @property
    def u(self) -> FloatArray:
        """(8,) standard uncertainties."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)

    def calibration(self, provenance: Provenance) -> CameraCalibration:
        """The fit as a calibration file has it."""
        focal_x, focal_y, centre_x, centre_y, k1, k2, p1, p2 = self.values.tolist()
        rows = tuple(
            (float(number), float(len(left)), float(np.sqrt((left**2).sum(axis=1).mean())))
            for number, left in enumerate(self.residuals, 1)
        )
        fit = Fit(
            model="Brown-Conrady, k3 = 0; focal lengths and centre in pixels",
            parameters=NAMES,
            values=tuple(self.values.tolist()),
            covariance=tuple(tuple(row) for row in self.covariance.tolist()),
            residuals=(),  # thousands; the rows tell their size view by view
            degrees_of_freedom=self.degrees_of_freedom,
        )
        return CameraCalibration(
            kind="calibration",
            instrument="camera",
            width=self.size[0],
            height=self.size[1],
            focal_x=focal_x,
            focal_y=focal_y,
            centre_x=centre_x,
            centre_y=centre_y,
            distortion=(k1, k2, p1, p2, 0.0),
            angle_u_deg=float(np.degrees(angle_u(self))),
            provenance=provenance,
            evidence=Evidence(
                columns=("view", "corners", "rms_px"),
                rows=rows,
                fits=(fit,),
                findings={"rms_px": self.rms_px},
            ),
        )


def fit_lens(views: list[View], size: tuple[int, int]) -> LensFit:
    """Least squares over all views of pictures of `size` (width, height).

    Raises VisionError for too few views, and for views that no lens explains.
    """
    if len(views) < MIN_VIEWS:
        raise VisionError(
            f"The board was found in {len(views)} pictures; expected {MIN_VIEWS} at least, better "
            "20 to 30. Is it the board that was named, sharp, and mostly in the picture?"
        )
    boards = [_flat(view).astype(np.float32) for view in views]
    seen = [view.pixels.astype(np.float32) for view in views]
    try:
        _, matrix, distortion, turns, moves = cv2.calibrateCamera(
            boards, seen, size, None, None, flags=cv2.CALIB_FIX_K3
        )
    except cv2.error as error:
        raise VisionError(
            f"The lens cannot be found from these views ({' '.join(str(error).split())}); tilt "
            "the board differently in some."
        ) from None
    coefficients = np.asarray(distortion, dtype=np.float64).ravel()[:5]
    residuals: list[FloatArray] = []
    normal = np.zeros((len(NAMES), len(NAMES)))
    for view, turn, move in zip(views, turns, moves, strict=True):
        fitted, jacobian = cv2.projectPoints(_flat(view), turn, move, matrix, coefficients)
        residuals.append(view.pixels - fitted.reshape(-1, 2))
        slopes = np.asarray(jacobian, dtype=np.float64)
        normal += _told_of_the_lens(slopes[:, :6], slopes[:, 6 : 6 + len(NAMES)])
    freedom = 2 * sum(map(len, residuals)) - len(NAMES) - 6 * len(views)
    misfit = float(sum((left**2).sum() for left in residuals))
    values = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *coefficients[:4]]
    scale = np.diag(1.0 / np.sqrt(np.diag(normal)))  # pixels and distortions differ by 1e6
    try:
        covariance = scale @ np.linalg.inv(scale @ normal @ scale) @ scale * misfit / freedom
    except np.linalg.LinAlgError:
        covariance = np.full_like(normal, np.inf)
    u_focal = np.sqrt(np.abs(np.diag(covariance)[:2]))
    if not np.all(u_focal < MAX_FOCAL_U * np.array(values[:2])):
        raise VisionError(
            "The views do not tell the focal length from the distance: its standard uncertainty is "
            f"above {MAX_FOCAL_U:.0%}. Turn the board's face by 20 deg or more in some, left or "
            "right and up or down."
        )
    fit = LensFit(
        size,
        np.array(values, dtype=np.float64),
        covariance,
        tuple(residuals),
        tuple(view.pixels for view in views),
        freedom,
    )
    if fit.rms_px > MAX_RMS_PX:
        raise VisionError(
            f"The views miss the fitted lens by {fit.rms_px:.2f} px; expected at most "
            f"{MAX_RMS_PX:g}. Is the board flat, sharp, and of the size that was named?"
        )
    return fit


def _told_of_the_lens(pose: FloatArray, lens: FloatArray) -> FloatArray:
    """Normal matrix of the lens from one view's derivatives by its pose and by the lens."""
    across = pose.T @ lens
    told: FloatArray = lens.T @ lens - across.T @ np.linalg.lstsq(pose, lens, rcond=None)[0]
    return told


def angle_u(fit: LensFit) -> float:
    """Standard uncertainty in rad of directions in a plane whose perspective a ruler takes out.

    Lenses are drawn from the covariance. What each makes of one half of the picture, where the
    ruler is, is mapped on what the fitted lens makes of it by the best homography; directions in
    the other half, where the actuator is, are then turned by what is left.
    """
    rng = np.random.default_rng(_SEED)
    scale = np.sqrt(np.diag(fit.covariance))
    factor = np.linalg.cholesky(fit.covariance / np.outer(scale, scale))
    x, y = (np.linspace(0.0, length - 1.0, GRID) for length in fit.size)
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    truth = _ideal(fit.values, places)
    halves = [slice(GRID // 2 + 1), slice(GRID // 2, None)]
    squares = []
    for draw in rng.standard_normal((DRAWS, len(NAMES))):
        other = _ideal(fit.values + scale * (factor @ draw), places)
        for ruler, actuator in (halves, halves[::-1]):
            squares.append(_turn_square(other, truth, ruler, actuator))
    return float(np.sqrt(2.0 * np.mean(squares)))  # an angle is the difference of two directions


def _turn_square(other: FloatArray, truth: FloatArray, ruler: slice, actuator: slice) -> float:
    """Mean square turn in rad of grid lines in some columns, mapped by those of the ruler."""
    there, here = (grid.reshape(GRID, GRID, 2) for grid in (other, truth))
    homography = cv2.findHomography(
        there[:, ruler].reshape(-1, 1, 2), here[:, ruler].reshape(-1, 1, 2), 0
    )[0]
    mapped = cv2.perspectiveTransform(other[:, None], homography).reshape(GRID, GRID, 2)
    off = (mapped - here)[:, actuator]
    step = np.diff(here, axis=1)[:, :, 0].mean(), np.diff(here, axis=0)[..., 1].mean()
    turns = np.diff(off[..., 1], axis=1) / step[0], np.diff(off[..., 0], axis=0) / step[1]
    return float(np.mean([np.square(turn).mean() for turn in turns]))


def _ideal(values: FloatArray, pixels: FloatArray) -> FloatArray:
    """Undistorted places (n, 2), focal length one, of pixels (n, 2)."""
    focal_x, focal_y, centre_x, centre_y, k1, k2, p1, p2 = values.tolist()
    matrix = np.array([[focal_x, 0.0, centre_x], [0.0, focal_y, centre_y], [0.0, 0.0, 1.0]])
    ideal = cv2.undistortPoints(pixels.reshape(-1, 1, 2), matrix, np.array([k1, k2, p1, p2, 0.0]))
    return np.asarray(ideal, dtype=np.float64).reshape(-1, 2)


def _flat(view: View) -> FloatArray:
    return np.column_stack([view.board, np.zeros(len(view.board))])
