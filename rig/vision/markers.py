"""Where ArUco markers are in a picture."""

from __future__ import annotations

import cv2
import numpy as np

from rig.vision.errors import UntrustedFrameError
from rig.vision.lines import FloatArray
from rig.vision.segment import Image


def everywhere(image: Image) -> tuple[FloatArray, float]:
    """The window of `find_markers` that is the whole picture."""
    return 0.5 * np.array(image.shape[1::-1]), float(max(image.shape))


def both(found: dict[int, FloatArray], names: tuple[int, int]) -> list[FloatArray]:
    """Corners (4, 2) px of two markers; raises UntrustedFrameError for what was not found."""
    missing = [str(name) for name in names if name not in found]
    if missing:
        raise UntrustedFrameError(f"marker {' and '.join(missing)} not found: hidden, blurred?")
    return [found[name] for name in names]


def find_markers(image: Image, middle: FloatArray, reach: float) -> dict[int, FloatArray]:
    """Corners (4, 2) px by name of the markers in a window about `middle` (2,).

    Names are those of OpenCV's dictionary 4X4_50; corners go round from a marker's own upper left.
    """
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
