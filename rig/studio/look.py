"""What the camera says in the units people read: the deformation in a picture."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2

from rig.experiment.deformation import DeformationMeter
from rig.vision.errors import VisionError
from rig.vision.overlay import COVERAGE_FACTOR
from rig.vision.segment import UNREADABLE, decoded

JPEG_QUALITY = 80


@dataclass(frozen=True)
class Look:
    """One picture with what was measured drawn on it."""

    jpeg: bytes
    value: float | None = None
    """In deg of an actuator that bends, in mm of one that lengthens."""
    u95: float | None = None
    reason: str = ""
    """Why there is no value."""
    time_s: float = 0.0
    """Bench time of the picture."""


NOTHING = Look(b"")
"""No picture yet."""


def looked_at(jpeg: bytes, meter: DeformationMeter) -> Look:
    """Measure the picture; one that cannot be read or measured is given back as it came."""
    image = decoded(jpeg)
    if image is None:
        return Look(jpeg, reason=UNREADABLE)
    try:
        sight, drawn = meter.drawn(image)
    except VisionError as error:
        return Look(jpeg, reason=str(error))
    _, coded = cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    u95 = None if sight.value is None else COVERAGE_FACTOR * sight.u
    return Look(coded.tobytes(), sight.value, u95, sight.reason)


class Lookout:
    """Measures the newest picture in a thread of its own, so that nobody waits for it, and tells.

    Pictures that come while one is being measured replace each other.
    """

    def __init__(self, meter: DeformationMeter, tell: Callable[[Look], None]) -> None:
        self._meter = meter
        self._tell = tell
        self._changed = threading.Condition()
        self._waiting: Look | None = None
        self._closed = False
        self._thread = threading.Thread(target=self._serve, name="lookout", daemon=True)
        self._thread.start()

    def show(self, time_s: float, jpeg: bytes) -> None:
        """Look at this one next."""
        with self._changed:
            self._waiting = Look(jpeg, time_s=time_s)
            self._changed.notify()

    def close(self) -> None:
        """Look at nothing any more."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def _serve(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._waiting is not None)
                shown, self._waiting = self._waiting, None
            if shown is None:
                return
            self._tell(replace(looked_at(shown.jpeg, self._meter), time_s=shown.time_s))
