"""The projection agrees with OpenCV's and the camera looks where it is aimed."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.plant.optics import aim, draw_lens, draw_projection
from rig.spec.workspace import Workspace

LIBRARY = Workspace(Path(__file__).parents[2])
BENCH = LIBRARY.bench("virtual")
CAMERA = LIBRARY.resolve_bench(BENCH).camera
STRONG_LENS = CAMERA.model_copy(update={"distortion": (-0.31, 0.12, 0.004, -0.003, -0.05)})


def opencv_pixels(calibration, projection, points, depth):
    rotation, _ = cv2.Rodrigues(np.array(projection.rotation))
    matrix = np.array(
        [
            [calibration.focal_x, 0, calibration.centre_x],
            [0, calibration.focal_y, calibration.centre_y],
            [0, 0, 1],
        ]
    )
    objects = np.column_stack((points, np.full(len(points), depth)))
    place = np.array([0.0, 0.0, projection.distance])
    pixels, _ = cv2.projectPoints(
        objects, rotation, place, matrix, np.array(calibration.distortion)
    )
    return pixels[:, 0]


@pytest.mark.parametrize("calibration", [CAMERA, STRONG_LENS], ids=["bench", "strong lens"])
@pytest.mark.parametrize("depth", [0.0, -0.0075, 0.02])
@pytest.mark.parametrize("pose", [(0, 0, 0), (0.03, -0.02, 0.015), (-0.3, 0.25, 0.6)])
def test_pixels_are_those_of_opencv(calibration, depth, pose):
    projection = aim(calibration, 0.35, *pose)
    points = np.random.default_rng(3).uniform((-0.1, -0.06), (0.1, 0.06), (500, 2))
    expected = opencv_pixels(calibration, projection, points, depth)
    np.testing.assert_allclose(projection.project(points, depth), expected, rtol=0, atol=1e-9)


def test_a_crooked_camera_still_looks_at_the_bench_origin():
    projection = aim(CAMERA, 0.35, 0.05, -0.04, 0.1)
    origin = projection.project(np.zeros((1, 2)))[0]
    np.testing.assert_allclose(origin, (CAMERA.centre_x, CAMERA.centre_y), atol=1e-9)


def test_right_and_down_on_the_bench_are_right_and_down_in_the_picture():
    origin, right, down = aim(CAMERA, 0.35, 0.02, 0.02, 0.02).project(
        np.array([(0.0, 0.0), (0.05, 0.0), (0.0, 0.05)])
    )
    assert right[0] - origin[0] > 300
    assert down[1] - origin[1] > 300


def test_what_is_nearer_looks_larger():
    projection = aim(CAMERA, 0.35, 0, 0, 0)
    point = np.array([(0.05, 0.0)])
    near, plane = (projection.project(point, depth)[0, 0] for depth in (-0.0075, 0.0))
    magnification = (near - CAMERA.centre_x) / (plane - CAMERA.centre_x)
    assert magnification == pytest.approx(0.35 / 0.3425, rel=1e-3)


def test_the_default_view_is_200_by_112_millimetres():
    left, top, right, bottom = aim(CAMERA, 0.35, 0, 0, 0).view()
    assert right - left == pytest.approx(0.2)
    assert bottom - top == pytest.approx(0.1125)


def test_the_same_seed_sets_the_camera_up_the_same_way():
    first, second, other = (
        draw_projection(CAMERA, BENCH.virtual.optics, np.random.default_rng(seed))
        for seed in (4, 4, 5)
    )
    assert first == second
    assert first.rotation != other.rotation


def test_setups_scatter_as_the_bench_says():
    """The optical axis of a small pan and tilt leaves the normal by both at once."""
    sd = BENCH.virtual.optics.tilt
    rng = np.random.default_rng(0)
    rotations = np.array(
        [draw_projection(CAMERA, BENCH.virtual.optics, rng).rotation for _ in range(1500)]
    )
    pan, tilt, roll = rotations[:, 0, 2], -rotations[:, 1, 2], rotations[:, 1, 0]
    np.testing.assert_allclose([pan.std(), tilt.std(), roll.std()], sd, rtol=0.06)


def test_lenses_scatter_as_their_data_sheet_says():
    sheet = BENCH.virtual.optics.lens
    rng = np.random.default_rng(0)
    lenses = [draw_lens(sheet, rng) for _ in range(1500)]
    focal = np.array([lens.focal_x for lens in lenses])
    centres = np.array([(lens.centre_x, lens.centre_y) for lens in lenses])
    distortion = np.array([lens.distortion for lens in lenses])
    assert focal.mean() == pytest.approx(sheet.focal, rel=4 * sheet.focal_spread / 1500**0.5)
    assert focal.std() == pytest.approx(sheet.focal * sheet.focal_spread, rel=0.06)
    np.testing.assert_allclose(centres.std(axis=0), sheet.centre_spread, rtol=0.06)
    np.testing.assert_allclose(distortion.std(axis=0), sheet.distortion_spread, rtol=0.06)
    assert (lenses[0].width, lenses[0].height) == (sheet.width, sheet.height)
