"""A real camera, video file or stream, opened by OpenCV."""

from __future__ import annotations

from collections.abc import Callable

import cv2

from rig.board.errors import BoardError


class OpenCvCamera:
    """Frames as JPEG, stamped with bench time on arrival.

    `now_s` reads bench time. Raises BoardError when the source cannot be opened or ends.
    """

    def __init__(
        self,
        source: int | str,
        width: int,
        height: int,
        jpeg_quality: int,
        now_s: Callable[[], float],
    ) -> None:
        self._source = source
        self._now_s = now_s
        self._encoding = [cv2.IMWRITE_JPEG_QUALITY, jpeg_quality]
        self._capture = cv2.VideoCapture(source)
        if not self._capture.isOpened():
            raise BoardError(
                f"the camera '{source}' cannot be opened; expected a device number such as 0, a "
                "video file or a stream URL in camera.device.source of the bench. Check that it is "
                "plugged in and that no other program uses it."
            )
        self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, width)
        self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, height)

    def grab(self) -> tuple[float, bytes]:
        """Bench time in seconds and the JPEG of the next frame."""
        good, image = self._capture.read()
        if not good:
            raise BoardError(
                f"the camera '{self._source}' delivers no more frames; check its cable."
            )
        _, encoded = cv2.imencode(".jpg", image, self._encoding)
        return self._now_s(), encoded.tobytes()

    def close(self) -> None:
        """Release the device."""
        self._capture.release()
