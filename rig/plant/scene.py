"""The picture of the bench before the sensor sees it: exact edges, light, lens and blur.

Outlines are sampled densely, projected, and turned into exact pixel coverages; nothing is warped.
Surfaces mix in linear light, are blurred by the point spread and then pass the camera's tone
curve, a square root (gamma 2). A bright edge on dark ground therefore looks displaced towards the
dark in grey values, as it does with a real camera; in linear light it is where it belongs.

Everything that stands still is rendered once; a frame only renders the pixels around the actuator.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

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
_COARSE = 8  # shading is computed at an eighth of the resolution


def linear(red: int, green: int, blue: int) -> Picture:
    """Linear light (3,) in BGR order of a colour given in grey levels."""
    levels = np.array([blue, green, red], np.float32) / np.float32(255)
    return levels * levels


ALUMINIUM = linear(172, 176, 180)
RIGID_BLUE = linear(22, 62, 190)
BODY = linear(214, 205, 168)
BOTTOM_LAYER = linear(190, 182, 146)
MATTE_WHITE = linear(226, 226, 222)
MARK_BLACK = linear(24, 24, 26)
BACKGROUND = linear(38, 37, 40)

# What a rigid part adds to the colour of a body that it shines into.
BLEEDING = np.float32(0.6) * (RIGID_BLUE - BODY)


@dataclass(frozen=True)
class Surface:
    """A flat thing in the plane of bending."""

    outline: Array
    """(n, 2), bench metres."""
    colour: Picture
    """Linear light (3,), BGR."""


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
        field: Picture = np.float32(1) + np.float32(self.gradient) * np.add.outer(y, x).astype(
            np.float32
        )
        return field


class Scene:
    """Renders one bench set-up; frames differ in the actuator's profile only.

    `blur` is the standard deviation of the point spread in pixels; `rng` draws the weave of the
    `background`, linear light (3,), before which `clutter` lies about.
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
        background: Picture = BACKGROUND,
        clutter: Sequence[Surface] = (),
    ) -> None:
        self._projection = projection
        self._layout = layout
        self._blur = blur
        self._pixel = projection.distance / projection.focal[0]  # metres
        self._reach = int(np.ceil(4 * blur)) + 1
        self._whole = Box(0, 0, projection.width, projection.height)
        self._light = light.field(projection.width, projection.height)
        self._connector = self._cover(layout.place(connector), self._whole)
        pixels = projection.project(layout.place(connector))
        self._connector_box = bounding_box([pixels], 1, self._whole).on_grid(_COARSE, self._whole)
        self._connector_glow = self._glow(
            self._connector[self._connector_box.slices], self._connector_box
        )
        self._connector_light = self._connector * self._light * RIGID_BLUE[:, None, None]
        self._ground = self._static_light(ruler, rng, background, clutter) * self._light
        """Linear light (3, height, width) of all that stands still but the connector."""
        # Planes for one frame: fresh memory for each would cost more than the arithmetic.
        self._scratch = np.empty((6, projection.height * projection.width), np.float32)
        still = self._ground * (1 - self._connector) + self._connector_light
        self._still = developed(still, blur)

    def picture(self, profile: SideProfile, before: Sequence[Surface] = ()) -> Image:
        """The picture (height, width, 3), BGR, 8 bit, without noise, of the deformed actuator.

        The surfaces of `before` hide what is behind them, the first one first; of equal colours in
        a row they are one thing, so that neighbours leave no seam.
        """
        place, project = self._layout.place, self._projection.project
        parts = [
            project(densified(place(outline), _OUTLINE_STEP))
            for outline in (profile.end_cap, *profile.soft)
        ]
        hiding = [project(densified(surface.outline, _OUTLINE_STEP)) for surface in before]
        seen = bounding_box(parts + hiding, self._reach, self._whole)
        box = bounding_box(parts + hiding, 2 * self._reach, self._whole)
        # On one grid for all frames, so that the coarse shading does not flicker.
        box = box.on_grid(_COARSE, self._whole)
        picture = self._still.copy()
        if seen.empty:
            return picture
        light = self._actuator_light(parts, box)
        for colour, outlines in _by_colour(before, hiding):
            light = _over(light, colour[:, None, None], _covered(outlines, box))
        picture[seen.slices] = developed(light, self._blur)[seen.within(box).slices]
        return picture

    def _actuator_light(self, parts: list[Array], box: Box) -> Picture:
        """Linear light (3, rows, columns) of the ground with the actuator before it.

        From front to back each part takes at most the share of a pixel that is left: exact where
        parts adjoin and where one hides the other.
        """
        scratch = self._scratch[:, : box.shape[0] * box.shape[1]].reshape(-1, *box.shape)
        seen, (left, brightness, soft) = scratch[:3], scratch[3:]
        light = self._light[box.slices]
        np.subtract(1, self._connector[box.slices], out=left)
        weights = []
        for outline in parts:
            part = bounding_box([outline], 0, box)
            weight = coverage(outline, part)
            here = part.within(box).slices
            np.minimum(weight, left[here], out=weight)
            left[here] -= weight
            weights.append((part, weight))
        self._relief(left, out=brightness)
        brightness *= light

        np.multiply(self._ground[:, *box.slices], left, out=seen)
        still = self._connector_box.common(box)
        seen[:, *still.within(box).slices] += self._connector_light[:, *still.slices]
        (cap_box, cap), *soft_parts = weights
        cap_glow = self._glow(cap, cap_box)
        cap *= self._light[cap_box.slices]
        _add_light(seen[:, *cap_box.within(box).slices], RIGID_BLUE, cap)
        soft[:] = 0
        colours = (BOTTOM_LAYER, BODY)[-len(soft_parts) :]
        for (part, weight), colour in zip(soft_parts, colours, strict=True):
            here = part.within(box).slices
            weight *= brightness[here]
            soft[here] += weight
            _add_light(seen[:, *here], colour, weight)
        for lit, glow in (cap_glow, self._connector_glow):
            part = lit.common(box)
            here = part.within(box).slices
            _add_light(seen[:, *here], BLEEDING, soft[here] * glow[part.within(lit).slices])
        return seen

    def _relief(self, left: Picture, out: Picture) -> None:
        """Write the brightness of the soft body; `left` is the share of pixels without any part."""
        rows, columns = left.shape
        thick = 1 - cv2.resize(left, _coarse(left), interpolation=cv2.INTER_AREA)
        thick = cv2.GaussianBlur(thick, (0, 0), _RELIEF / self._pixel / _COARSE)
        # Lit from the upper right: a slope towards the light is brighter.
        slope = np.roll(thick, (1, -1), (0, 1)) - np.roll(thick, (-1, 1), (0, 1))
        relief = np.clip(0.62 + 0.42 * thick**2 - 0.55 * slope, 0.3, 1.25)
        cv2.resize(relief, (columns, rows), dst=out)

    def _glow(self, weight: Picture, box: Box) -> tuple[Box, Picture]:
        """How much of a rigid part shines into its surroundings, and where these are.

        `weight` is the part's coverage of the pixels of `box`.
        """
        reach = int(3 * _BLEED / self._pixel)
        around = box.grown(reach).on_grid(_COARSE, self._whole)
        glow = np.zeros(around.shape, np.float32)
        if box.empty:
            return around, glow
        glow[box.within(around).slices] = weight
        near = cv2.resize(glow, _coarse(glow), interpolation=cv2.INTER_AREA)
        near = cv2.GaussianBlur(near, (0, 0), _BLEED / self._pixel / _COARSE)
        cv2.resize(near, glow.shape[::-1], dst=glow)
        return around, glow

    def _cover(self, outline: Array, box: Box) -> Picture:
        """Coverage of an outline in bench metres."""
        return coverage(self._projection.project(densified(outline, _OUTLINE_STEP)), box)

    def _static_light(
        self,
        ruler: RulerCalibration,
        rng: np.random.Generator,
        background: Picture,
        clutter: Sequence[Surface],
    ) -> Picture:
        """Linear reflectance (3, height, width) of background, clutter, frame and ruler."""
        width, height = self._projection.width, self._projection.height
        light = background[:, None, None] * _cloth(width, height, rng)
        for thing in clutter:
            self._lay(light, thing.outline, thing.colour)
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
        brushed = ALUMINIUM[:, None, None] * _brushed(width, height, rng)
        light = _over(light, brushed, self._cover(frame, self._whole))
        corner = self._layout.ruler_corner
        self._lay(light, ruler_outline(corner, ruler), MATTE_WHITE)
        turn = np.linspace(0, 2 * np.pi, 180, endpoint=False)
        disc = 0.5 * MARK_DIAMETER * np.column_stack((np.cos(turn), np.sin(turn)))
        for centre in mark_centres(corner, ruler, self._layout.ruler_lean):
            self._lay(light, centre + disc, MARK_BLACK)
        return light

    def _lay(self, light: Picture, outline: Array, colour: Picture) -> None:
        """Put a thing of one `colour` on `light` (3, height, width), in place.

        Only the pixels that its `outline`, in bench metres, touches: most things are small.
        """
        pixels = self._projection.project(densified(outline, _OUTLINE_STEP))
        box = bounding_box([pixels], 0, self._whole)
        here = light[:, *box.slices]
        here[:] = _over(here, colour[:, None, None], coverage(pixels, box))


def _by_colour(
    surfaces: Sequence[Surface], outlines: Sequence[Array]
) -> Iterator[tuple[Picture, list[Array]]]:
    """Runs of surfaces of one colour, with their outlines in pixels."""
    pairs = zip(surfaces, outlines, strict=True)
    for _, run in groupby(pairs, key=lambda pair: pair[0].colour.tobytes()):
        alike = list(run)
        yield alike[0][0].colour, [outline for _, outline in alike]


def _covered(outlines: Sequence[Array], box: Box) -> Picture:
    """Share of the pixels of `box` that several things of one colour cover."""
    covered = np.zeros(box.shape, np.float32)
    for outline in outlines:
        part = bounding_box([outline], 1, box)
        covered[part.within(box).slices] += coverage(outline, part)
    return np.minimum(covered, 1, out=covered)


def developed(light: Picture, blur: float) -> Image:
    """8-bit BGR of linear light (3, rows, columns): point spread of sd `blur`, then tone curve."""
    planes = []
    for plane in light:
        spread = cv2.GaussianBlur(plane, (0, 0), blur) if blur > 0 else plane
        planes.append(cv2.convertScaleAbs(cv2.sqrt(spread), alpha=255.0))
    return np.asarray(cv2.merge(planes), dtype=np.uint8)


def densified(outline: Array, step: float) -> Array:
    """The closed outline (n, 2) with points added until none is further than `step` apart."""
    following = np.roll(outline, -1, axis=0)
    edges = following - outline
    count = np.maximum(np.ceil(np.hypot(edges[:, 0], edges[:, 1]) / step).astype(np.intp), 1)
    edge = np.repeat(np.arange(len(outline)), count)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    dense: Array = outline[edge] + (number / count[edge])[:, None] * edges[edge]
    return dense


def _coarse(plane: Picture) -> tuple[int, int]:
    """Width and height of a plane at the resolution of the shading."""
    return max(plane.shape[1] // _COARSE, 1), max(plane.shape[0] // _COARSE, 1)


def _add_light(light: Picture, colour: Picture, weight: Picture) -> None:
    """Add `weight` (rows, columns) times `colour` (3,) to `light` (3, rows, columns) in place."""
    if weight.size == 0:
        return
    for plane, level in zip(light, colour.tolist(), strict=True):
        cv2.scaleAdd(weight, level, plane, dst=plane)


def _over(light: Picture, colour: Picture, weight: Picture) -> Picture:
    """Linear light (3, rows, columns) with `colour` before it where `weight` (rows, columns)."""
    mixed: Picture = light + weight * (colour - light)
    return mixed


def _cloth(width: int, height: int, rng: np.random.Generator) -> Picture:
    """Relative brightness of dark woven cloth: threads both ways, and slow unevenness."""
    threads = rng.standard_normal((2, height, width), np.float32)
    across = cv2.GaussianBlur(threads[0], (0, 0), sigmaX=9.0, sigmaY=0.9)
    along = cv2.GaussianBlur(threads[1], (0, 0), sigmaX=0.9, sigmaY=9.0)
    slow = cv2.resize(
        rng.standard_normal((6, 10), np.float32), (width, height), interpolation=cv2.INTER_CUBIC
    )
    weave = across / across.std() + along / along.std()
    return np.asarray(np.clip(1 + 0.22 * weave + 0.18 * slow, 0.15, None), dtype=np.float32)


def _brushed(width: int, height: int, rng: np.random.Generator) -> Picture:
    """Relative brightness of brushed aluminium: streaks along x."""
    noise = rng.standard_normal((height, width), np.float32)
    streaks = cv2.GaussianBlur(noise, (0, 0), sigmaX=60.0, sigmaY=0.8)
    return np.asarray(1 + 0.05 * streaks / streaks.std(), dtype=np.float32)
