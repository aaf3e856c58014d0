"""The right-angle ruler: its marks to a fraction of a pixel, and their places on the grid.

A white L carries round black marks: one in the corner, then one every pitch on both legs. The
orientation in the picture is free; the legs are numbered so that the rectified picture is not
mirrored.
"""

from __future__ import annotations

from cmath import phase
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import degrees

import cv2
import numpy as np

from rig.vision.errors import UntrustedFrameError
from rig.vision.lines import FloatArray
from rig.vision.segment import Image, as_image
from rig.vision.tone import to_light

WHITE_LEVEL = 0.55  # of the brightest parts: between mark and paper under any usual light
SURROUNDINGS = 0.1  # of the frame's height; wider than the ruler's mark, narrower than a reflex
DIMMER = 8.0  # grey levels below its surroundings that noise does not make white paper
MIN_HOLE_PX = 3.0  # diameter at search size: smaller dots have no centre worth measuring
MAX_HOLE_SHARE = 0.1  # of the frame's height
MIN_CIRCULARITY = 0.65  # 4 pi A / P^2 of a pixelated disc is about 0.8
STEP_TOLERANCE = 0.2  # of the step: perspective and lens change neighbouring steps much less
MIN_CORNER_DEG, MAX_CORNER_DEG = 60.0, 120.0
MAX_CANDIDATES = 80
LUMA = np.array([0.114, 0.587, 0.299])  # of B, G, R: what JPEG keeps at full resolution
PAPER = (1.25, 1.75)  # ring of white paper around a mark, in radii


Leg = dict[int, int]  # grid place on the leg (1, 2, ...) to index of the mark


@dataclass(frozen=True)
class RulerMarks:
    """Centres of the marks (n, 2) in distorted pixels and their grid places (n, 2), in pitches."""

    pixels: FloatArray
    grid: FloatArray


def find_ruler(levels: list[Image], marks: int) -> RulerMarks:
    """Marks of a ruler with `marks` on each leg; raises UntrustedFrameError without one.

    `levels` is the pyramid of the BGR frame. The corner, its neighbours and the outermost
    marks are needed; of the others each leg may miss one.
    """
    search = max(len(levels) - 2, 0)  # twice the size that is enough for the blue parts
    grey = as_image(cv2.cvtColor(levels[search], cv2.COLOR_BGR2GRAY))
    wanted, most = 2 * marks + 1, 0
    for bright in _bright_surfaces(grey):
        rough, diameters = _dark_holes(grey, bright)
        most = max(most, len(rough))
        legs = _legs(rough, marks) if len(rough) >= wanted - 2 else None
        if legs is not None:
            rough = (rough + 0.5) * 2**search - 0.5
            return _marks(levels[0], rough, diameters * 2**search, *legs)
    if most < wanted - 2:
        raise UntrustedFrameError(
            f"ruler not found: {most} round black marks on white where {wanted} are expected"
        )
    raise UntrustedFrameError(
        f"ruler not found: no right angle of {marks} evenly spaced marks on each leg "
        f"among {most} dark dots; is it hidden or another ruler?"
    )


def _marks(
    image: Image, rough: FloatArray, diameters: FloatArray, corner: int, first: Leg, second: Leg
) -> RulerMarks:
    """The marks of two legs, measured."""
    indices = [corner, *first.values(), *second.values()]
    grid = [(0, 0), *((k, 0) for k in first), *((0, k) for k in second)]
    radius = 0.5 * float(np.median(diameters[indices]))
    pixels = _centres(image, rough[indices], radius)
    return RulerMarks(pixels=pixels, grid=np.array(grid, dtype=np.float64))


def _bright_surfaces(grey: Image) -> Iterator[Image]:
    """Masks of what is white: in the whole frame, then, for uneven light, in its surroundings."""
    histogram = cv2.calcHist([grey], [0], None, [256], [0, 256]).ravel()
    brightest = int(np.searchsorted(np.cumsum(histogram), 0.995 * grey.size))
    yield as_image(cv2.threshold(grey, WHITE_LEVEL * brightest, 255, cv2.THRESH_BINARY)[1])
    block = 2 * round(0.5 * SURROUNDINGS * len(grey)) + 1
    if block > 1:
        mean = cv2.ADAPTIVE_THRESH_MEAN_C
        yield as_image(cv2.adaptiveThreshold(grey, 255, mean, cv2.THRESH_BINARY, block, DIMMER))


def _dark_holes(grey: Image, bright: Image) -> tuple[FloatArray, FloatArray]:
    """Centres (n, 2) and diameters (n,) in pixels of round holes in bright surfaces."""
    contours, tree = cv2.findContours(bright, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    centres: list[tuple[float, float]] = []
    diameters: list[float] = []
    for contour, (_, _, _, parent) in zip(contours, tree[0] if len(contours) else (), strict=True):
        if parent < 0 or len(contour) < np.pi * MIN_HOLE_PX:
            continue
        if len(contour) > np.pi * MAX_HOLE_SHARE * len(grey):
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
    points, sizes = np.array(centres), np.array(diameters)
    if len(points) > MAX_CANDIDATES:  # of a texture; nothing is as black on white as the marks
        order = np.argsort(-_depths(grey, points, sizes), kind="stable")[:MAX_CANDIDATES]
        points, sizes = points[order], sizes[order]
    return points, sizes


def _depths(grey: Image, points: FloatArray, sizes: FloatArray) -> FloatArray:
    """Light (n,) that is missing in holes, against the median on a ring around each."""
    turns = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    ring = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    around = points[:, None] + 0.5 * np.mean(PAPER) * sizes[:, None, None] * ring
    columns, rows = np.rint(np.concatenate([points[:, None], around], axis=1)).astype(int).T
    rows, columns = rows.clip(0, grey.shape[0] - 1), columns.clip(0, grey.shape[1] - 1)
    light = to_light(grey[rows, columns].astype(np.float64))  # (9, n)
    depths: FloatArray = np.median(light[1:], axis=0) - light[0]
    return depths


def _legs(points: FloatArray, marks: int) -> tuple[int, Leg, Leg] | None:
    """Corner and legs of the L with most marks, or None; legs turn clockwise in the picture.

    Only in the corner do two near marks stand at a right angle, so few walks are tried.
    """
    arms = points[None, :, :] - points[:, None, :]
    distance = np.hypot(arms[..., 0], arms[..., 1])
    np.fill_diagonal(distance, np.inf)
    places = [complex(*point) for point in points.tolist()]
    near = np.argsort(distance, axis=1, kind="stable")[:, :4]
    best: tuple[int, Leg, Leg] | None = None
    for corner, neighbours in enumerate(near.tolist()):
        for one, two in combinations(neighbours, 2):
            a, b = places[one] - places[corner], places[two] - places[corner]
            opening = degrees(phase(b * a.conjugate()))
            if not MIN_CORNER_DEG < abs(opening) < MAX_CORNER_DEG:
                continue
            first = _walk(points, corner, one, marks)
            second = _walk(points, corner, two, marks)
            if first is None or second is None:
                continue
            if best is None or len(first) + len(second) > len(best[1]) + len(best[2]):
                best = (corner, first, second) if opening > 0.0 else (corner, second, first)
    return best


def _walk(points: FloatArray, corner: int, neighbour: int, marks: int) -> Leg | None:
    """Follow evenly spaced marks from the corner; None unless exactly one leg is walked."""
    leg: Leg = {1: neighbour}
    step = points[neighbour] - points[corner]
    place, here = 1, points[neighbour]
    while place <= marks:
        for stride in (1, 2):  # one mark may be hidden
            miss = ((points - here - stride * step) ** 2).sum(axis=1)
            found = int(miss.argmin())
            if miss[found] < STEP_TOLERANCE**2 * float(step @ step):
                step = (points[found] - here) / stride
                place, here = place + stride, points[found]
                leg[place] = found
                break
        else:
            break
    return leg if max(leg) == marks and len(leg) >= marks - 1 else None


def _centres(image: Image, rough: FloatArray, radius: float) -> FloatArray:
    """Centroids (n, 2) of the light that each mark takes away; even blur does not move them.

    The paper around gives the white level as a plane, so that a light gradient does not pull; on
    a ring about the mark its three terms are orthogonal.
    """
    inner, outer = PAPER[0] * radius + 1.0, PAPER[1] * radius + 1.0
    reach = int(np.ceil(outer))
    steps = np.arange(-reach, reach + 1)
    middle = np.rint(rough).astype(int)
    rows = np.clip(middle[:, 1, None] + steps, 0, image.shape[0] - 1)
    columns = np.clip(middle[:, 0, None] + steps, 0, image.shape[1] - 1)
    patches = image[rows[:, :, None], columns[:, None, :]]  # (n, k, k, 3)
    light = to_light(patches.reshape(-1, 3) @ LUMA).reshape(patches.shape[:3])
    x = (columns - rough[:, 0, None])[:, None, :]
    y = (rows - rough[:, 1, None])[:, :, None]
    away = x**2 + y**2
    paper = (away > inner**2) & (away < outer**2)
    weight = paper / np.maximum(paper.sum(axis=(1, 2), keepdims=True), 1)
    level = (weight * light).sum(axis=(1, 2), keepdims=True)
    white = weight * (light - level)
    slope_x = (white * x).sum(axis=(1, 2), keepdims=True)
    slope_y = (white * y).sum(axis=(1, 2), keepdims=True)
    spread = 0.5 * (weight * away).sum(axis=(1, 2), keepdims=True)
    plane = level + (slope_x * x + slope_y * y) / np.maximum(spread, 1.0)
    missing = 1.0 - light / np.maximum(plane, 1.0)
    missing[away > inner**2] = 0.0
    down, across = missing.sum(axis=2), missing.sum(axis=1)
    total = np.maximum(down.sum(axis=1), 1.0)
    pull = [(across * x[:, 0]).sum(axis=1), (down * y[:, :, 0]).sum(axis=1)]
    centres: FloatArray = rough + np.stack(pull, axis=1) / total[:, None]
    return centres
