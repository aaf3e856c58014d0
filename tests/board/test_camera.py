"""Real cameras: frames are stamped with the time of their exposure; errors say what to do."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from rig.board.camera import open_camera
from rig.board.errors import BoardError
from rig.spec.bench import OpenCvCameraDevice, RealSenseCameraDevice, VirtualCameraDevice
from rig.spec.workspace import Workspace

LIBRARY = Workspace(Path(__file__).parents[2])
CAMERA = LIBRARY.bench("virtual").camera
CALIBRATED = LIBRARY.resolve_bench(LIBRARY.bench("virtual")).camera
MODE = CALIBRATED.model_copy(update={"latency": None})
PICTURE = np.full((48, 64, 3), (10, 200, 90), np.uint8)


def camera(device, **changes):
    return CAMERA.model_copy(update={"device": device, **changes})


def decoded(jpeg: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)


@pytest.fixture
def frames(tmp_path) -> str:
    for number in range(2):
        cv2.imwrite(str(tmp_path / f"{number:04d}.png"), PICTURE)
    return str(tmp_path / "%04d.png")


def test_frames_are_stamped_with_their_exposure_and_end_with_an_error(frames):
    device = OpenCvCameraDevice(kind="opencv", source=frames)
    opened = open_camera(camera(device, latency=0.03), MODE, lambda: 5.0)
    for _ in range(2):
        time_s, jpeg = opened.grab()
        assert time_s == pytest.approx(4.97)
        assert np.abs(decoded(jpeg).astype(int) - PICTURE).max() < 4
    with pytest.raises(BoardError, match="no more frames"):
        opened.grab()
    opened.close()


def test_a_measured_latency_goes_before_that_of_the_bench(frames):
    device = OpenCvCameraDevice(kind="opencv", source=frames)
    opened = open_camera(camera(device, latency=0.03), CALIBRATED, lambda: 5.0)
    assert CALIBRATED.latency.value == 0.06
    assert opened.grab()[0] == pytest.approx(4.94)


def test_a_camera_that_is_not_there_says_what_to_check(tmp_path):
    device = OpenCvCameraDevice(kind="opencv", source=str(tmp_path / "none.avi"))
    with pytest.raises(BoardError, match="cannot be opened"):
        open_camera(camera(device), MODE, lambda: 0.0)


def test_a_virtual_camera_is_no_real_one():
    with pytest.raises(BoardError, match="needs a real camera"):
        open_camera(camera(VirtualCameraDevice(kind="virtual")), MODE, lambda: 0.0)


def test_a_realsense_without_its_library_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    device = RealSenseCameraDevice(kind="realsense")
    with pytest.raises(BoardError, match=r"pip install 'rig\[realsense\]'"):
        open_camera(camera(device), MODE, lambda: 0.0)


class FakeLibrary:
    """What of pyrealsense2 is used; no such camera is at hand."""

    stream, format = SimpleNamespace(color="colour"), SimpleNamespace(bgr8="bgr8")

    def __init__(self, pictures: list[np.ndarray], works: bool = True) -> None:
        self._pictures, self._works = pictures, works
        self.asked: list[tuple] = []
        self.stopped = False

    def config(self):
        return SimpleNamespace(
            enable_device=lambda serial: self.asked.append(("device", serial)),
            enable_stream=lambda *mode: self.asked.append(mode),
        )

    def pipeline(self):
        return SimpleNamespace(start=self._start, wait_for_frames=self._wait, stop=self._stop)

    def _start(self, config) -> None:
        if not self._works:
            raise RuntimeError("No device connected")

    def _wait(self, timeout_ms: int):
        if not self._pictures:
            raise RuntimeError("Frame didn't arrive within 2000")
        picture = self._pictures.pop()
        return SimpleNamespace(get_color_frame=lambda: SimpleNamespace(get_data=lambda: picture))

    def _stop(self) -> None:
        self.stopped = True


def test_a_realsense_is_asked_for_the_mode_of_the_calibration(monkeypatch):
    library = FakeLibrary([PICTURE])
    monkeypatch.setitem(sys.modules, "pyrealsense2", library)
    device = RealSenseCameraDevice(kind="realsense", serial_number="123")
    opened = open_camera(camera(device), MODE, lambda: 1.0)
    assert library.asked == [("device", "123"), ("colour", 1280, 720, "bgr8", 30)]
    assert decoded(opened.grab()[1]).shape == PICTURE.shape
    with pytest.raises(BoardError, match="'RealSense 123' delivers no more frames"):
        opened.grab()
    opened.close()
    assert library.stopped


def test_a_realsense_that_does_not_start_says_why(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyrealsense2", FakeLibrary([], works=False))
    device = RealSenseCameraDevice(kind="realsense")
    with pytest.raises(BoardError, match=r"No device connected.*1280x720 at 30 frames"):
        open_camera(camera(device), MODE, lambda: 0.0)
