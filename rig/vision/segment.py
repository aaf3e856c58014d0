"""Rigid blue parts by colour: a coarse search on a decimated frame, then a full-size outline.

The rigid connector and the end cap are the only strongly blue things of the bench. Blueness is
linear in the pixel, B - (R + G) / 2, so that blur and noise act on it as on the light itself: a
grey background is zero at any brightness and the yellowish print is negative.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.vision.lines import FloatArray, median
from rig.vision.tone import to_light

Image = NDArray[np.uint8]
Mask = NDArray[np.uint8]

MIN_BLUENESS = 22.0  # grey levels: well above chroma noise of dark pixels
MIN_SATURATION = 0.2  # blueness over B: a bluish white wall or skylight glare stays out
COARSE_WIDTH = 320  # px: the search for parts needs no more
MIN_AREA = 60.0  # full-size px: smaller specks are noise
MAX_PARTS = 12
CLIPPED_LEVEL = 252  # of 255; a blue part clips in blue first
SEARCH_MARGIN = 2  # coarse pixels around a part that its full-size outline may reach


@dataclass(frozen=True)
class BluePart:
    """A connected blue region: outline (n, 2) in full-size pixels, ordered along the border."""

    outline: FloatArray
    area_px: float
    centroid: FloatArray
    box: tuple[int, int, int, int]  # left, top, right, bottom (exclusive)
    mask: Mask  # (h, w) 0 or 1 inside `window`
    window: tuple[int, int]  # left, top of the mask in the frame
    touches_border: bool
    blueness: float  # median, grey levels
    hue_deg: float  # of the median colour
    size: tuple[float, float]  # length and width of the smallest rectangle around it, px
    clipped_share: float  # share of its pixels with blue at the white level

    def contains(self, points: FloatArray) -> NDArray[np.bool_]:
        """Which of `points` (n, 2) px lie on the part."""
        column = np.rint(points[:, 0]).astype(int) - self.window[0]
        row = np.rint(points[:, 1]).astype(int) - self.window[1]
        height, width = self.mask.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        hit: NDArray[np.bool_] = np.zeros(len(points), dtype=np.bool_)
        hit[inside] = self.mask[row[inside], column[inside]] > 0
        return hit


def as_image(array: object) -> Image:
    """What OpenCV returns, typed as the 8-bit array that it is."""
    return np.asarray(array, dtype=np.uint8)


UNREADABLE = "the frame is no readable picture"
"""What is said of one that `decoded` gives nothing for."""


def decoded(coded: bytes) -> Image | None:
    """A coded picture, such as a camera's JPEG, as BGR; None where it is no readable one."""
    image = cv2.imdecode(np.frombuffer(coded, np.uint8), cv2.IMREAD_COLOR)
    return None if image is None else as_image(image)


def pyramid(image: Image) -> list[Image]:
    """The frame and its area-averaged halves, down to at least `COARSE_WIDTH` px wide."""
    levels = [image]
    while max(levels[-1].shape[:2]) >= 2 * COARSE_WIDTH and min(levels[-1].shape[:2]) >= 2:
        height, width = (length // 2 for length in levels[-1].shape[:2])
        even = levels[-1][: 2 * height, : 2 * width]
        levels.append(as_image(cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA)))
    return levels


def find_blue_parts(levels: list[Image]) -> list[BluePart]:
    """Blue parts of a BGR image, largest first; `levels` is its `pyramid`."""
    image, small, factor = levels[0], levels[-1], 2 ** (len(levels) - 1)
    coarse = _blueness(small)
    floor = cv2.convertScaleAbs(small[..., 0], alpha=MIN_SATURATION)
    mask = cv2.threshold(coarse, MIN_BLUENESS, 255, cv2.THRESH_BINARY)[1]
    mask = cv2.bitwise_and(mask, cv2.compare(coarse, floor, cv2.CMP_GT))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    order = 1 + np.argsort(-stats[1:, cv2.CC_STAT_AREA], kind="stable")[:MAX_PARTS]
    parts: list[BluePart] = []
    for label in order if count > 1 else ():
        if stats[label, cv2.CC_STAT_AREA] * factor**2 < MIN_AREA:
            break
        region = _padded(stats[label, :4].tolist(), small.shape)
        mine = labels[region] == label
        level = median(coarse[region][mine])
        part = _outline(image, mine.astype(np.uint8), region, factor, level)
        if part is not None:
            parts.append(part)
    return sorted(parts, key=lambda part: -part.area_px)


def find_blue_parts_within(image: Image, box: FloatArray) -> list[BluePart]:
    """Blue parts in a window of a BGR image; parts that the window cuts are cut.

    `box` (2, 2) is its low and its high corner in pixels; what of it is off the frame is left out.
    """
    height, width = image.shape[:2]
    left, top = np.floor(box[0]).astype(int).clip(0, [width, height])
    right, bottom = np.ceil(box[1]).astype(int).clip(0, [width, height]) + 1
    window = image[top:bottom, left:right]
    if min(window.shape[:2]) < 2:
        return []
    return [_moved(part, (int(left), int(top))) for part in find_blue_parts([window])]


def _moved(part: BluePart, by: tuple[int, int]) -> BluePart:
    """A part of a window in the pixels of the frame; at the border of the one or of the other."""
    shift = np.array(by, dtype=np.float64)
    return replace(
        part,
        outline=part.outline + shift,
        centroid=part.centroid + shift,
        box=(part.box[0] + by[0], part.box[1] + by[1], part.box[2] + by[0], part.box[3] + by[1]),
        window=(part.window[0] + by[0], part.window[1] + by[1]),
    )


def _blueness(image: Image) -> Image:
    """B - (R + G) / 2 in whole grey levels; zero where it is negative."""
    blue, green, red = cv2.split(image)
    return as_image(cv2.subtract(blue, cv2.addWeighted(green, 0.5, red, 0.5, 0.0)))


def _padded(box: list[int], shape: tuple[int, ...]) -> tuple[slice, slice]:
    left, top, width, height = box
    return (
        slice(max(top - SEARCH_MARGIN, 0), min(top + height + SEARCH_MARGIN, shape[0])),
        slice(max(left - SEARCH_MARGIN, 0), min(left + width + SEARCH_MARGIN, shape[1])),
    )


def _outline(
    image: Image, coarse: Mask, region: tuple[slice, slice], factor: int, level: float
) -> BluePart | None:
    """The part at full size: pixels above half its own blueness, the middle of its edges.

    Only pixels near the coarse part count, so that a close neighbour is not drawn in.
    """
    frame_height, frame_width = image.shape[:2]
    top, left = region[0].start * factor, region[1].start * factor
    near = cv2.dilate(coarse, np.ones((3, 3), np.uint8), iterations=SEARCH_MARGIN)
    near = np.repeat(np.repeat(near, factor, axis=0), factor, axis=1)
    window = image[top : top + near.shape[0], left : left + near.shape[1]]
    blueness = _blueness(window)
    mask = ((blueness > max(0.5 * level, MIN_BLUENESS)) & (near > 0)).astype(np.uint8)
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return None
    contour = max(contours, key=cv2.contourArea)
    # a contour runs through the centres of its pixels, half a pixel inside of the part
    area = float(cv2.contourArea(contour)) + 0.5 * cv2.arcLength(contour, True) + 1.0
    if area < MIN_AREA:
        return None
    points = contour[:, 0, :].astype(np.float64)
    body = np.zeros_like(mask)
    cv2.drawContours(body, [contour], -1, 1, thickness=cv2.FILLED)
    corner = np.array([left, top], dtype=np.float64)
    outline = points + corner
    low, high = outline.min(axis=0), outline.max(axis=0)
    moments = cv2.moments(contour)
    sides = sorted(cv2.minAreaRect(contour)[1])
    inside = window[body > 0]
    return BluePart(
        outline=outline,
        area_px=area,
        centroid=np.array([moments["m10"], moments["m01"]]) / moments["m00"] + corner,
        box=(int(low[0]), int(low[1]), int(high[0]) + 1, int(high[1]) + 1),
        mask=body,
        window=(left, top),
        touches_border=bool(
            low[0] <= 1 or low[1] <= 1 or high[0] >= frame_width - 2 or high[1] >= frame_height - 2
        ),
        blueness=level,
        hue_deg=_hue(np.array([median(channel) for channel in inside.T], dtype=np.float64)),
        size=(sides[1] + 1.0, sides[0] + 1.0),
        clipped_share=float((inside[:, 0] >= CLIPPED_LEVEL).mean()),
    )


def _hue(colour: FloatArray) -> float:
    """Hue in deg of a BGR colour; white light added to it, or taken away, does not change it."""
    blue, green, red = to_light(colour)
    return float(np.degrees(np.arctan2(np.sqrt(3.0) * (green - blue), 2.0 * red - green - blue)))
