"""An independent picture of the bench with a known angle, for tests of the vision only.

Polygons in the picture plane (mm) are projected through tilt, pinhole and lens, covered by
supersampling, lit with a gradient, blurred in linear light, toned, and given noise and JPEG.
Nothing is shared with the virtual bench: another body, another tone curve, another noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import date

import cv2
import numpy as np

from rig.spec.calibration import CameraCalibration, Provenance, RulerCalibration

PROVENANCE = Provenance(date=date(2025, 1, 1), method="synthetic", instrument="test")
CAMERA = CameraCalibration(
    kind="calibration",
    instrument="camera",
    width=1280,
    height=720,
    focal_x=2100.0,
    focal_y=2104.0,
    centre_x=644.0,
    centre_y=352.0,
    distortion=(-0.11, 0.06, 0.0004, -0.0003, 0.0),
    angle_u_deg=0.02,
    provenance=PROVENANCE,
)
RULER = RulerCalibration(
    kind="calibration",
    instrument="ruler",
    pitch="10 mm",
    marks=7,
    pitch_u="0.02 mm",
    squareness_u_deg=0.0,
    provenance=PROVENANCE,
)
GAMMA = 2.2

BLUE = (190, 62, 22)  # BGR grey levels
BODY = (150, 200, 212)
LAYER = (140, 185, 196)
BACKGROUND = (40, 37, 38)
WHITE = (222, 226, 226)
BLACK = (26, 24, 24)


@dataclass(frozen=True)
class Scene:
    """What to draw; lengths in mm, angles in degrees, blur and noise in pixels and grey levels."""

    angle: float = 40.0
    seed: int = 0
    roll: float = 1.0
    tilt_x: float = 0.8
    tilt_y: float = -0.7
    distance: float = 328.0
    blur: float = 0.8
    noise: float = 3.0
    gradient: float = 0.25
    gain: float = 1.0
    quality: int = 92
    ruler: bool = True
    ruler_turn: float = 0.0
    connector: bool = True
    cap: bool = True
    caps: int = 1
    cap_hidden: float = 0.0
    """Share of the cap's length behind a grey card, from its outer end."""
    hidden_marks: tuple[int, ...] = ()
    connector_lean: float = 0.0
    offset: tuple[float, float] = (-40.0, -46.0)
    """Place of the connector's lower edge from the optical axis."""

    def but(self, **changes: object) -> Scene:
        """The same scene with some things changed."""
        return replace(self, **changes)  # type: ignore[arg-type]


LENGTH = 60.0
CAP_WIDTH, CAP_THICKNESS = 16.5, 1.5


def rectangle(centre: np.ndarray, along: np.ndarray, length: float, width: float) -> np.ndarray:
    across = np.array([-along[1], along[0]])
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    return np.array(
        [centre + 0.5 * a * length * along + 0.5 * b * width * across for a, b in corners]
    )


def heading(turn: np.ndarray | float) -> np.ndarray:
    """Direction of the axis after turning towards the left from hanging straight down."""
    return np.stack([-np.sin(turn), np.cos(turn)], axis=-1)


def axis_points(angle: float, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    turn = np.linspace(0.0, np.radians(angle), count)
    steps = heading(0.5 * (turn[1:] + turn[:-1])) * LENGTH / (count - 1)
    return np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)]), turn


def shapes(scene: Scene) -> list[tuple[np.ndarray, tuple[int, int, int], int]]:
    """Polygons (n, 2) in mm, colour and supersampling, back to front."""
    root = np.array(scene.offset)
    points, turn = axis_points(scene.angle)
    points = points + root
    left = np.stack([-np.cos(turn), -np.sin(turn)], axis=-1)
    arc = np.linspace(0.0, 1.0, len(turn))
    crest = 8.0 + 3.5 * np.abs(np.sin(6 * np.pi * arc))
    body = np.concatenate([points + 5.0 * left, (points - crest[:, None] * left)[::-1]])
    layer = np.concatenate([points + 8.0 * left, (points + 4.9 * left)[::-1]])
    drawn = []
    if scene.ruler:
        drawn += ruler_shapes(scene)
    drawn += [(layer, LAYER, 4), (body, BODY, 4)]
    lean = np.radians(scene.connector_lean)
    base = np.array([np.cos(lean), np.sin(lean)])
    if scene.connector:
        drawn.append((rectangle(root - np.array([0.0, 3.0]), base, 22.0, 6.0), BLUE, 8))
    tip, end = points[-1], heading(turn[-1])
    along = np.array([-end[1], end[0]])
    centre = tip + 0.5 * CAP_THICKNESS * end
    if scene.cap:
        drawn.append((rectangle(centre, along, CAP_WIDTH, CAP_THICKNESS), BLUE, 16))
    if scene.caps > 1:
        drawn.append((rectangle(np.array([30.0, 45.0]), along, CAP_WIDTH, CAP_THICKNESS), BLUE, 8))
    if scene.cap_hidden > 0:
        start = centre + along * CAP_WIDTH * (0.5 - scene.cap_hidden)
        card = rectangle(start + 20.0 * along, along, 40.0, 30.0)
        drawn.append((card, (120, 120, 120), 8))
    return drawn


def ruler_shapes(scene: Scene) -> list[tuple[np.ndarray, tuple[int, int, int], int]]:
    turn = np.radians(scene.ruler_turn)
    x, y = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    middle = np.array([48.0, 2.0])
    corner = middle - 35.0 * x - 35.0 * y
    places = [corner + 10.0 * k * x for k in range(8)] + [
        corner + 10.0 * k * y for k in range(1, 8)
    ]
    drawn = [
        (rectangle(corner + 35.0 * x, x, 82.0, 11.0), WHITE, 4),
        (rectangle(corner + 35.0 * y, y, 82.0, 11.0), WHITE, 4),
    ]
    circle = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
    disc = 1.5 * np.stack([np.cos(circle), np.sin(circle)], axis=1)
    for k, place in enumerate(places):
        if k not in scene.hidden_marks:
            drawn.append((place + disc, BLACK, 16))
    return drawn


def project(scene: Scene, points: np.ndarray, camera: CameraCalibration = CAMERA) -> np.ndarray:
    """Distorted pixels of plane points in mm."""
    rolls = np.radians([scene.tilt_x, scene.tilt_y, scene.roll])
    rotation = np.eye(3)
    for axis, angle in zip(np.eye(3), rolls, strict=True):
        rotation = cv2.Rodrigues(axis * angle)[0] @ rotation
    matrix = np.array(
        [
            [camera.focal_x, 0, camera.centre_x],
            [0, camera.focal_y, camera.centre_y],
            [0, 0, 1],
        ]
    )
    flat = np.column_stack([points, np.zeros(len(points))])
    pixels, _ = cv2.projectPoints(
        flat,
        cv2.Rodrigues(rotation)[0],
        np.array([0.0, 0.0, scene.distance]),
        matrix,
        np.array(camera.distortion),
    )
    return pixels.reshape(-1, 2)


def densify(polygon: np.ndarray, step: float = 0.5) -> np.ndarray:
    pieces = []
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        count = max(1, int(np.ceil(np.hypot(*(end - start)) / step)))
        pieces.append(start + np.arange(count)[:, None] / count * (end - start))
    return np.concatenate(pieces)


def cover(pixels: np.ndarray, samples: int, shape: tuple[int, int]) -> tuple[tuple, np.ndarray]:
    """Share of each pixel in the polygon, and the window (slices) it is for."""
    low = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - 1, 0)
    high = np.minimum(np.ceil(pixels.max(axis=0)).astype(int) + 2, [shape[1], shape[0]])
    size = np.maximum(high - low, 0)
    if not size.all():
        return (slice(0, 0), slice(0, 0)), np.zeros((0, 0))
    fine = np.zeros((size[1] * samples, size[0] * samples), np.uint8)
    places = (pixels - low + 0.5) * samples - 0.5
    cv2.fillPoly(fine, [np.rint(places * 16).astype(np.int32)], 255, shift=4)
    share = fine.reshape(size[1], samples, size[0], samples).mean(axis=(1, 3)) / 255.0
    return (slice(low[1], high[1]), slice(low[0], high[0])), share


def render(scene: Scene, camera: CameraCalibration = CAMERA) -> np.ndarray:
    """The picture (h, w, 3) BGR uint8 of a scene."""
    rng = np.random.default_rng(scene.seed)
    height, width = camera.height, camera.width

    def light_of(colour: tuple[int, int, int]) -> np.ndarray:
        return (np.array(colour) / 255.0) ** GAMMA

    light = np.broadcast_to(light_of(BACKGROUND), (height, width, 3)).copy()
    texture = cv2.GaussianBlur(rng.standard_normal((height, width)), (0, 0), 3.0)
    light *= np.clip(1.0 + 2.5 * texture, 0.3, 2.0)[..., None]
    for polygon, colour, samples in shapes(scene):
        window, share = cover(project(scene, densify(polygon), camera), samples, (height, width))
        here = light[window]
        here += share[..., None] * (light_of(colour) - here)
    direction = rng.uniform(0.0, 2.0 * np.pi)
    x = (np.arange(width) - width / 2) / width * np.cos(direction)
    y = (np.arange(height) - height / 2) / width * np.sin(direction)
    light *= scene.gain * (1.0 + scene.gradient * (x[None, :] + y[:, None]))[..., None]
    if scene.blur > 0:
        light = cv2.GaussianBlur(light, (0, 0), scene.blur)
    grey = 255.0 * np.clip(light, 0.0, 1.0) ** (1.0 / GAMMA)
    grey = grey + scene.noise * rng.standard_normal(grey.shape)
    image = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    ok, coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, scene.quality])
    assert ok
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), dtype=np.uint8)


def random_scene(rng: np.random.Generator, angle: float, **changes: object) -> Scene:
    """A scene with a crooked camera and a seed of its own."""
    tilt_x, tilt_y, roll = rng.uniform(-1.5, 1.5, 3)
    scene = Scene(
        angle=angle,
        seed=int(rng.integers(2**31)),
        roll=float(roll),
        tilt_x=float(tilt_x),
        tilt_y=float(tilt_y),
    )
    return scene.but(**changes)
