"""What the sensors say in the units people read: the angle in a picture, the force of a count."""

from __future__ import annotations

from dataclasses import dataclass

import cv2

from rig.spec.calibration import LoadCellCalibration
from rig.vision.errors import VisionError
from rig.vision.measure import AngleMeter
from rig.vision.overlay import draw_overlay
from rig.vision.segment import decoded

JPEG_QUALITY = 80


@dataclass(frozen=True)
class Look:
    """One picture with what was measured drawn on it."""

    jpeg: bytes
    angle_deg: float | None = None
    u95_deg: float | None = None
    reason: str = ""
    """Why there is no angle."""


def looked_at(jpeg: bytes, meter: AngleMeter) -> Look:
    """Measure the picture; one that cannot be read or measured is given back as it came."""
    image = decoded(jpeg)
    if image is None:
        return Look(jpeg, reason="the frame is no readable picture")
    try:
        found = meter.measure(image)
    except VisionError as error:
        return Look(jpeg, reason=str(error))
    _, coded = cv2.imencode(
        ".jpg", draw_overlay(image, found), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
    )
    u95 = None if found.angle_deg is None else 2.0 * found.u_deg
    return Look(coded.tobytes(), found.angle_deg, u95, found.reason)


def grams(counts: float, calibration: LoadCellCalibration) -> float:
    """Force in grams-force of load-cell counts, tare removed."""
    return calibration.corrected(counts / calibration.counts_per_gram / 1e3) * 1e3
