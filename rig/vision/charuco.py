"""Chessboard corners with their names in pictures of a ChArUco board.

Garrido-Jurado et al., Pattern Recognition 47 (2014) 2280, for the markers; the corners between
them are found to a fraction of a pixel, and a board may be cut by the border of the picture.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from rig.spec.target import CharucoTarget
from rig.vision.errors import VisionError
from rig.vision.lines import FloatArray
from rig.vision.segment import Image, as_image
from rig.vision.views import alike

MIN_CORNERS = 8
"""A view with fewer tells more of its pose than of the lens."""
GRID = 3
"""Cells across and down in which the picture is to be covered."""
MIN_CELL_CORNERS = 12
MIN_VIEWS = 10
TILTED_VIEWS = 3
MIN_LEAN = 0.2
"""Of the board's normal, about 12 deg; head-on views alone do not tell the focal length."""
ROUGH_FOCAL = 1.3
"""Focal length in picture widths, good enough to tell a tilted board from a square one."""
_DOWN = ("top", "middle", "bottom")
_ACROSS = ("left", "centre", "right")


@dataclass(frozen=True)
class View:
    """One picture of the board."""

    board: FloatArray
    """(n, 2) places of the corners on the board, metres."""
    pixels: FloatArray
    """(n, 2) in the distorted picture."""


@dataclass(frozen=True)
class Coverage:
    """How well views cover what a calibration must know."""

    cells: FloatArray
    """(GRID, GRID) corners seen in each part of the picture."""
    leaning: tuple[int, int]
    """Views in which the board's normal leans sideways, and up or down."""
    views: int

    @property
    def advice(self) -> tuple[str, ...]:
        """What to show next; empty when there is enough."""
        wanted = [
            f"hold the board to the {_DOWN[row]} {_ACROSS[column]} of the picture"
            for row, column in np.argwhere(self.cells < MIN_CELL_CORNERS)
        ]
        for lean, axis in zip(self.leaning, ("left or right", "up or down"), strict=True):
            if lean < TILTED_VIEWS:
                wanted.append(f"turn the board's face {axis} by 20 deg or more")
        if self.views < MIN_VIEWS:
            wanted.append(f"take {MIN_VIEWS - self.views} more pictures")
        return tuple(wanted)


def find_board(image: Image, target: CharucoTarget) -> View | None:
    """Corners of the board in a BGR picture; None where fewer than `MIN_CORNERS` are seen."""
    board = _board(target)
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    corners, names, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(grey)
    if names is None or len(names) < MIN_CORNERS:
        return None
    places = np.asarray(board.getChessboardCorners(), dtype=np.float64)[names.ravel(), :2]
    return View(places, np.asarray(corners, dtype=np.float64).reshape(-1, 2))


def collect(
    pictures: Iterable[Image], target: CharucoTarget, wanted: int, tell: Callable[[str], object]
) -> tuple[list[View], tuple[int, int]]:
    """Views of the board, and the size of the pictures, until there are enough.

    Enough are `wanted` that cover what `Coverage` asks for, or all that there are. A picture like
    one before is passed over, so that a film will do. `tell` is told what to show next whenever
    that changes. Raises VisionError where sizes differ or there is no picture.
    """
    views: list[View] = []
    size, said = None, ""
    for picture in pictures:
        here = (picture.shape[1], picture.shape[0])
        if size is not None and here != size:
            raise VisionError(
                f"A picture of {here[0]}x{here[1]} follows one of {size[0]}x{size[1]}; expected "
                "pictures of one camera in one mode."
            )
        size = here
        view = find_board(picture, target)
        if view is None or any(
            alike(view.board, view.pixels, other.board, other.pixels, size[0]) for other in views
        ):
            continue
        views.append(view)
        advice = coverage(views, size).advice
        if not advice and len(views) >= wanted:
            break
        if advice and advice[0] != said:
            said = advice[0]
            tell(f"{len(views)} views; {said}")
    if size is None:
        raise VisionError("There is no picture of the board.")
    return views, size


def coverage(views: list[View], size: tuple[int, int]) -> Coverage:
    """What `views` cover of pictures of `size` (width, height)."""
    cells = np.zeros((GRID, GRID))
    leaning = np.zeros(2, dtype=int)
    focal = ROUGH_FOCAL * size[0]
    matrix = np.array([[focal, 0, size[0] / 2], [0, focal, size[1] / 2], [0, 0, 1.0]])
    for view in views:
        column, row = (view.pixels / size * GRID).astype(int).clip(0, GRID - 1).T
        np.add.at(cells, (row, column), 1)
        flat = np.column_stack([view.board, np.zeros(len(view.board))])
        found, turn, _ = cv2.solvePnP(flat, view.pixels, matrix, None)
        if found:
            leaning += np.abs(cv2.Rodrigues(turn)[0][:2, 2]) > MIN_LEAN
    return Coverage(cells, (int(leaning[0]), int(leaning[1])), len(views))


def board_picture(target: CharucoTarget, pixels_per_mm: float = 10.0) -> Image:
    """The board (h, w) in black on white, to be printed; half a square is left white around."""
    unit = round(target.square * 1e3 * pixels_per_mm)
    size = ((target.columns + 1) * unit, (target.rows + 1) * unit)
    return as_image(_board(target).generateImage(size, marginSize=unit // 2))


def _board(target: CharucoTarget) -> cv2.aruco.CharucoBoard:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    shape = (target.columns, target.rows)
    return cv2.aruco.CharucoBoard(shape, target.square, target.marker, dictionary)
