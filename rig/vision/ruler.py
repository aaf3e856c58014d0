"""The right-angle ruler: its marks to a fraction of a pixel, and their places on the grid.

A white L carries round black marks: one in the corner, then one every pitch on both legs. The
orientation in the picture is free; the legs are numbered so that the rectified picture is not
mirrored.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.vision.errors import UntrustedFrameError
from rig.vision.lines import FloatArray
from rig.vision.segment import Image
from rig.vision.tone import to_light

SEARCH_FACTOR = 2  # marks are looked for at half size
WHITE_LEVEL = 0.55  # of the brightest parts: between mark and paper under any usual light
MIN_HOLE_PX = 3.0  # diameter at search size: smaller dots have no centre worth measuring
MAX_HOLE_SHARE = 0.1  # of the frame's height
MIN_CIRCULARITY = 0.65  # 4 pi A / P^2 of a pixelated disc is about 0.8
STEP_TOLERANCE = 0.2  # of the step: perspective and lens change neighbouring steps much less
MIN_CORNER_DEG, MAX_CORNER_DEG = 60.0, 120.0
MAX_CANDIDATES = 80


@dataclass(frozen=True)
class RulerMarks:
    """Centres of the marks (n, 2) in distorted pixels and their grid places (n, 2), in pitches."""

    pixels: FloatArray
    grid: FloatArray


def find_ruler(image: Image, marks: int) -> RulerMarks:
    """Marks of a ruler with `marks` on each leg; raises UntrustedFrameError without one.

    The corner is needed, and all but one mark of each leg.
    """
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    rough, diameters = _dark_holes(grey)
    wanted = 2 * marks + 1
    if len(rough) < wanted - 2:
        raise UntrustedFrameError(
            f"ruler not found: {len(rough)} round black marks on white where {wanted} are expected"
        )
    legs = _legs(rough, marks)
    if legs is None:
        raise UntrustedFrameError(
            f"ruler not found: no right angle of {marks} evenly spaced marks on each leg "
            f"among {len(rough)} dark dots; is it hidden or another ruler?"
        )
    corner, first, second = legs
    indices = [corner, *first.values(), *second.values()]
    grid = [(0, 0), *((k, 0) for k in first), *((0, k) for k in second)]
    radius = 0.5 * float(np.median(diameters[indices]))
    pixels = np.array([_centre(grey, rough[i], radius) for i in indices])
    return RulerMarks(pixels=pixels, grid=np.array(grid, dtype=np.float64))


def _dark_holes(grey: NDArray[np.uint8]) -> tuple[FloatArray, FloatArray]:
    """Centres (n, 2) and diameters (n,) in pixels of round holes in bright surfaces."""
    height, width = grey.shape
    size = (max(width // SEARCH_FACTOR, 1), max(height // SEARCH_FACTOR, 1))
    small = cv2.resize(
        grey[: size[1] * SEARCH_FACTOR, : size[0] * SEARCH_FACTOR],
        size,
        interpolation=cv2.INTER_AREA,
    )
    histogram = cv2.calcHist([small], [0], None, [256], [0, 256]).ravel()
    brightest = int(np.searchsorted(np.cumsum(histogram), 0.995 * small.size))
    bright = cv2.threshold(small, WHITE_LEVEL * brightest, 255, cv2.THRESH_BINARY)[1]
    contours, tree = cv2.findContours(bright, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    centres: list[tuple[float, float]] = []
    diameters: list[float] = []
    for contour, (_, _, _, parent) in zip(contours, tree[0] if len(contours) else (), strict=True):
        if parent < 0 or len(contour) < np.pi * MIN_HOLE_PX:
            continue
        if len(contour) > np.pi * MAX_HOLE_SHARE * size[1]:
            continue
        area = cv2.contourArea(contour)
        perimeter = cv2.arcLength(contour, True)
        if 4.0 * np.pi * area < MIN_CIRCULARITY * perimeter**2:
            continue
        moments = cv2.moments(contour)
        centres.append((moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]))
        # a hole's contour runs on the bright pixels around it, half a pixel outside the hole
        diameters.append(2.0 * np.sqrt(area / np.pi) - 1.0)
    if not centres:
        return np.empty((0, 2)), np.empty(0)
    points = (np.array(centres) + 0.5) * SEARCH_FACTOR - 0.5
    sizes = np.array(diameters) * SEARCH_FACTOR
    if len(points) > MAX_CANDIDATES:  # a texture, not a ruler: keep the dots of a common size
        order = np.argsort(np.abs(sizes - np.median(sizes)), kind="stable")[:MAX_CANDIDATES]
        points, sizes = points[order], sizes[order]
    return points, sizes


Leg = dict[int, int]  # grid place on the leg (1, 2, ...) to index of the mark


def _legs(points: FloatArray, marks: int) -> tuple[int, Leg, Leg] | None:
    """Corner and legs of the L with most marks, or None; legs turn clockwise in the picture."""
    separation = points[None, :, :] - points[:, None, :]
    distance = np.hypot(separation[..., 0], separation[..., 1])
    np.fill_diagonal(distance, np.inf)
    best: tuple[int, Leg, Leg] | None = None
    for corner in range(len(points)):
        nearest = np.argsort(distance[corner], kind="stable")[:4]
        legs = [leg for n in nearest if (leg := _walk(points, corner, int(n), marks)) is not None]
        for i, one in enumerate(legs):
            for two in legs[i + 1 :]:
                a = points[max(one.items())[1]] - points[corner]
                b = points[max(two.items())[1]] - points[corner]
                cross, dot = float(a[0] * b[1] - a[1] * b[0]), float(a @ b)
                opening = abs(np.degrees(np.arctan2(cross, dot)))
                if not MIN_CORNER_DEG < opening < MAX_CORNER_DEG:
                    continue
                pair = (corner, one, two) if cross > 0.0 else (corner, two, one)
                if best is None or len(one) + len(two) > len(best[1]) + len(best[2]):
                    best = pair
    return best


def _walk(points: FloatArray, corner: int, neighbour: int, marks: int) -> Leg | None:
    """Follow evenly spaced marks from the corner; None unless exactly one leg is walked."""
    leg: Leg = {1: neighbour}
    step = points[neighbour] - points[corner]
    place, here = 1, points[neighbour]
    while place <= marks:
        for stride in (1, 2):  # one mark may be hidden
            guess = here + stride * step
            miss = np.hypot(*(points - guess).T)
            found = int(np.argmin(miss))
            if miss[found] < STEP_TOLERANCE * np.hypot(*step):
                step = (points[found] - here) / stride
                place, here = place + stride, points[found]
                leg[place] = found
                break
        else:
            break
    return leg if max(leg) == marks and len(leg) >= marks - 1 else None


def _centre(grey: NDArray[np.uint8], rough: FloatArray, radius: float) -> FloatArray:
    """Centroid of the missing light of one mark; even blur does not move it.

    The paper around gives the white level as a plane, so that a light gradient does not pull.
    """
    reach = int(np.ceil(radius + 4.0))
    column, row = round(float(rough[0])), round(float(rough[1]))
    top, left = max(row - reach, 0), max(column - reach, 0)
    patch = to_light(grey[top : row + reach + 1, left : column + reach + 1].astype(np.float64))
    y, x = np.mgrid[: patch.shape[0], : patch.shape[1]].astype(np.float64)
    x, y = x + left - rough[0], y + top - rough[1]
    away = np.hypot(x, y)
    paper = (away > radius + 2.0) & (away < radius + 4.0)
    terms = np.stack([np.ones(int(paper.sum())), x[paper], y[paper]], axis=1)
    plane = np.linalg.lstsq(terms, patch[paper], rcond=None)[0]
    missing = 1.0 - patch / np.maximum(plane[0] + plane[1] * x + plane[2] * y, 1.0)
    missing[away > radius + 2.0] = 0.0
    total = float(missing.sum())
    if total <= 0.0:
        return rough
    return rough + np.array([float((missing * x).sum()), float((missing * y).sum())]) / total
