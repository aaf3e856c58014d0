"""Camera pictures of a run with what was measured drawn on them, small enough to embed."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import cv2
import numpy as np

from rig.experiment.deformation import DeformationMeter, recorded_meter
from rig.record.documents import PointKey
from rig.report.data import RunData
from rig.vision.errors import VisionError
from rig.vision.segment import Image, decoded

PICTURES = 6
WIDTH_PX = 640
JPEG_QUALITY = 80


@dataclass(frozen=True)
class Picture:
    """A JPEG for an `<img>`, with caption and description."""

    source: str
    """Data URI."""
    caption: str
    alt: str


def overlay_pictures(data: RunData) -> list[Picture]:
    """Pictures at a few pressures of the first ascending sweep, measured again and drawn on."""
    wanted = _chosen(data)
    if not wanted:
        return []
    meter = recorded_meter(data.setup, data.reader.rest_image())
    found: dict[PointKey, Picture] = {}
    for image in data.reader.images():
        if image.key in wanted and image.key not in found:
            picture = _picture(meter, image.jpeg, image.key)
            if picture is not None:
                found[image.key] = picture
            if len(found) == len(wanted):
                break
    return [found[key] for key in wanted if key in found]


def _chosen(data: RunData) -> list[PointKey]:
    """Keys spread evenly over the pressures of the first sweep upwards."""
    keys = [
        point.key
        for point in data.points_of("deformation")
        if point.key.direction == "up" and point.key.repeat == 1
    ]
    keys.sort(key=lambda key: key.target_kpa)
    if len(keys) <= PICTURES:
        return keys
    return [keys[i] for i in np.linspace(0, len(keys) - 1, PICTURES).round().astype(int)]


def _picture(meter: DeformationMeter, jpeg: bytes, key: PointKey) -> Picture | None:
    frame = decoded(jpeg)
    if frame is None:
        return None
    where = f"{key.target_kpa:g} kPa"
    try:
        sight, drawn = meter.drawn(frame)
    except VisionError as error:
        caption = f"{where}: not measured again: {error}"
        return Picture(_embed(frame), caption, f"Camera picture at {where}, without measurement")
    if sight.value is None:
        caption = f"{where}: rejected, {sight.reason}"
        return Picture(_embed(drawn), caption, f"Camera picture at {where}, rejected by vision")
    quantity, unit = meter.measurand.quantity, meter.measurand.unit
    alt = (
        f"Side view of the actuator at {where} with what was measured drawn in: its {quantity} is "
        f"{sight.value:.1f} {unit}"
    )
    return Picture(_embed(drawn), f"{where}: {sight.value:.2f} {unit}", alt)


def _embed(image: Image) -> str:
    height = round(image.shape[0] * WIDTH_PX / image.shape[1])
    small = cv2.resize(image, (WIDTH_PX, height), interpolation=cv2.INTER_AREA)
    _, encoded = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return "data:image/jpeg;base64," + base64.b64encode(encoded.tobytes()).decode("ascii")
