"""The marks of the ruler and the plane through them."""

from __future__ import annotations

import numpy as np
import pytest

from rig.vision.errors import UntrustedFrameError
from rig.vision.plane import PicturePlane, rectify
from rig.vision.ruler import RulerMarks, find_ruler
from rig.vision.segment import pyramid
from tests.vision.synthetic import CAMERA, RULER, Scene, project, render

CORNER = np.array([13.0, -33.0])  # mm, of the unturned synthetic ruler


def true_pixels(scene: Scene, marks: RulerMarks) -> np.ndarray:
    return project(scene, CORNER + 10.0 * marks.grid)


@pytest.mark.parametrize("seed", range(4))
def test_marks_are_found_to_a_fraction_of_a_pixel(seed):
    scene = Scene(seed=seed, roll=-1.0 + 0.7 * seed)
    marks = find_ruler(pyramid(render(scene)), 7)
    assert len(marks.grid) == 15
    misses = marks.pixels - true_pixels(scene, marks)
    assert np.sqrt((misses**2).sum(axis=1).mean()) < 0.03


def test_the_grid_starts_in_the_corner_and_is_not_mirrored():
    marks = find_ruler(pyramid(render(Scene())), 7)
    assert marks.grid[0].tolist() == [0.0, 0.0]
    x, y = (marks.pixels[marks.grid.tolist().index(g)] - marks.pixels[0] for g in ([7, 0], [0, 7]))
    assert x[0] * y[1] - x[1] * y[0] > 0.0


@pytest.mark.parametrize("hidden", [2, 4, 10])
def test_one_hidden_mark_keeps_its_place_free(hidden):
    marks = find_ruler(pyramid(render(Scene(hidden_marks=(hidden,)))), 7)
    assert len(marks.grid) == 14
    missing = [hidden, 0] if hidden <= 7 else [0, hidden - 7]
    assert missing not in marks.grid.tolist()
    assert np.abs(marks.pixels - true_pixels(Scene(), marks)).max() < 0.2


def test_the_plane_maps_marks_onto_their_grid():
    scene = Scene(tilt_x=8.0, tilt_y=-6.0, distance=350.0)
    plane = rectify(CAMERA, RULER, find_ruler(pyramid(render(scene)), 7))
    assert plane.rectification.residual_px < 0.1


def test_a_lens_that_is_not_taken_out_shows_in_the_residual():
    strong = CAMERA.model_copy(update={"distortion": (-0.45, 0.2, 0.0, 0.0, 0.0)})
    marks = find_ruler(pyramid(render(Scene(), strong)), 7)
    corrected = rectify(strong, RULER, marks)
    assert corrected.rectification.residual_px < 0.1
    assert rectify(None, RULER, marks).rectification.residual_px > 3 * (
        corrected.rectification.residual_px
    )


def test_marks_that_fit_no_plane_grid_are_refused():
    marks = find_ruler(pyramid(render(Scene())), 7)
    bent = marks.pixels + np.array([0.0, 3.0]) * (marks.grid[:, :1] % 2)
    with pytest.raises(UntrustedFrameError, match="miss a plane grid"):
        rectify(CAMERA, RULER, RulerMarks(bent, marks.grid))


def test_the_uncertainty_of_the_plane_grows_with_the_scatter_of_the_marks():
    marks = find_ruler(pyramid(render(Scene())), 7)
    rng = np.random.default_rng(3)
    rough = RulerMarks(marks.pixels + 0.3 * rng.standard_normal(marks.pixels.shape), marks.grid)
    segments = np.array([[300.0, 60.0], [420.0, 60.0]]), np.array([[250.0, 400.0], [200.0, 300.0]])
    fine, coarse = (rectify(CAMERA, RULER, m).u_turn(*segments) for m in (marks, rough))
    assert coarse > 3.0 * fine


def test_the_stated_uncertainty_of_a_turn_is_the_scatter_that_mark_noise_causes():
    marks = find_ruler(pyramid(render(Scene())), 7)
    plane = rectify(CAMERA, RULER, marks)
    exact = RulerMarks(true_pixels(Scene(), marks), marks.grid)
    first, second = (
        np.array([[300.0, 60.0], [420.0, 60.0]]),
        np.array([[250.0, 400.0], [200.0, 300.0]]),
    )
    rng = np.random.default_rng(7)
    turns, stated = [], []
    for _ in range(150):
        noisy = RulerMarks(exact.pixels + 0.1 * rng.standard_normal((15, 2)), exact.grid)
        plane = rectify(CAMERA, RULER, noisy)
        turns.append(plane.turn(first, second))
        stated.append(plane.u_turn(first, second))
    assert np.std(turns) == pytest.approx(np.mean(stated), rel=0.2)


def test_a_ruler_out_of_square_shears_what_it_measures():
    marks = find_ruler(pyramid(render(Scene())), 7)
    segments = np.array([[300.0, 60.0], [420.0, 60.0]]), np.array([[250.0, 400.0], [250.0, 300.0]])
    sure = rectify(CAMERA, RULER, marks).u_turn(*segments)
    leaning = RULER.model_copy(update={"squareness_u_deg": 0.5})
    unsure = rectify(CAMERA, leaning, marks).u_turn(*segments)
    assert np.degrees(np.sqrt(unsure**2 - sure**2)) == pytest.approx(0.5, rel=0.02)


def test_without_ruler_the_plane_is_the_picture():
    plane = PicturePlane(None)
    level, slanted = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[0.0, 0.0], [10.0, 10.0]])
    assert plane.turn(level, slanted) == pytest.approx(np.pi / 4)
    assert plane.u_turn(level, slanted) == 0.0
    assert plane.scale_mm_per_px(np.array([5.0, 5.0])) is None
