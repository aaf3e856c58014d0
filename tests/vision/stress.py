"""The image stress set: rendered scenes over a Halton sample of what spoils pictures.

The renderer is the virtual bench's: exact coverages, a lens model and a projection of its own,
nothing of `rig.vision`. The meter is given a calibration that is off by about its uncertainty, as
a real one is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.stats import qmc

from rig.mechanics.profile import side_profile
from rig.plant.layout import RULER_WIDTH, Layout, ruler_outline
from rig.plant.optics import Projection, aim
from rig.plant.scene import BACKGROUND, Light, Scene, Surface
from rig.spec.actuator import BellowBendingGeometry
from rig.spec.calibration import CameraCalibration
from rig.vision.measure import AngleMeasurement, AngleMeter, Side
from tests.vision.synthetic import PROVENANCE, RULER

GEOMETRY = BellowBendingGeometry(family="bellow-bending")
RESOLUTIONS = ((640, 480), (800, 600), (1280, 720), (1280, 960), (1920, 1080))
FOCAL_U, CENTRE_U, K1_U = 2e-3, 2.0, 5e-3
"""Standard deviations of the calibration from the lens: relative, pixels, absolute."""
DIMENSIONS = 24
WRONG_DEG = 2.0
"""An accepted angle that is further off is wrongly accepted."""


@dataclass(frozen=True)
class Conditions:
    """One scene. Angles in deg, lengths in metres unless said; defaults are nominal."""

    seed: int = 0
    bend: float = 40.0
    side: Side = "left"
    off_normal: float = 1.0
    azimuth: float = 30.0
    """Of the direction in which the camera is off the normal."""
    roll: float = 0.5
    width: int = 1280
    height: int = 720
    focal: float = 1.75
    """Focal length in picture widths."""
    k1: float = -0.12
    fill: float = 0.8
    """Share of the picture that actuator and ruler take."""
    blur: float = 0.8
    """Standard deviation of the point spread, pixels."""
    noise: float = 3.0
    """Standard deviation, grey levels."""
    exposure: float = 1.0
    """Light on the sensor; what exceeds 1 is white."""
    gradient: float = 0.25
    glare: float = 0.0
    """Light in the middle of a white spot, relative to a white surface."""
    glare_place: tuple[float, float] = (0.5, 0.5)
    """Shares of width and height."""
    glare_size: float = 0.05
    """Standard deviation in picture widths."""
    clutter: int = 0
    """Coloured things behind the actuator."""
    background: tuple[float, float, float] | None = None
    """Hue in deg, saturation and value of HSV; None is the dark cloth."""
    hidden: float = 0.0
    """Share of the cap's length behind a card, from one of its ends."""


def halton(count: int, seed: int = 5) -> list[Conditions]:
    """`count` scenes over the whole of what the vision shall stand."""
    sample = qmc.Halton(DIMENSIONS, scramble=True, seed=seed).random(count)
    return [_conditions(number, row.tolist()) for number, row in enumerate(sample)]


def nominal(count: int, seed: int = 6) -> list[Conditions]:
    """`count` scenes as on the bench: camera nearly square, good light, any angle."""
    sample = qmc.Halton(5, scramble=True, seed=seed).random(count)
    return [
        Conditions(
            seed=number,
            bend=170.0 * bend,
            side="left" if side < 0.5 else "right",
            off_normal=2.0 * tilt,
            azimuth=360.0 * azimuth,
            roll=2.0 * roll - 1.0,
        )
        for number, (bend, side, tilt, azimuth, roll) in enumerate(sample.tolist())
    ]


def _conditions(seed: int, u: list[float]) -> Conditions:
    width, height = RESOLUTIONS[int(u[5] * len(RESOLUTIONS))]
    scale = width / 1280
    return Conditions(
        seed=seed,
        bend=170.0 * u[0],
        side="left" if u[1] < 0.5 else "right",
        off_normal=15.0 * u[2],
        azimuth=360.0 * u[3],
        roll=10.0 * u[4] - 5.0,
        width=width,
        height=height,
        focal=0.9 + 1.6 * u[6],
        k1=0.4 * u[7] - 0.3,
        fill=0.65 + 0.2 * u[8],
        blur=scale * (0.4 + 2.1 * u[9]),
        noise=12.0 * u[10],
        exposure=float(0.08 ** (1.0 - 1.08 * u[11])),
        gradient=0.5 * u[12],
        glare=2.0 * max(0.0, u[13] - 0.4),
        glare_place=(u[14], u[15]),
        glare_size=0.02 + 0.08 * u[16],
        clutter=int(7 * u[17]),
        background=None if u[18] < 0.3 else (360.0 * u[19], u[20], 0.1 + 0.6 * u[21]),
        hidden=max(0.0, 1.2 * u[22] - 0.6) * (1.0 if u[23] < 0.5 else -1.0),
    )


@dataclass(frozen=True)
class Picture:
    """A rendered scene with the meter that shall measure it."""

    image: np.ndarray
    meter: AngleMeter
    conditions: Conditions

    def measured(self) -> AngleMeasurement:
        return self.meter.measure(self.image)


def render(scene: Conditions) -> Picture:
    """The picture of a scene, and a meter with a calibration as good as a real one."""
    pose, cloth, things, noise, calibrating = np.random.default_rng(scene.seed).spawn(5)
    lens = _lens(scene)
    layout, middle, size = _layout()
    projection = _projection(scene, lens, size, pose)
    shape = side_profile(GEOMETRY, np.radians(scene.bend))
    placed = replace(layout, origin=tuple(np.array(layout.origin) - middle))
    placed = replace(
        placed,
        frame_edge=layout.frame_edge - float(middle[1]),
        ruler_corner=tuple(np.array(layout.ruler_corner) - middle),
    )
    bench = Scene(
        projection,
        placed,
        RULER,
        shape.connector,
        Light(scene.gradient, float(pose.uniform(0.0, 2.0 * np.pi))),
        scene.blur,
        cloth,
        BACKGROUND if scene.background is None else _light(*scene.background),
        list(_clutter(scene.clutter, size, things)),
    )
    card = list(_card(scene, placed.place(shape.end_cap), things))
    light = (bench.picture(shape, card).astype(np.float32) / 255.0) ** 2
    light = np.clip(scene.exposure * (light + _glare(scene)[..., None]), 0.0, 1.0)
    grey = 255.0 * np.sqrt(light) + scene.noise * noise.standard_normal(light.shape, np.float32)
    image = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    quality = [cv2.IMWRITE_JPEG_QUALITY, 92, cv2.IMWRITE_JPEG_SAMPLING_FACTOR]
    jpeg = cv2.imencode(".jpg", image, [*quality, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_422])[1]
    meter = AngleMeter(_calibrated(lens, calibrating), RULER, scene.side)
    return Picture(cv2.imdecode(jpeg, cv2.IMREAD_COLOR), meter, scene)


def _lens(scene: Conditions) -> CameraCalibration:
    """What the lens truly is."""
    focal = scene.focal * scene.width
    return CameraCalibration(
        kind="calibration",
        instrument="camera",
        width=scene.width,
        height=scene.height,
        focal_x=focal,
        focal_y=1.001 * focal,
        centre_x=0.507 * scene.width,
        centre_y=0.495 * scene.height,
        distortion=(scene.k1, -0.4 * scene.k1, 4e-4, -3e-4, 0.0),
        angle_u_deg=0.03,
        provenance=PROVENANCE,
    )


def _calibrated(lens: CameraCalibration, rng: np.random.Generator) -> CameraCalibration:
    """What a calibration says of the lens."""
    focal, x, y, k1 = rng.normal(0.0, 1.0, 4)
    k1 *= K1_U
    return lens.model_copy(
        update={
            "focal_x": lens.focal_x * (1.0 + FOCAL_U * focal),
            "focal_y": lens.focal_y * (1.0 + FOCAL_U * focal),
            "centre_x": lens.centre_x + CENTRE_U * x,
            "centre_y": lens.centre_y + CENTRE_U * y,
            "distortion": (lens.distortion[0] + k1, *lens.distortion[1:]),
        }
    )


def _layout() -> tuple[Layout, np.ndarray, np.ndarray]:
    """Actuator with room for all its angles, the ruler beside it; their middle and size."""
    outlines = [side_profile(GEOMETRY, np.radians(bend)) for bend in range(0, 171, 10)]
    swept = np.concatenate([o for s in outlines for o in (s.bellow, s.end_cap, s.connector)])
    low, high = swept[:, ::-1].min(axis=0), swept[:, ::-1].max(axis=0)
    leg = RULER.marks * RULER.pitch
    corner = (float(high[0]) + 0.008 + RULER_WIDTH / 2, leg + 0.012)
    layout = Layout(origin=(0.0, 0.0), frame_edge=float(low[1]), ruler_corner=corner)
    every = np.concatenate([swept[:, ::-1], ruler_outline(corner, RULER)])
    low, high = every.min(axis=0), every.max(axis=0)
    return layout, 0.5 * (low + high), high - low


def _projection(
    scene: Conditions, lens: CameraCalibration, size: np.ndarray, rng: np.random.Generator
) -> Projection:
    """The camera off the normal; bending to the right is the mirrored bench."""
    needed = size * (lens.focal_x, lens.focal_y) / (scene.width, scene.height)
    distance = float(needed.max()) / scene.fill
    azimuth, off = np.radians(scene.azimuth), np.radians(scene.off_normal)
    seen = aim(
        lens,
        distance,
        float(off * np.cos(azimuth)),
        float(off * np.sin(azimuth)),
        float(np.radians(scene.roll)),
    )
    if scene.side == "right":
        mirrored = tuple((-a, b, c) for a, b, c in seen.rotation)
        seen = replace(seen, rotation=mirrored)
    return seen


def _light(hue: float, saturation: float, value: float) -> np.ndarray:
    """Linear light (3,) in BGR order of a colour in HSV."""
    pixel = np.array([[[hue, saturation, value]]], np.float32)
    bgr: np.ndarray = cv2.cvtColor(pixel, cv2.COLOR_HSV2BGR)[0, 0]
    return bgr**2


def _clutter(count: int, size: np.ndarray, rng: np.random.Generator) -> Iterable[Surface]:
    """Coloured polygons anywhere in the view."""
    for _ in range(count):
        place = rng.uniform(-0.7, 0.7, 2) * size
        turns = np.sort(rng.uniform(0.0, 2.0 * np.pi, int(rng.integers(3, 7))))
        radius = rng.uniform(0.003, 0.02)
        outline = place + radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        hue, saturation, value = rng.uniform((0.0, 0.0, 0.1), (360.0, 1.0, 0.9))
        yield Surface(outline, _light(hue, saturation, value))


def _card(scene: Conditions, cap: np.ndarray, rng: np.random.Generator) -> Iterable[Surface]:
    """A card before a share of the cap, its edge at any slant."""
    if scene.hidden == 0.0:
        return
    sides = np.roll(cap, -1, axis=0) - cap
    along = sides[np.argmax(np.hypot(*sides.T))]
    length = float(np.hypot(*along))
    along = np.sign(scene.hidden) * along / length
    slant = rng.uniform(-0.7, 0.7)
    turned = np.array([[np.cos(slant), -np.sin(slant)], [np.sin(slant), np.cos(slant)]]) @ along
    across = np.array([-turned[1], turned[0]])
    start = cap.mean(axis=0) + (0.5 - abs(scene.hidden)) * length * along
    corners = [(0.0, -0.012), (0.02, -0.012), (0.02, 0.012), (0.0, 0.012)]
    outline = np.array([start + a * turned + b * across for a, b in corners])
    hue, saturation = rng.uniform(0.0, 360.0), rng.uniform(0.0, 0.6)
    yield Surface(outline, _light(hue, saturation, rng.uniform(0.1, 0.8)))


def _glare(scene: Conditions) -> np.ndarray:
    """White light (height, width) from a reflex."""
    if scene.glare <= 0.0:
        return np.zeros((scene.height, scene.width), np.float32)
    x = np.arange(scene.width) / scene.width - scene.glare_place[0]
    y = (np.arange(scene.height) - scene.glare_place[1] * scene.height) / scene.width
    away = np.add.outer(y**2, x**2) / scene.glare_size**2
    return (scene.glare * np.exp(-0.5 * away)).astype(np.float32)


@dataclass(frozen=True)
class Score:
    """What became of the pictures of a set; angles in deg."""

    pictures: int
    errors: np.ndarray
    """(n,) measured minus true, of the accepted pictures."""
    u: np.ndarray
    """(n,) stated standard uncertainties."""
    reasons: dict[str, int]
    """Of the rejections, with their number."""

    @property
    def rms(self) -> float:
        return float(np.sqrt((self.errors**2).mean()))

    @property
    def wrong(self) -> int:
        """Accepted pictures that are more than `WRONG_DEG` off."""
        return int((np.abs(self.errors) > WRONG_DEG).sum())

    @property
    def covered(self) -> float:
        """Share of errors within twice the stated uncertainty."""
        return float((np.abs(self.errors) < 2.0 * self.u).mean())

    def row(self) -> tuple[str, ...]:
        """Pictures, bias, RMS, 99th percentile, largest, rejected, wrongly accepted, covered."""
        large = np.abs(self.errors)
        return (
            str(self.pictures),
            f"{self.errors.mean():+.3f}",
            f"{self.rms:.3f}",
            f"{np.percentile(large, 99):.3f}",
            f"{large.max():.3f}",
            f"{self.pictures - len(self.errors)}",
            str(self.wrong),
            f"{self.covered:.1%}",
        )


def score(scenes: Iterable[Conditions]) -> Score:
    """Render and measure every scene."""
    errors, u, reasons, count = [], [], {}, 0
    for scene in scenes:
        result = render(scene).measured()
        count += 1
        if result.angle_deg is None:
            reasons[result.reason] = reasons.get(result.reason, 0) + 1
        else:
            errors.append(result.angle_deg - scene.bend)
            u.append(result.u_deg)
    return Score(count, np.array(errors), np.array(u), reasons)
