"""The frame with what was measured drawn on it, for reports and for people who check."""

from __future__ import annotations

import textwrap

import cv2
import numpy as np

from rig.vision.lines import FloatArray
from rig.vision.measure import AngleMeasurement, FrameGeometry
from rig.vision.segment import Image

CONNECTOR = (255, 220, 60)  # BGR; cyan and orange differ for every kind of colour vision
CAP = (40, 150, 255)
MARKS = (90, 220, 90)
ARC = (255, 255, 255)
REJECTED = (70, 70, 235)
PANEL = (24, 22, 22)
SUBPIXEL = 4  # bits of the fixed-point coordinates that OpenCV draws with
COVERAGE_FACTOR = 2.0


def draw_overlay(image_bgr: Image, measurement: AngleMeasurement) -> Image:
    """Copy of `image_bgr` (h, w, 3) with edges, ruler marks, angle arc and the result in words.

    A rejected frame shows the outlines of what was found and the reason.
    """
    geometry = measurement.geometry
    if measurement.angle_deg is None or geometry.connector is None or geometry.cap is None:
        return draw_rejected(image_bgr, measurement.reason, geometry)
    canvas, line = _with_marks(image_bgr, geometry)
    for part, colour in ((geometry.connector, CONNECTOR), (geometry.cap, CAP)):
        for edge in part.edges:
            _polyline(canvas, edge, colour, line + 1)
    _arc(canvas, measurement.angle_deg, geometry.connector.edges, geometry.cap.edges, line)
    u95 = COVERAGE_FACTOR * measurement.u_deg
    _panel(canvas, f"{measurement.angle_deg:.2f} +- {u95:.2f} deg", ARC)
    return canvas


def draw_displacement(image_bgr: Image, geometry: FrameGeometry, words: str) -> Image:
    """Copy of `image_bgr` (h, w, 3) with both markers, the way between them and the result."""
    canvas, line = _with_marks(image_bgr, geometry)
    middles = []
    for part, colour in ((geometry.connector, CONNECTOR), (geometry.cap, CAP)):
        assert part is not None  # there is a result
        _polyline(canvas, part.outline, colour, line + 1, closed=True)
        middles.append(part.outline.mean(axis=0))
    _polyline(canvas, np.array(middles), ARC, line)
    _panel(canvas, words, ARC)
    return canvas


def draw_rejected(image_bgr: Image, reason: str, geometry: FrameGeometry | None = None) -> Image:
    """Copy of a rejected frame with the outlines of what was found and the reason."""
    found = geometry or FrameGeometry()
    canvas, line = _with_marks(image_bgr, found)
    for outline in found.candidates:
        _polyline(canvas, outline, REJECTED, line, closed=True)
    _panel(canvas, f"rejected: {reason}", REJECTED)
    return canvas


def _with_marks(image_bgr: Image, geometry: FrameGeometry) -> tuple[Image, int]:
    """A copy with the marks of the ruler, and how wide lines are in px."""
    canvas: Image = image_bgr.copy()
    size = max(canvas.shape[:2])
    line = max(1, round(size / 640))
    for mark in geometry.ruler_marks:
        _circle(canvas, mark, 0.011 * size, MARKS, line)
    return canvas, line


def _arc(
    canvas: Image,
    angle_deg: float,
    base: tuple[FloatArray, ...],
    tip: tuple[FloatArray, ...],
    line: int,
) -> None:
    """The angle at the cap, from the hanging axis (dashed) to the cap's normal."""
    along = base[0][1] - base[0][0]
    axis = np.array([-along[1], along[0]]) / np.hypot(*along)
    axis = axis if axis[1] > 0.0 else -axis
    edge = tip[0][1] - tip[0][0]
    # the side to which it bends: where the turned axis is square to the cap's edge
    sign = min((1.0, -1.0), key=lambda s: abs(float(_turned(axis, s * angle_deg) @ edge)))
    centre = np.mean([segment.mean(axis=0) for segment in tip], axis=0)
    reach = 0.1 * max(canvas.shape[:2])
    for start in np.arange(0.0, 1.0, 0.2):
        dash = centre + reach * np.outer([start, start + 0.11], axis)
        _polyline(canvas, dash, ARC, line)
    normal = _turned(axis, sign * angle_deg)
    _polyline(canvas, np.array([centre, centre + reach * normal]), CAP, line)
    turns = sign * np.linspace(0.0, angle_deg, max(2, int(abs(angle_deg))))
    arc = np.array([centre + 0.7 * reach * _turned(axis, turn) for turn in turns])
    _polyline(canvas, arc, ARC, line)


def _turned(vector: FloatArray, angle_deg: float) -> FloatArray:
    angle = np.radians(angle_deg)
    matrix = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned: FloatArray = matrix @ vector
    return turned


def _panel(canvas: Image, text: str, colour: tuple[int, int, int]) -> None:
    """Text on a dark strip along the bottom, where neither connector nor ruler corner is."""
    height, width = canvas.shape[:2]
    scale = max(0.4, max(height, width) / 1400)
    weight = max(1, round(2 * scale))
    (letter, tall), _ = cv2.getTextSize("m", cv2.FONT_HERSHEY_SIMPLEX, scale, weight)
    lines = textwrap.wrap(text, max(10, int(0.94 * width / (0.85 * letter)))) or [""]
    step = round(2.0 * tall)
    top = max(height - step * len(lines) - tall, 0)
    strip = canvas[top:]
    strip[:] = cv2.addWeighted(strip, 0.3, np.full_like(strip, PANEL), 0.7, 0.0)
    for index, words in enumerate(lines):
        origin = (round(0.02 * width), top + round(1.6 * tall) + index * step)
        cv2.putText(
            canvas, words, origin, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, weight, cv2.LINE_AA
        )


def _polyline(
    canvas: Image,
    points: FloatArray,
    colour: tuple[int, int, int],
    thickness: int,
    closed: bool = False,
) -> None:
    fixed = np.rint(points * 2**SUBPIXEL).astype(np.int32)
    cv2.polylines(canvas, [fixed], closed, colour, thickness, cv2.LINE_AA, SUBPIXEL)


def _circle(
    canvas: Image, centre: FloatArray, radius: float, colour: tuple[int, int, int], thickness: int
) -> None:
    place = np.rint(centre * 2**SUBPIXEL).astype(int)
    cv2.circle(
        canvas,
        (int(place[0]), int(place[1])),
        round(radius * 2**SUBPIXEL),
        colour,
        thickness,
        cv2.LINE_AA,
        SUBPIXEL,
    )
