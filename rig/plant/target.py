"""Pictures of flat calibration targets that somebody holds before the virtual camera.

The same hidden lens, exact coverages, light and noise as the scene of the bench.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import cv2
import numpy as np

from rig.plant.camera import CameraStreams, SensorNoise
from rig.plant.coverage import Box, Picture, bounding_box, coverage
from rig.plant.layout import MARK_DIAMETER, RULER_WIDTH, mark_centres, ruler_outline
from rig.plant.markers import black_cells, rectangle
from rig.plant.optics import Array, Lens, aim
from rig.plant.scene import (
    BACKGROUND,
    MARK_BLACK,
    MATTE_WHITE,
    Image,
    Light,
    Surface,
    densified,
    developed,
)
from rig.spec.bench import VirtualOptics
from rig.spec.calibration import RulerCalibration
from rig.spec.target import CharucoTarget

_STEP = 4e-3  # metres between outline points
_BORDER = 0.5  # white around a board, in squares
_TILTS = tuple(np.radians(t) for t in (0.0, 22.0, 35.0))
_PLACES = ((0, 0), (-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0))
_FILLS = (0.9, 0.65, 0.5)
"""Share of the picture that a target takes."""


def board_surfaces(target: CharucoTarget) -> tuple[list[Surface], Array]:
    """A printed board about its middle, and its size (2,) in metres."""
    cells = _cells(target)
    half = 0.5 * target.square * np.array([target.columns, target.rows])
    margin = half + _BORDER * target.square
    cell = float(2 * half[0] / cells.shape[1])
    surfaces = [Surface(rectangle(-margin, margin), MATTE_WHITE), *black_cells(cells, cell, -half)]
    return surfaces, 2 * margin


def ruler_surfaces(ruler: RulerCalibration, lean: float) -> tuple[list[Surface], Array]:
    """A ruler about its middle, its upright leg leaning by `lean` rad, and its size (2,)."""
    leg = ruler.marks * ruler.pitch
    corner = (-0.5 * leg, 0.5 * leg)
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    disc = 0.5 * MARK_DIAMETER * np.column_stack((np.cos(turn), np.sin(turn)))
    centres = mark_centres(corner, ruler, lean)
    surfaces = [Surface(ruler_outline(corner, ruler), MATTE_WHITE)]
    surfaces += [Surface(centre + disc, MARK_BLACK) for centre in centres]
    return surfaces, np.full(2, leg + 2 * RULER_WIDTH)


def views(
    surfaces: Sequence[Surface],
    size: Array,
    optics: VirtualOptics,
    rng: np.random.Generator,
    count: int,
) -> Iterator[Image]:
    """`count` pictures of a target of `size` (2,) metres, held all over the picture, tilted.

    `rng` in the state in which `VirtualCamera` takes it gives the same lens.
    """
    streams = CameraStreams.of(rng)
    lens = streams.lens(optics)
    sensor = SensorNoise(lens.width, lens.height, optics.noise, streams.noise)
    shade = Light(optics.light_gradient, float(streams.light.uniform(0, 2 * np.pi)))
    whole = Box(0, 0, lens.width, lens.height)
    for number in range(count):
        # somebody's hand is as free as the camera's pose
        placed = _held(surfaces, size, lens, number, streams.pose)
        light = flat_light(placed, whole) * shade.field(lens.width, lens.height)
        yield sensor.added(developed(light, optics.blur), float(number))


def _held(
    surfaces: Iterable[Surface], size: Array, lens: Lens, number: int, rng: np.random.Generator
) -> list[tuple[Array, Surface]]:
    """Pixel outlines of the surfaces, the target held as the `number`th picture has it."""
    fill = _FILLS[number // 3 % len(_FILLS)]
    place = np.array(_PLACES[number % len(_PLACES)])
    tilt, azimuth = _TILTS[(number + number // 9) % len(_TILTS)], rng.uniform(0, 2 * np.pi)
    roll = rng.uniform(-0.4, 0.4)
    picture = np.array([lens.width, lens.height])
    focal = np.array([lens.focal_x, lens.focal_y])
    distance = float((size * focal / picture).max()) / fill
    projection = aim(lens, distance, tilt * np.cos(azimuth), tilt * np.sin(azimuth), roll)
    # shifted so far that the target's border comes to the picture's
    room = np.maximum(picture * distance / focal - size, 0.0)
    shift = 0.5 * room * place + rng.uniform(-0.1, 0.1, 2) * size
    return [
        (projection.project(densified(surface.outline + shift, _STEP)), surface)
        for surface in surfaces
    ]


def flat_light(outlines: Iterable[tuple[Array, Surface]], whole: Box) -> Picture:
    """Linear light (3, height, width) of surfaces before a plain background.

    Coverages of equal colours are summed before they are mixed: neighbours leave no seam.
    """
    light = np.broadcast_to(BACKGROUND[:, None, None], (3, *whole.shape)).astype(np.float32)
    by_colour: dict[bytes, tuple[Surface, Picture]] = {}
    for outline, surface in outlines:
        key = surface.colour.tobytes()
        total = by_colour.setdefault(key, (surface, np.zeros(whole.shape, np.float32)))[1]
        box = bounding_box([outline], 1, whole)
        if not box.empty:
            total[box.slices] += coverage(outline, box)
    for surface, weight in by_colour.values():
        light += np.minimum(weight, 1) * (surface.colour[:, None, None] - light)
    return light


def _cells(target: CharucoTarget) -> Array:
    """The board (rows, columns) in cells as fine as the bits of its markers: 1 is black."""
    across = round(6 * target.square / target.marker)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    shape = (target.columns, target.rows)
    board = cv2.aruco.CharucoBoard(shape, float(across), 6.0, dictionary)
    image = board.generateImage((target.columns * across, target.rows * across), marginSize=0)
    return np.asarray(image < 128, dtype=np.float64)
