"""Angles against the known truth of independent pictures: error, uncertainty, invariance."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rig.vision.measure import AngleMeasurement, AngleMeter
from tests.vision.synthetic import (
    CAMERA,
    RULER,
    Scene,
    axis_points,
    project,
    random_scene,
    render,
)

SEEDS = range(4)
ANGLES = np.linspace(-5.0, 130.0, 10)


@pytest.fixture(scope="module")
def results() -> list[tuple[float, AngleMeasurement]]:
    """True angle and measurement over the whole range, each with a crooked camera of its own."""
    meter = AngleMeter(CAMERA, RULER)
    scenes = []
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        angles = ANGLES + rng.uniform(-3.0, 3.0, len(ANGLES))
        scenes += [random_scene(rng, float(angle)) for angle in angles]
    return [(scene.angle, meter.measure(render(scene))) for scene in scenes]


def test_every_good_frame_is_accepted(results):
    assert [r.reason for _, r in results if not r.accepted] == []


def test_the_angle_is_right_within_a_tenth_of_a_degree_rms(results, record_property):
    errors = np.array([r.angle_deg - angle for angle, r in results])
    rms = float(np.sqrt((errors**2).mean()))
    record_property("rms_deg", rms)
    assert rms < 0.1
    assert np.abs(errors).max() < 0.3


def test_the_site_shows_the_errors(results, evidence):
    ordered = sorted(results, key=lambda pair: pair[0])
    evidence(
        "camera-angle",
        "Vision: angles in rendered pictures of crooked cameras against the angles drawn",
        {
            "true angle (deg)": [angle for angle, _ in ordered],
            "error (deg)": [r.angle_deg - angle for angle, r in ordered],
            "stated U95 (deg)": [2 * r.u_deg for _, r in ordered],
        },
        plot="marks",
        quantity="deg",
        rel=1e-4,
        abs=0.02,
    )


def test_nine_of_ten_errors_are_below_twice_the_stated_uncertainty(results):
    covered = [abs(r.angle_deg - angle) < 2.0 * r.u_deg for angle, r in results]
    assert np.mean(covered) >= 0.9


def test_the_stated_uncertainty_is_no_larger_than_it_must_be(results):
    errors = np.array([r.angle_deg - angle for angle, r in results])
    stated = np.array([r.u_deg for _, r in results])
    assert stated.mean() < 3.0 * np.sqrt((errors**2).mean())


def test_good_frames_have_a_high_quality(results):
    assert min(r.quality for _, r in results) > 0.7


@pytest.mark.parametrize("angle", [-20.0, -10.0, 0.0, 150.0, 165.0])
def test_angles_beyond_the_usual_range_keep_their_sign_and_half_turn(meter, angle):
    assert meter.measure(render(Scene(angle=angle))).angle_deg == pytest.approx(angle, abs=0.3)


def test_the_scale_is_the_size_of_a_pixel_at_the_actuator(meter):
    scene = Scene(angle=40.0)
    tip = axis_points(scene.angle)[0][-1]
    middle = np.array(scene.offset) + 0.5 * (tip + np.array([0.0, -2.0]))
    corner, right, down = project(scene, middle + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    square_px = np.linalg.det(np.array([right - corner, down - corner]))
    scale = meter.measure(render(scene)).scale_mm_per_px
    assert scale == pytest.approx(1.0 / np.sqrt(square_px), rel=5e-4)


@pytest.mark.parametrize("roll", [-4.0, -2.0, 2.0, 4.0])
def test_rolling_the_camera_leaves_the_angle_unchanged(meter, roll):
    upright, rolled = (
        meter.measure(render(Scene(angle=55.0, roll=r, offset=(-25.0, -38.0)))) for r in (0.0, roll)
    )
    u = float(np.hypot(upright.u_deg, rolled.u_deg))
    assert abs(upright.angle_deg - rolled.angle_deg) < 3.0 * u


@pytest.mark.parametrize("turn", [90.0, 180.0, 270.0, 12.0])
def test_the_ruler_may_lie_in_any_orientation(meter, turn):
    assert meter.measure(render(Scene(ruler_turn=turn))).angle_deg == pytest.approx(40.0, abs=0.2)


@pytest.mark.parametrize("lean", [-6.0, 6.0])
def test_the_angle_is_relative_to_the_connector(meter, lean):
    result = meter.measure(render(Scene(connector_lean=lean)))
    assert result.angle_deg == pytest.approx(40.0 - lean, abs=0.3)


def test_a_mirrored_picture_gives_the_same_angle_for_the_other_side():
    image = render(Scene(angle=75.0))
    left = AngleMeter().measure(image)
    right = AngleMeter(bends="right").measure(np.ascontiguousarray(image[:, ::-1]))
    assert right.angle_deg == pytest.approx(left.angle_deg, abs=0.05)


@pytest.mark.parametrize("gain", [0.25, 0.5, 1.2])
def test_the_exposure_does_not_move_the_angle(meter, gain):
    result = meter.measure(render(Scene(gain=gain)))
    assert result.angle_deg == pytest.approx(40.0, abs=0.2)


def test_the_plane_of_the_ruler_removes_perspective():
    scene = Scene(angle=70.0, tilt_x=12.0, tilt_y=-10.0, distance=370.0, offset=(-30.0, -38.0))
    image = render(scene)
    rectified = AngleMeter(CAMERA, RULER).measure(image)
    plain = AngleMeter(CAMERA).measure(image)
    assert abs(plain.angle_deg - 70.0) > 1.0
    assert rectified.angle_deg == pytest.approx(70.0, abs=0.3)


def test_without_a_ruler_the_uncertainty_is_larger_and_there_is_no_scale():
    image = render(Scene(ruler=False))
    result = AngleMeter(CAMERA).measure(image)
    assert result.accepted
    assert result.scale_mm_per_px is None
    assert result.u_deg >= 1.0
    assert abs(result.angle_deg - 40.0) < 2.0 * result.u_deg


def test_a_noisier_frame_claims_a_larger_uncertainty(meter):
    clean, noisy = (meter.measure(render(Scene(noise=n))) for n in (3.0, 35.0))
    assert noisy.u_deg > clean.u_deg


def test_more_blur_lowers_the_quality(meter):
    qualities = [meter.measure(render(Scene(blur=b))).quality for b in (0.5, 1.2, 2.0)]
    assert qualities == sorted(qualities, reverse=True)


def test_a_soft_frame_is_measured_at_half_its_size_in_its_own_pixels(meter):
    """Everything that is said about a frame is in the pixels of the frame as it came."""
    sharp, soft = (meter.measure(render(Scene(blur=blur))) for blur in (0.8, 3.5))
    assert soft.accepted, soft.reason
    assert abs(soft.angle_deg - 40.0) < 3.0 * soft.u_deg
    assert soft.scale_mm_per_px == pytest.approx(sharp.scale_mm_per_px, rel=5e-3)
    assert np.abs(soft.geometry.ruler_marks - sharp.geometry.ruler_marks).max() < 0.3
    middles = [r.geometry.cap.outline.mean(axis=0) for r in (sharp, soft)]
    assert np.abs(middles[0] - middles[1]).max() < 3.0


def test_the_same_frame_always_gives_the_same_numbers(meter):
    image = render(Scene())
    first, again = meter.measure(image), meter.measure(image.copy())
    assert (first.angle_deg, first.u_deg, first.quality) == (
        again.angle_deg,
        again.u_deg,
        again.quality,
    )


def test_measuring_does_not_touch_the_picture(meter):
    image = render(Scene())
    before = image.copy()
    meter.measure(image)
    assert np.array_equal(image, before)


def test_twice_the_resolution_gives_the_same_angle():
    image = render(Scene(angle=62.0))
    large = cv2.resize(image, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
    one, two = AngleMeter().measure(image), AngleMeter().measure(large)
    assert two.accepted, two.reason
    assert two.angle_deg == pytest.approx(one.angle_deg, abs=0.1)
