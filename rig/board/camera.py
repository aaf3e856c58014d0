"""Real cameras: what OpenCV opens, and Intel RealSense. Frames are stamped with bench time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import cv2
import numpy as np

from rig.board.errors import BoardError
from rig.spec.bench import Camera, OpenCvCameraDevice, RealSenseCameraDevice
from rig.spec.calibration import CameraCalibration

REALSENSE_TIMEOUT_MS = 2000


class Source(Protocol):
    """Delivers pictures."""

    def read(self) -> cv2.typing.MatLike | None:
        """The next picture (height, width, 3) BGR; None where there are no more."""
        ...

    def close(self) -> None:
        """Release the device."""
        ...


class StampedCamera:
    """Frames as JPEG, stamped with the bench time of their exposure: arrival less `latency_s`.

    `now_s` reads bench time. `name` is what errors call the camera.
    """

    def __init__(
        self,
        source: Source,
        name: str,
        jpeg_quality: int,
        latency_s: float,
        now_s: Callable[[], float],
    ) -> None:
        self._source = source
        self._name = name
        self._latency_s = latency_s
        self._now_s = now_s
        self._encoding = [cv2.IMWRITE_JPEG_QUALITY, jpeg_quality]

    def grab(self) -> tuple[float, bytes]:
        """Bench time in seconds and the JPEG of the next frame; raises BoardError at the end."""
        image = self._source.read()
        time_s = self._now_s() - self._latency_s
        if image is None:
            raise BoardError(f"the camera '{self._name}' delivers no more frames; check its cable.")
        _, encoded = cv2.imencode(".jpg", image, self._encoding)
        return time_s, encoded.tobytes()

    def close(self) -> None:
        """Release the device."""
        self._source.close()


def open_camera(
    camera: Camera, mode: CameraCalibration, now_s: Callable[[], float]
) -> StampedCamera:
    """The real camera of a bench, in the size of `mode` and with its latency; raises BoardError."""
    device = camera.device
    size = (mode.width, mode.height)
    if isinstance(device, OpenCvCameraDevice):
        source: Source = OpenCvSource(device.source, *size)
        name = str(device.source)
    elif isinstance(device, RealSenseCameraDevice):
        source = RealSenseSource(device.serial_number, *size, round(camera.frame_rate))
        name = f"RealSense {device.serial_number}".strip()
    else:
        raise BoardError(
            "a real board needs a real camera; set camera.device to kind 'opencv' with the number "
            "of the device, or to kind 'realsense'."
        )
    latency_s = mode.latency_s(camera.latency)
    return StampedCamera(source, name, camera.jpeg_quality, latency_s, now_s)


class OpenCvSource:
    """A V4L2 camera, video file, stream or image sequence; raises BoardError if it won't open."""

    def __init__(self, source: int | str, width: int, height: int) -> None:
        self._capture = cv2.VideoCapture(source)
        if not self._capture.isOpened():
            raise BoardError(
                f"the camera '{source}' cannot be opened; expected a device number such as 0, a "
                "video file or a stream URL in camera.device.source of the bench. Check that it is "
                "plugged in and that no other program uses it."
            )
        self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, width)
        self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, height)

    def read(self) -> cv2.typing.MatLike | None:
        """The next picture; None at the end of a file, or of a cable."""
        good, image = self._capture.read()
        return image if good else None

    def close(self) -> None:
        """Release the device."""
        self._capture.release()


class RealSenseSource:
    """The colour stream of an Intel RealSense; raises BoardError without library or camera."""

    def __init__(self, serial_number: str, width: int, height: int, frame_rate: int) -> None:
        library = _realsense()
        self._pipeline = library.pipeline()
        config = library.config()
        if serial_number:
            config.enable_device(serial_number)
        config.enable_stream(library.stream.color, width, height, library.format.bgr8, frame_rate)
        try:
            self._pipeline.start(config)
        except RuntimeError as error:
            which = f"RealSense {serial_number}" if serial_number else "RealSense"
            raise BoardError(
                f"the camera '{which}' does not start: {error}. Check that it is plugged in, and "
                f"that it has {width}x{height} at {frame_rate} frames a second (the camera's "
                "calibration and camera.frame_rate of the bench)."
            ) from None

    def read(self) -> cv2.typing.MatLike | None:
        """The next picture; None when it stays away."""
        try:
            frames = self._pipeline.wait_for_frames(REALSENSE_TIMEOUT_MS)
        except RuntimeError:
            return None
        colour = frames.get_color_frame()
        return np.asarray(colour.get_data()) if colour else None

    def close(self) -> None:
        """Stop the stream."""
        self._pipeline.stop()


def _realsense() -> Any:
    """The library, imported where it is needed: it is an extra."""
    try:
        import pyrealsense2
    except ImportError:
        raise BoardError(
            "a RealSense camera needs the library pyrealsense2; install it with "
            "`pip install 'rig[realsense]'`."
        ) from None
    return pyrealsense2
