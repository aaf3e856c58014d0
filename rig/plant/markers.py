"""Printed patterns of black cells on white paper, as surfaces before a camera; metres."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from rig.plant.optics import Array
from rig.plant.scene import MARK_BLACK, MATTE_WHITE, Surface


def marker_surfaces(name: int, side: float, centre: Array) -> list[Surface]:
    """Marker `name` of OpenCV's dictionary 4X4_50, its black square `side` metres, on white."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    cells = np.asarray(dictionary.generateImageMarker(name, 6) < 128, dtype=np.float64)
    half = np.full(2, 0.5 * side)
    paper = rectangle(centre - 1.5 * half, centre + 1.5 * half)
    return [Surface(paper, MATTE_WHITE), *black_cells(cells, side / 6, centre - half)]


def black_cells(cells: Array, cell: float, corner: Array) -> Iterator[Surface]:
    """The black cells of a pattern (rows, columns) from `corner` on, neighbours in a row in one
    piece."""
    for row, line in enumerate(cells):
        edges = np.flatnonzero(np.diff(np.concatenate(([0], line, [0]))))
        for start, stop in edges.reshape(-1, 2):
            low, high = np.array([(start, row), (stop, row + 1)]) * cell + corner
            yield Surface(rectangle(low, high), MARK_BLACK)


def rectangle(low: Array, high: Array) -> Array:
    """The outline (4, 2) from one corner to the other."""
    (left, top), (right, bottom) = low, high
    return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
