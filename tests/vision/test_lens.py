"""Lenses are recovered within what is stated; the truth is the virtual bench's own projection."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.plant.camera import CameraStreams
from rig.plant.optics import Lens, aim, draw_lens
from rig.plant.target import board_surfaces, ruler_surfaces, views
from rig.spec.calibration import Provenance
from rig.spec.target import CharucoTarget
from rig.spec.workspace import Workspace
from rig.vision import squareness
from rig.vision.charuco import GRID, View, board_picture, collect, coverage, find_board
from rig.vision.errors import VisionError
from rig.vision.lens import NAMES, LensFit, fit_lens
from rig.vision.ruler import RulerMarks
from rig.vision.squareness import fit_shape

LIBRARY = Workspace(Path(__file__).parents[2])
BENCH = LIBRARY.bench("virtual")
OPTICS = BENCH.virtual.optics
CALIBRATIONS = LIBRARY.resolve_bench(BENCH)
RULER = CALIBRATIONS.ruler
TARGET = CharucoTarget()
SIZE = (1280, 720)
NOISE_PX = 0.05
GRID_PLACES = np.array([(i, j) for j in range(1, 6) for i in range(1, 9)]) * TARGET.square


def truth(lens: Lens) -> np.ndarray:
    centre = (lens.centre_x, lens.centre_y)
    return np.array([lens.focal_x, lens.focal_y, *centre, *lens.distortion[:4]])


def poses(rng: np.random.Generator, count: int):
    """Projections and shifts of something held before the camera, tilted up to 35 deg."""
    for _ in range(count):
        pan, tilt, roll = rng.uniform(-0.6, 0.6, 3)
        yield rng.uniform(0.25, 0.4), (pan, tilt, roll), rng.uniform((-0.04, -0.02), (0.04, 0.02))


def seen(lens: Lens, rng: np.random.Generator, count: int = 15) -> list[View]:
    """Corners as a camera would see them, without pictures."""
    found = []
    places = GRID_PLACES - GRID_PLACES.mean(axis=0)
    for distance, turn, shift in poses(rng, count):
        pixels = aim(lens, distance, *turn).project(places + shift)
        inside = ((pixels > 0) & (pixels < SIZE)).all(axis=1)
        noisy = pixels + NOISE_PX * rng.standard_normal(pixels.shape)
        found.append(View(GRID_PLACES[inside], noisy[inside]))
    return found


@pytest.fixture(scope="module")
def fits() -> list[tuple[np.ndarray, LensFit]]:
    """True constants and fits of lenses that differ."""
    made = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        lens = draw_lens(OPTICS.lens, rng)
        made.append((truth(lens), fit_lens(seen(lens, rng), SIZE)))
    return made


def test_true_constants_are_within_the_stated_uncertainty(fits):
    """200 constants, each in its own standard uncertainties: mean square near one."""
    scores = np.array([(fit.values - true) / fit.u for true, fit in fits])
    assert 0.8 < np.sqrt((scores**2).mean()) < 1.2
    assert (np.abs(scores) < 2.0).mean() > 0.92
    assert np.abs(scores).max() < 4.5


def test_all_constants_together_are_where_the_covariance_has_them(fits):
    """Squared Mahalanobis distances have the mean of a chi-square, the number of constants."""
    squares = [
        (fit.values - true) @ np.linalg.solve(fit.covariance, fit.values - true)
        for true, fit in fits
    ]
    assert np.mean(squares) == pytest.approx(len(NAMES), rel=0.3)


def test_residuals_are_the_noise_of_the_corners(fits):
    rms = np.mean([fit.rms_px for _, fit in fits])
    assert rms == pytest.approx(NOISE_PX * np.sqrt(2.0), rel=0.1)


def test_the_angle_uncertainty_grows_with_that_of_the_lens(fits):
    fit = fits[0][1]
    stated = fit.calibration(_provenance()).angle_u_deg
    assert 1e-4 < stated < 0.02
    worse = replace(fit, covariance=100.0 * fit.covariance)
    assert worse.calibration(_provenance()).angle_u_deg == pytest.approx(10.0 * stated, rel=0.1)


def _provenance() -> Provenance:
    return Provenance(date="2025-01-01", method="test", instrument="test")


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    surfaces, size = board_surfaces(TARGET)
    return list(views(surfaces, size, OPTICS, np.random.default_rng(3), 6))


def test_corners_in_pictures_are_where_the_lens_puts_them(pictures):
    """A flat board's corners fit a homography of undistorted pixels to a twentieth of a pixel."""
    import cv2

    lens = CameraStreams.of(np.random.default_rng(3)).lens(OPTICS)
    matrix = np.array(
        [[lens.focal_x, 0, lens.centre_x], [0, lens.focal_y, lens.centre_y], [0, 0, 1]]
    )
    for picture in pictures:
        view = find_board(picture, TARGET)
        assert view is not None
        ideal = cv2.undistortPoints(
            view.pixels[:, None], matrix, np.array(lens.distortion), P=matrix
        )[:, 0]
        homography = cv2.findHomography(view.board, ideal, 0)[0]
        mapped = cv2.perspectiveTransform(view.board[:, None], homography)[:, 0]
        assert np.sqrt(((mapped - ideal) ** 2).sum(axis=1).mean()) < 0.05


def test_what_is_not_yet_covered_is_asked_for(pictures):
    told: list[str] = []
    found, size = collect(pictures[:1], TARGET, 30, told.append)
    assert size == SIZE
    assert len(found) == 1
    advice = coverage(found, size).advice
    assert any("of the picture" in line for line in advice)
    assert any("turn the board's face" in line for line in advice)
    assert any("more pictures" in line for line in advice)
    assert told == [f"1 views; {advice[0]}"]


def test_a_picture_like_one_before_is_passed_over(pictures):
    found, _ = collect([pictures[0], pictures[0], pictures[1]], TARGET, 30, print)
    assert len(found) == 2


def test_nothing_is_asked_for_once_everything_is_covered():
    lens = draw_lens(OPTICS.lens, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    found = seen(lens, rng, 40)
    done = coverage(found, SIZE)
    assert done.cells.shape == (GRID, GRID)
    assert done.advice == ()


def test_the_printed_board_is_found_in_its_own_picture():
    picture = board_picture(TARGET, pixels_per_mm=4.0)
    view = find_board(np.repeat(picture[..., None], 3, axis=2), TARGET)
    assert len(view.pixels) == TARGET.corners
    step = np.diff(view.pixels[:8, 0])
    np.testing.assert_allclose(step, 16 * 4.0, atol=0.05)


def test_too_few_views_and_views_of_no_lens_are_refused():
    rng = np.random.default_rng(0)
    lens = draw_lens(OPTICS.lens, rng)
    found = seen(lens, rng)
    with pytest.raises(VisionError, match="found in 4 pictures"):
        fit_lens(found[:4], SIZE)
    bent = [View(v.board, v.pixels + 3.0 * rng.standard_normal(v.pixels.shape)) for v in found]
    with pytest.raises(VisionError, match="miss the fitted lens"):
        fit_lens(bent, SIZE)


def test_pictures_of_two_modes_are_refused(pictures):
    with pytest.raises(VisionError, match="640x360 follows"):
        collect([pictures[0], pictures[0][::2, ::2].copy()], TARGET, 30, print)


@pytest.mark.parametrize("lean_deg", [-0.3, 0.0, 0.15])
def test_the_lean_of_a_ruler_is_recovered(lean_deg):
    """Marks as a camera sees them; the ruler is the virtual bench's."""
    rng = np.random.default_rng(4)
    lens = draw_lens(OPTICS.lens, rng)
    camera = LIBRARY.resolve_bench(BENCH).camera.model_copy(
        update={
            "focal_x": lens.focal_x,
            "focal_y": lens.focal_y,
            "centre_x": lens.centre_x,
            "centre_y": lens.centre_y,
            "distortion": lens.distortion,
        }
    )
    surfaces, _ = ruler_surfaces(RULER, np.radians(lean_deg))
    places = np.array([surface.outline.mean(axis=0) for surface in surfaces[1:]])
    count = RULER.marks
    steps = np.arange(1, count + 1)
    none = np.zeros(count)
    # upright leg first: from it to the horizontal one the ruler turns clockwise in the picture
    grid = np.concatenate(
        [[(0, 0)], np.column_stack([steps, none]), np.column_stack([none, steps])]
    )
    found = []
    for distance, turn, shift in poses(rng, 10):
        pixels = aim(lens, distance, *turn).project(places + shift)
        found.append(RulerMarks(pixels + 0.03 * rng.standard_normal(pixels.shape), grid))
    shape = fit_shape(camera, found)
    assert shape.lean_deg == pytest.approx(lean_deg, abs=3.0 * shape.lean_u_deg)
    assert shape.lean_u_deg < 0.02
    assert shape.ratio == pytest.approx(1.0, abs=3.0 * shape.ratio_u)
    with pytest.raises(VisionError, match="found in 3 pictures"):
        fit_shape(camera, found[:3])


def test_pictures_that_are_alike_count_once_for_a_ruler():
    """Twenty frames of one pose hold the same errors of lens and marks twenty times."""
    surfaces, size = ruler_surfaces(RULER, 5e-4)
    (picture,) = views(surfaces, size, OPTICS, np.random.default_rng(3), 1)
    found = squareness.collect(20 * [picture], CALIBRATIONS.camera, RULER.marks, 20)
    assert len(found) == 1
    with pytest.raises(VisionError, match="found in 1 pictures that differ"):
        fit_shape(CALIBRATIONS.camera, found)


def test_pictures_of_another_mode_than_the_lens_s_are_refused():
    half = np.zeros((360, 640, 3), np.uint8)
    with pytest.raises(VisionError, match="The image is 640x360, but the camera calibration is"):
        squareness.collect([half], CALIBRATIONS.camera, RULER.marks, 20)


def test_head_on_views_are_no_calibration_of_a_lens():
    lens = Lens(1280, 720, 2100.0, 2100.0, 640.0, 360.0, (-0.1, 0.05, 0.0, 0.0, 0.0))
    rng = np.random.default_rng(11)
    across, down = np.meshgrid(np.arange(8), np.arange(5))
    corners = 0.016 * np.column_stack([across.ravel(), down.ravel()]) - [0.056, 0.032]
    square_on = []
    for distance in np.linspace(0.3, 0.36, 9):
        pixels = aim(lens, float(distance), 0.0, 0.0, 0.0).project(corners)
        square_on.append(View(corners, pixels + 0.03 * rng.standard_normal(pixels.shape)))
    with pytest.raises(VisionError, match="do not tell the focal length from the distance"):
        fit_lens(square_on, (1280, 720))
