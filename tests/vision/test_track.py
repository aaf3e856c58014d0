"""A film is followed: the same angles as frame by frame, and no frame that jumps or hides."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.plant.camera import CameraFault, VirtualCamera
from rig.spec.calibration import RulerCalibration
from rig.spec.workspace import Workspace
from rig.vision.errors import VisionError
from rig.vision.measure import AngleMeter
from rig.vision.track import AngleTracker

LIBRARY = Workspace(Path(__file__).parents[2])
BENCH = LIBRARY.bench("virtual")
CALIBRATIONS = LIBRARY.resolve_bench(BENCH)
RATE_HZ = 60.0
ANGLES = 40.0 + 15.0 * (1.0 - np.cos(np.linspace(0.0, np.pi, 12)))
"""Degrees; 164 deg/s at the fastest."""


def camera(seed: int = 3, ruler: RulerCalibration = CALIBRATIONS.ruler) -> VirtualCamera:
    return VirtualCamera(
        BENCH.virtual.optics,
        ruler,
        LIBRARY.actuator("bellow-bending").geometry,
        BENCH.camera.jpeg_quality,
        np.random.default_rng(seed),
    )


def frame(seen: VirtualCamera, angle_deg: float, time_s: float = 0.0) -> np.ndarray:
    jpeg = np.frombuffer(seen.grab(np.radians(angle_deg), time_s), np.uint8)
    return cv2.imdecode(jpeg, cv2.IMREAD_COLOR)


@pytest.fixture(scope="module")
def film() -> list[np.ndarray]:
    seen = camera()
    return [frame(seen, float(angle), i / RATE_HZ) for i, angle in enumerate(ANGLES)]


@pytest.fixture
def meter() -> AngleMeter:
    return AngleMeter(CALIBRATIONS.camera, CALIBRATIONS.ruler)


@pytest.fixture
def tracker(meter) -> AngleTracker:
    return AngleTracker(meter)


def follow(tracker, images):
    return [tracker.measure(image, i / RATE_HZ) for i, image in enumerate(images)]


def test_a_film_gives_the_angles_of_its_frames(tracker, meter, film):
    followed = follow(tracker, film)
    for angle, image, found in zip(ANGLES, film, followed, strict=True):
        assert found.measurement.accepted, found.measurement.reason
        alone = meter.measure(image)
        assert found.measurement.angle_deg == pytest.approx(angle, abs=0.2)
        assert found.measurement.angle_deg == pytest.approx(alone.angle_deg, abs=0.05)


def test_after_the_first_frame_only_the_surroundings_of_the_cap_are_searched(
    tracker, meter, film, monkeypatch
):
    tracker.measure(film[0], 0.0)
    monkeypatch.setattr(AngleMeter, "measure", None)
    for number, image in enumerate(film[1:], 1):
        assert tracker.measure(image, number / RATE_HZ).measurement.accepted


def test_angles_and_rates_are_predicted(tracker, film):
    followed = follow(tracker, film)
    assert followed[0].predicted_deg is None
    rates = np.gradient(ANGLES) * RATE_HZ
    for angle, rate, found in list(zip(ANGLES, rates, followed, strict=True))[3:]:
        assert abs(found.predicted_deg - angle) < 3.0 * found.u_predicted_deg
        assert found.rate_deg_s == pytest.approx(rate, abs=30.0)


def test_a_hidden_cap_is_rejected_and_found_again(tracker):
    seen = camera()
    found = []
    for number, angle in enumerate(ANGLES):
        seen.fault = CameraFault.OCCLUDED_CAP if 4 <= number < 7 else CameraFault.NONE
        image = frame(seen, float(angle), number / RATE_HZ)
        found.append(tracker.measure(image, number / RATE_HZ))
    reasons = [f.measurement.reason for f in found]
    assert all("hidden" in reason for reason in reasons[4:7])
    assert not any(reasons[:4] + reasons[7:])
    assert found[7].predicted_deg == pytest.approx(ANGLES[7], abs=5.0 * found[7].u_predicted_deg)
    assert found[7].u_predicted_deg > found[3].u_predicted_deg


def test_a_blurred_frame_is_rejected_and_the_next_one_measured(tracker, film):
    blurred = [*film[:5], cv2.GaussianBlur(film[5], (0, 0), 12.0), *film[6:]]
    reasons = [f.measurement.reason for f in follow(tracker, blurred)]
    assert reasons[5]
    assert not any(reasons[:5] + reasons[6:])


def test_an_angle_that_jumps_is_refused_until_the_track_is_lost(meter, film):
    tracker = AngleTracker(meter, lost_after_s=3.5 / RATE_HZ)
    seen = camera()
    elsewhere = frame(seen, 110.0)
    images = [*film[:4], *6 * [elsewhere]]
    found = follow(tracker, images)
    for jumped in found[4:7]:
        assert not jumped.measurement.accepted
        assert jumped.measurement.sighting is None
        (jump,) = re.findall(r"jumps to ([\d.]+) deg", jumped.measurement.reason)
        assert float(jump) == pytest.approx(110.0, abs=0.2)
        assert jumped.measurement.angle_deg is None
    assert found[7].measurement.angle_deg == pytest.approx(110.0, abs=0.3)
    assert found[7].predicted_deg is None


def test_a_knocked_camera_is_noticed(tracker, film):
    """Another pose: the ruler's plane of the frames before would be wrong."""
    follow(tracker, film[:4])
    knocked = frame(camera(9), float(ANGLES[4]))
    found = tracker.measure(knocked, 4 / RATE_HZ).measurement
    assert found.angle_deg == pytest.approx(ANGLES[4], abs=0.1)


def test_the_whole_frame_is_looked_at_every_second(tracker, film, monkeypatch):
    looks = []
    whole = AngleMeter.measure
    monkeypatch.setattr(
        AngleMeter, "measure", lambda meter, image: looks.append(1) or whole(meter, image)
    )
    for number in range(8):
        tracker.measure(film[0], 0.3 * number)
    assert len(looks) == 1 + 1  # at the start, and after one second


@pytest.mark.parametrize("time_s", [0.0, -1.0])
def test_frames_out_of_order_are_refused(tracker, film, time_s):
    tracker.measure(film[0], 0.0)
    with pytest.raises(VisionError, match="in the order"):
        tracker.measure(film[1], time_s)
