"""The picture of the bench before the sensor sees it: exact edges, light, lens and blur.

Outlines are sampled densely, projected, and turned into exact pixel coverages; nothing is warped.
Surfaces mix in linear light, are blurred by the point spread and then pass the camera's tone
curve, a square root (gamma 2). A bright edge on dark ground therefore looks displaced towards the
dark in grey values, as it does with a real camera; in linear light it is where it belongs.

Everything that stands still is rendered once; a frame only renders the pixels around the actuator.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.mechanics.response import SideProfile
from rig.plant.coverage import Box, Picture, bounding_box, coverage
from rig.plant.layout import MARK_DIAMETER, Layout, mark_centres, ruler_outline
from rig.plant.optics import Array, Projection
from rig.spec.calibration import RulerCalibration

Image = NDArray[np.uint8]

_OUTLINE_STEP = 1e-3  # metres between outline points: a lens bends less than 1e-3 pixels between
_RELIEF = 0.0016  # metres, softness of the shading across the body
_BLEED = 0.0012  # metres, how far the colour of rigid parts shines into the translucent body
_COARSE = 4  # shading is computed at a quarter of the resolution


def _linear(red: int, green: int, blue: int) -> Array:
    """Linear light (3,) in BGR order of a colour given in grey levels."""
    return (np.array([blue, green, red]) / 255.0) ** 2


ALUMINIUM = _linear(172, 176, 180)
RIGID_BLUE = _linear(22, 62, 190)
BODY = _linear(214, 205, 168)
BOTTOM_LAYER = _linear(190, 182, 146)
MATTE_WHITE = _linear(226, 226, 222)
MARK_BLACK = _linear(24, 24, 26)
BACKGROUND = _linear(38, 37, 40)
OCCLUDER = _linear(120, 120, 120)


@dataclass(frozen=True)
class Light:
    """Light falls off across the picture; the brightness is 1 at its centre."""

    gradient: float
    """Change of the linear brightness from one border of the picture to the other."""
    direction: float
    """Towards the light, rad from the picture's x axis."""

    def field(self, width: int, height: int) -> Picture:
        """Brightness (height, width) of every pixel."""
        x = (np.arange(width) - 0.5 * (width - 1)) / width * np.cos(self.direction)
        y = (np.arange(height) - 0.5 * (height - 1)) / width * np.sin(self.direction)
        return (1 + self.gradient * (x[None, :] + y[:, None])).astype(np.float32)


class Scene:
    """Renders one bench set-up; frames differ in the actuator's profile only.

    `blur` is the standard deviation of the point spread in pixels; `rng` draws the background.
    `connector` is the profile's outline of the clamped connector: it does not move.
    """

    def __init__(
        self,
        projection: Projection,
        layout: Layout,
        ruler: RulerCalibration,
        connector: Array,
        light: Light,
        blur: float,
        rng: np.random.Generator,
    ) -> None:
        self._projection = projection
        self._layout = layout
        self._blur = blur
        self._reach = int(np.ceil(4 * blur)) + 1
        self._whole = Box(0, 0, projection.width, projection.height)
        self._light = light.field(projection.width, projection.height)
        self._connector = self._cover(layout.place(connector), self._whole)
        ground = self._static_light(ruler, rng) * self._light[..., None]
        self._ground = np.ascontiguousarray(ground, dtype=np.float32)
        """Linear light of all that stands still but the connector."""
        blue = (self._connector * self._light)[..., None] * RIGID_BLUE.astype(np.float32)
        still = self._ground * (1 - self._connector)[..., None] + blue
        self._still = self._developed(still)

    def picture(self, profile: SideProfile, occluded: bool = False) -> Image:
        """The picture (height, width, 3), BGR, 8 bit, without noise, of the deformed actuator.

        `occluded` puts a grey bar before the end cap.
        """
        place, project = self._layout.place, self._projection.project
        parts = [
            project(densified(place(outline), _OUTLINE_STEP))
            for outline in (profile.end_cap, profile.bottom_layer, profile.bellow)
        ]
        bar = [project(_bar(place(profile.end_cap)))] if occluded else []
        width, height = self._projection.width, self._projection.height
        seen = bounding_box(parts + bar, self._reach, width, height)
        box = bounding_box(parts + bar, 2 * self._reach, width, height)
        picture = self._still.copy()
        if seen.empty:
            return picture
        light = self._actuator_light(parts, box)
        if bar:
            weight = coverage(bar[0], box)[..., None]
            light = light * (1 - weight) + weight * OCCLUDER.astype(np.float32)
        developed = self._developed(light)
        picture[seen.slices] = developed[seen.within(box).slices]
        return picture

    def _actuator_light(self, parts: list[Array], box: Box) -> Picture:
        """Linear light (rows, columns, 3) of the ground with the actuator before it.

        From front to back each part takes at most the share of a pixel that is left: exact where
        parts adjoin and where one hides the other.
        """
        rigid = self._connector[box.slices]
        left = 1 - rigid
        weights = []
        for outline in parts:
            weight = np.minimum(coverage(outline, box), left)
            left -= weight
            weights.append(weight)
        cap, bottom, bellow = weights
        light = self._light[box.slices]
        relief, bleed = self._shading(1 - rigid - left, rigid + cap)
        relief *= light
        bottom = bottom * relief
        bellow = bellow * relief
        planes = cv2.merge([(rigid + cap) * light, bottom, bellow, (bottom + bellow) * bleed])
        colours = np.stack(
            [RIGID_BLUE, BOTTOM_LAYER, BODY, 0.6 * (RIGID_BLUE - BODY)], axis=1
        ).astype(np.float32)
        surfaces = cv2.transform(planes, colours)
        seen_ground = cv2.multiply(self._ground[box.slices], cv2.merge([left, left, left]))
        return np.asarray(cv2.add(seen_ground, surfaces, dst=surfaces))

    def _shading(self, body: Picture, rigid: Picture) -> tuple[Picture, Picture]:
        """Brightness of the translucent body, and how much of the rigid parts shines into it."""
        rows, columns = body.shape
        coarse = (max(columns // _COARSE, 1), max(rows // _COARSE, 1))
        pixel = self._projection.distance / self._projection.focal[0] * _COARSE
        thick = cv2.resize(body, coarse, interpolation=cv2.INTER_AREA)
        thick = cv2.GaussianBlur(thick, (0, 0), _RELIEF / pixel)
        # Lit from the upper right: a slope towards the light is brighter.
        slope = np.roll(thick, (1, -1), (0, 1)) - np.roll(thick, (-1, 1), (0, 1))
        relief = np.clip(0.62 + 0.42 * thick**2 - 0.55 * slope, 0.3, 1.25)
        bleed = cv2.GaussianBlur(
            cv2.resize(rigid, coarse, interpolation=cv2.INTER_AREA), (0, 0), _BLEED / pixel
        )
        return (
            np.asarray(cv2.resize(relief, (columns, rows)), dtype=np.float32),
            np.asarray(cv2.resize(bleed, (columns, rows)), dtype=np.float32),
        )

    def _developed(self, light: Picture) -> Image:
        """Linear light through point spread and tone curve to 8 bits."""
        if self._blur > 0:
            light = cv2.GaussianBlur(light, (0, 0), self._blur)
        return np.asarray(cv2.convertScaleAbs(cv2.sqrt(light), alpha=255.0))

    def _cover(self, outline: Array, box: Box) -> Picture:
        """Coverage of an outline in bench metres."""
        return coverage(self._projection.project(densified(outline, _OUTLINE_STEP)), box)

    def _static_light(self, ruler: RulerCalibration, rng: np.random.Generator) -> Picture:
        """Linear reflectance of background, frame and ruler."""
        width, height = self._projection.width, self._projection.height
        light = BACKGROUND * _cloth(width, height, rng)[..., None]
        left, top, right, _ = self._projection.view()
        overhang = right - left
        edge = self._layout.frame_edge
        frame = np.array(
            [
                (left - overhang, top - overhang),
                (right + overhang, top - overhang),
                (right + overhang, edge),
                (left - overhang, edge),
            ]
        )
        brushed = ALUMINIUM * _brushed(width, height, rng)[..., None]
        light = _over(light, brushed, self._cover(frame, self._whole))
        corner = self._layout.ruler_corner
        light = _over(light, MATTE_WHITE, self._cover(ruler_outline(corner, ruler), self._whole))
        turn = np.linspace(0, 2 * np.pi, 180, endpoint=False)
        disc = 0.5 * MARK_DIAMETER * np.column_stack((np.cos(turn), np.sin(turn)))
        for centre in mark_centres(corner, ruler):
            light = _over(light, MARK_BLACK, self._cover(centre + disc, self._whole))
        return light.astype(np.float32)


def densified(outline: Array, step: float) -> Array:
    """The closed outline (n, 2) with points added until none is further than `step` apart."""
    following = np.roll(outline, -1, axis=0)
    edges = following - outline
    count = np.maximum(np.ceil(np.hypot(edges[:, 0], edges[:, 1]) / step).astype(np.intp), 1)
    edge = np.repeat(np.arange(len(outline)), count)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    dense: Array = outline[edge] + (number / count[edge])[:, None] * edges[edge]
    return dense


def _bar(cap: Array) -> Array:
    """An upright bar that hides the end cap, bench metres."""
    centre = cap.mean(axis=0)
    return centre + np.array([(-0.013, -0.02), (0.013, -0.02), (0.013, 0.02), (-0.013, 0.02)])


def _over(light: Array, colour: Array, weight: Picture) -> Array:
    mixed: Array = light + weight[..., None] * (colour - light)
    return mixed


def _cloth(width: int, height: int, rng: np.random.Generator) -> Array:
    """Relative brightness of dark woven cloth: threads both ways, and slow unevenness."""
    threads = rng.normal(size=(2, height, width)).astype(np.float32)
    across = cv2.GaussianBlur(threads[0], (0, 0), sigmaX=9.0, sigmaY=0.9)
    along = cv2.GaussianBlur(threads[1], (0, 0), sigmaX=0.9, sigmaY=9.0)
    weave = across / across.std() + along / along.std()
    slow = cv2.resize(rng.normal(size=(6, 10)), (width, height), interpolation=cv2.INTER_CUBIC)
    cloth: Array = np.clip(1 + 0.28 * weave + 0.18 * slow, 0.15, None)
    return cloth


def _brushed(width: int, height: int, rng: np.random.Generator) -> Array:
    """Relative brightness of brushed aluminium: streaks along x."""
    streaks = cv2.GaussianBlur(rng.normal(size=(height, width)), (0, 0), sigmaX=60.0, sigmaY=0.8)
    brushed: Array = 1 + 0.05 * streaks / streaks.std()
    return brushed
