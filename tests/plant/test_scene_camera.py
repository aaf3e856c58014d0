"""The virtual camera as a device: JPEG, noise, seeds and faults."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scenes import CAMERA, OPTICS, camera

from rig.plant.camera import CameraFault


@pytest.fixture
def fresh():
    return camera(1)


@pytest.fixture(scope="module")
def shared():
    return camera(1)


def decoded(jpeg):
    return cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)


def test_a_frame_is_a_jpeg_of_the_calibrated_size(shared):
    jpeg = shared.grab(0.5, 1.0)
    assert jpeg[:2] == b"\xff\xd8"
    assert jpeg[-2:] == b"\xff\xd9"
    assert decoded(jpeg).shape == (CAMERA.height, CAMERA.width, 3)


def test_the_jpeg_is_close_to_what_was_rendered(shared):
    picture, image = shared.render(0.5, 1.0), decoded(shared.grab(0.5, 1.0))
    difference = image.astype(int) - picture
    assert np.abs(difference.mean()) < 0.5
    assert difference.std() < 5


def test_the_same_seed_angle_and_time_give_the_same_bytes(fresh):
    again = camera(1)
    again.grab(1.3, 17.0)  # what was taken before does not matter
    assert fresh.grab(0.7, 3.0) == again.grab(0.7, 3.0)


def test_different_seeds_differ_in_more_than_noise():
    first, second = (camera(seed, noise=0.0).render(0.5, 0.0).astype(int) for seed in (1, 2))
    assert np.abs(first - second).max() > 80


def test_noise_differs_from_frame_to_frame_and_has_the_stated_deviation(shared):
    clean = camera(1, noise=0.0).render(0.4, 0.0).astype(int)
    first, second = (shared.render(0.4, t).astype(int) - clean for t in (0.0, 1 / 30))
    inside = (clean > 12) & (clean < 240)
    assert first[inside].std() == pytest.approx(np.hypot(OPTICS.noise, 12**-0.5), rel=0.02)
    assert abs(first[inside].mean()) < 0.02
    assert abs(np.corrcoef(first[inside], second[inside])[0, 1]) < 0.01


def test_averaged_frames_lose_their_noise(shared):
    clean = camera(1, noise=0.0).render(0.4, 0.0)
    mean = np.mean([shared.render(0.4, t) for t in np.arange(25) / 30], axis=0)
    inside = (clean > 20) & (clean < 235)
    assert (mean - clean)[inside].std() < 1.1 * OPTICS.noise / 5


def test_frames_at_different_angles_differ_only_around_the_actuator():
    seen = camera(1, noise=0.0)
    changed = np.nonzero((seen.render(0.3, 0.0) != seen.render(0.4, 0.0)).any(axis=(0, 2)))[0]
    assert changed.max() < CAMERA.width / 2


def test_a_frozen_camera_repeats_its_last_frame_until_it_recovers(fresh):
    before = fresh.grab(0.2, 1.0)
    fresh.fault = CameraFault.FROZEN
    assert fresh.grab(0.9, 2.0) == before
    assert fresh.grab(1.2, 3.0) == before
    fresh.fault = CameraFault.NONE
    assert fresh.grab(1.2, 3.0) != before


def test_a_camera_frozen_from_the_start_repeats_its_first_frame(fresh):
    fresh.fault = CameraFault.FROZEN
    first = fresh.grab(0.2, 1.0)
    assert fresh.grab(0.9, 2.0) == first


def test_a_dark_frame_shows_nothing_but_noise(fresh):
    fresh.fault = CameraFault.DARK
    image = decoded(fresh.grab(0.5, 1.0))
    assert image.max() < 40
    assert image.std() > 0


def test_an_occluded_cap_is_not_blue_any_more(fresh):
    def blue_pixels():
        blue, green, red = np.moveaxis(fresh.render(0.8, 0.0).astype(int), 2, 0)
        return int(((blue > 120) & (red < 70) & (green < 100)).sum())

    with_cap = blue_pixels()
    fresh.fault = CameraFault.OCCLUDED_CAP
    assert blue_pixels() < with_cap - 500
