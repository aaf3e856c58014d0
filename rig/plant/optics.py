"""The virtual camera's eye: pinhole, Brown-Conrady lens and a slightly crooked pose.

Model of OpenCV's calib3d (Brown 1971; Zhang 2000): camera point, division by depth, radial
1 + k1 r^2 + k2 r^4 + k3 r^6 and tangential p1, p2 distortion, then focal length and centre.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.spec.bench import VirtualLens, VirtualOptics

Array = NDArray[np.float64]
Distortion = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class Lens:
    """What a camera's lens and sensor truly are, pixels; no experiment sees it."""

    width: int
    height: int
    focal_x: float
    focal_y: float
    centre_x: float
    centre_y: float
    distortion: Distortion
    """k1, k2, p1, p2, k3."""


def draw_lens(sheet: VirtualLens, rng: np.random.Generator) -> Lens:
    """A specimen of the lens that a data sheet describes."""
    focal = sheet.focal * (1 + rng.normal(0, sheet.focal_spread))
    x, y = rng.normal(0, sheet.centre_spread, 2)
    k1, k2, p1, p2, k3 = rng.normal(sheet.distortion, sheet.distortion_spread).tolist()
    return Lens(
        width=sheet.width,
        height=sheet.height,
        focal_x=focal,
        focal_y=focal,
        centre_x=0.5 * (sheet.width - 1) + float(x),
        centre_y=0.5 * (sheet.height - 1) + float(y),
        distortion=(k1, k2, p1, p2, k3),
    )


@dataclass(frozen=True)
class Projection:
    """Maps the bench to the picture.

    Bench coordinates are metres in the plane of bending: x right, y down, depth away from the
    camera; their origin is the point that the camera aims at and lands on the principal point.
    Pixel coordinates have integers at pixel centres, as OpenCV's.
    """

    width: int
    height: int
    focal: tuple[float, float]
    centre: tuple[float, float]
    distortion: Distortion
    """k1, k2, p1, p2, k3."""
    rotation: tuple[tuple[float, float, float], ...]
    """Bench axes to camera axes, row by row."""
    distance: float
    """Camera to the origin of the bench, metres."""

    def project(self, points: Array, depth: float = 0.0) -> Array:
        """Pixels (n, 2) of bench `points` (n, 2) in metres, all at the same `depth` in metres."""
        rotation = np.asarray(self.rotation)
        camera = points @ rotation[:, :2].T
        camera += rotation[:, 2] * depth
        range_ = camera[:, 2] + self.distance
        x = camera[:, 0] / range_
        y = camera[:, 1] / range_
        k1, k2, p1, p2, k3 = self.distortion
        xx, yy, xy = x * x, y * y, x * y
        rr = xx + yy
        radial = 1 + rr * (k1 + rr * (k2 + rr * k3))
        pixels = np.empty((len(x), 2))
        pixels[:, 0] = x * radial + 2 * p1 * xy + p2 * (rr + 2 * xx)
        pixels[:, 1] = y * radial + p1 * (rr + 2 * yy) + 2 * p2 * xy
        pixels *= self.focal
        pixels += self.centre
        return pixels

    def view(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of the picture in the bench plane, metres.

        As an untilted camera without lens distortion sees it: right for laying things out.
        """
        scale_x = self.distance / self.focal[0]
        scale_y = self.distance / self.focal[1]
        return (
            (-0.5 - self.centre[0]) * scale_x,
            (-0.5 - self.centre[1]) * scale_y,
            (self.width - 0.5 - self.centre[0]) * scale_x,
            (self.height - 0.5 - self.centre[1]) * scale_y,
        )


def aim(lens: Lens, distance: float, pan: float, tilt: float, roll: float) -> Projection:
    """A camera `distance` metres from the bench origin that looks at it.

    `pan`, `tilt` and `roll` (rad) turn it about the bench's vertical, the horizontal and its own
    axis; pan and tilt move the camera around the origin, so that the aim never leaves it.
    """
    rotation = _about_z(roll) @ _about_x(tilt) @ _about_y(pan)
    return Projection(
        width=lens.width,
        height=lens.height,
        focal=(lens.focal_x, lens.focal_y),
        centre=(lens.centre_x, lens.centre_y),
        distortion=lens.distortion,
        rotation=tuple((float(a), float(b), float(c)) for a, b, c in rotation),
        distance=distance,
    )


def draw_projection(lens: Lens, optics: VirtualOptics, rng: np.random.Generator) -> Projection:
    """The camera as somebody set it up: pan, tilt and roll are normal with sd `optics.tilt`."""
    pan, tilt, roll = rng.normal(0.0, optics.tilt, 3)
    return aim(lens, optics.distance, float(pan), float(tilt), float(roll))


def _about_x(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _about_y(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
