"""The virtual camera: a rendered scene, sensor noise, JPEG, and the ways in which cameras fail."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.mechanics.outline import FLAG_SIDE, side_profile
from rig.mechanics.response import SideProfile
from rig.plant.layout import ProfileFunction, lay_out
from rig.plant.markers import marker_surfaces
from rig.plant.optics import Lens, draw_lens, draw_projection
from rig.plant.scene import Image, Light, Scene, Surface, linear
from rig.spec.actuator import Geometry
from rig.spec.bench import VirtualOptics
from rig.spec.calibration import RulerCalibration

_NOISE_MARGIN = 96
_BLACK_LEVEL = 3
_BAR = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (0.013, 0.020)
_BAR_COLOUR = linear(120, 120, 120)


class CameraFault(Enum):
    """What a script can do to the camera."""

    NONE = "none"
    FROZEN = "frozen"
    """It delivers the last picture again and again."""
    OCCLUDED_CAP = "occluded-cap"
    """Something grey hides the end cap."""
    DARK = "dark"
    """The light is off."""


class CameraStreams(NamedTuple):
    """What draws each hidden part of one camera and of what stands before it."""

    pose: np.random.Generator
    light: np.random.Generator
    cloth: np.random.Generator
    noise: np.random.Generator
    glass: np.random.Generator
    square: np.random.Generator
    delay: np.random.Generator

    @classmethod
    def of(cls, rng: np.random.Generator) -> CameraStreams:
        """Those of the camera that `rng` stands for."""
        return cls(*rng.spawn(len(cls._fields)))

    def lens(self, optics: VirtualOptics) -> Lens:
        """The camera's lens."""
        return draw_lens(optics.lens, self.glass)

    def lean(self, optics: VirtualOptics) -> float:
        """By how many rad the legs of the bench's ruler are closer than a right angle."""
        return float(self.square.normal(0.0, optics.ruler_squareness))

    def latency(self, optics: VirtualOptics) -> float:
        """How many s after its exposure a frame arrives."""
        return max(0.0, float(self.delay.normal(optics.latency, optics.latency_spread)))


class SensorNoise:
    """Independent normal noise of standard deviation `sd` grey levels, rounded to whole levels.

    It is added to a picture that is already in whole levels: their rounding, up to half a level
    and fixed for a pixel, does not average out over frames (it moves edges by 0.02 pixels at most).
    One field larger than the picture is drawn beforehand; every frame reads it from an offset and
    mirrored as drawn from the seed and the frame's time. Noise is therefore the same whenever
    the same moment is rendered, and two frames share a pattern once in some 37,000 pairs.
    """

    def __init__(self, width: int, height: int, sd: float, rng: np.random.Generator) -> None:
        self._width, self._height = width, height
        self._key = int(rng.integers(2**32))
        shape = (height + _NOISE_MARGIN, width + _NOISE_MARGIN, 3)
        field = np.rint(rng.standard_normal(shape, np.float32) * np.float32(sd))
        brighter = np.clip(field, 0, 255).astype(np.uint8)
        darker = np.clip(-field, 0, 255).astype(np.uint8)
        self._fields = [(brighter, darker), (darker, brighter)]
        self._silent = sd == 0

    def added(self, picture: Image, time_s: float) -> Image:
        """`picture` with the noise of the moment `time_s`; saturates at black and white."""
        if self._silent:
            return picture
        rng = np.random.default_rng((self._key, round(time_s * 1e6) % 2**64))
        top, left = rng.integers(_NOISE_MARGIN + 1, size=2)
        brighter, darker = self._fields[int(rng.integers(2))]
        window = (slice(top, top + self._height), slice(left, left + self._width))
        noisy = cv2.add(picture, brighter[window])
        return np.asarray(cv2.subtract(noisy, darker[window], dst=noisy))


class VirtualCamera:
    """A USB camera in front of the virtual bench.

    `rng` draws the lens, how square the ruler is, how crooked the camera stands, the direction of
    the light, the background, the noise and the latency, `latency_s`, which whoever asks for a
    picture has to mind; the same generator state gives the same camera, and the same deformation
    and time the same picture, however many were taken before. `profile` gives the actuator's
    outlines. `fault` may be set at any time. Raises SceneError if actuator and ruler do not fit
    into the picture.
    """

    def __init__(
        self,
        optics: VirtualOptics,
        ruler: RulerCalibration,
        geometry: Geometry,
        jpeg_quality: int,
        rng: np.random.Generator,
        profile: ProfileFunction = side_profile,
    ) -> None:
        streams = CameraStreams.of(rng)
        lens = streams.lens(optics)
        self.projection = draw_projection(lens, optics, streams.pose)
        layout = lay_out(geometry, ruler, self.projection, profile)
        self.layout = replace(layout, ruler_lean=streams.lean(optics))
        self.latency_s = streams.latency(optics)
        self.fault = CameraFault.NONE
        self._geometry = geometry
        self._profile = profile
        self._scene = Scene(
            self.projection,
            self.layout,
            ruler,
            profile(geometry, 0.0).connector,
            Light(optics.light_gradient, float(streams.light.uniform(0, 2 * np.pi))),
            optics.blur,
            streams.cloth,
        )
        self._noise = SensorNoise(lens.width, lens.height, optics.noise, streams.noise)
        # 4:2:2, as USB cameras send it; OpenCV would halve the colour in both directions.
        self._encoding = [
            cv2.IMWRITE_JPEG_QUALITY,
            jpeg_quality,
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR_422,
        ]
        self._last: bytes | None = None

    def render(self, deformation: float, time_s: float) -> NDArray[np.uint8]:
        """The picture (height, width, 3), BGR, before JPEG, at a bending angle in rad or an
        elongation in m."""
        if self.fault is CameraFault.DARK:
            shape = (self.projection.height, self.projection.width, 3)
            return self._noise.added(np.full(shape, _BLACK_LEVEL, np.uint8), time_s)
        profile = self._profile(self._geometry, deformation)
        before = self._flags(profile)
        if self.fault is CameraFault.OCCLUDED_CAP:
            seen = profile.end_cap if profile.flags is None else profile.flags[1:]
            bar = self.layout.place(seen).mean(axis=0) + _BAR
            before.append(Surface(bar, _BAR_COLOUR))
        return self._noise.added(self._scene.picture(profile, before), time_s)

    def _flags(self, profile: SideProfile) -> list[Surface]:
        """The markers of an actuator that lengthens."""
        if profile.flags is None:
            return []
        centres = self.layout.place(profile.flags)
        return [
            surface
            for name, centre in enumerate(centres)
            for surface in marker_surfaces(name, FLAG_SIDE, centre)
        ]

    def grab(self, deformation: float, time_s: float) -> bytes:
        """A JPEG as the camera delivers it, of `deformation` (rad or m) at `time_s` (s).

        A frozen camera repeats its last picture; if there is none, it takes this one first.
        """
        if self.fault is CameraFault.FROZEN and self._last is not None:
            return self._last
        _, encoded = cv2.imencode(".jpg", self.render(deformation, time_s), self._encoding)
        self._last = encoded.tobytes()
        return self._last
