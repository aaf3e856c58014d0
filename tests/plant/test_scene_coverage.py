"""Pixel coverage is exact: areas, fractions, clipping, either sense of rotation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.plant.coverage import Box, bounding_box, coverage

PICTURE = Box(0, 0, 60, 50)


def star(seed, vertices=9, centre=(30, 25)):
    """A random polygon, star-shaped about `centre`."""
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * (np.arange(vertices) + rng.uniform(0, 1, vertices)) / vertices
    radius = rng.uniform(3, 20, vertices)
    return centre + radius[:, None] * np.column_stack((np.cos(turn), np.sin(turn)))


def area_and_centroid(polygon):
    x, y = polygon.T
    following_x, following_y = np.roll(x, -1), np.roll(y, -1)
    cross = x * following_y - following_x * y
    area = cross.sum() / 2
    centre = np.array([((x + following_x) * cross).sum(), ((y + following_y) * cross).sum()])
    return abs(area), centre / (6 * area)


def test_a_square_covers_fractions_of_the_pixels_at_its_border():
    square = np.array([(1.25, 2.0), (4.75, 2.0), (4.75, 4.5), (1.25, 4.5)])
    covered = coverage(square, Box(0, 0, 7, 7))
    across = [0, 0.25, 1, 1, 1, 0.25, 0]
    down = [0, 0, 0.5, 1, 1, 0, 0]
    np.testing.assert_allclose(covered, np.outer(down, across), atol=1e-6)


@given(st.integers(0, 10**6))
def test_the_sum_of_the_coverage_is_the_area_of_the_polygon(seed):
    polygon = star(seed)
    area, _ = area_and_centroid(polygon)
    assert coverage(polygon, PICTURE).sum(dtype=float) == pytest.approx(area, abs=1e-3)


@given(st.integers(0, 10**6))
def test_coverage_agrees_with_fine_sampling(seed):
    polygon = star(seed)
    fine = 8
    step = (np.arange(60 * fine) + 0.5) / fine - 0.5
    x, y = np.meshgrid(step, step[: 50 * fine])
    inside = np.zeros(x.shape, bool)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        with np.errstate(divide="ignore", invalid="ignore"):
            crosses = ((y0 > y) != (y1 > y)) & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
        inside ^= crosses
    sampled = inside.reshape(50, fine, 60, fine).mean(axis=(1, 3))
    assert np.abs(coverage(polygon, PICTURE) - sampled).max() < 0.2
    assert np.abs((coverage(polygon, PICTURE) - sampled).mean()) < 1e-3


@given(st.integers(0, 10**6))
def test_the_sense_of_rotation_does_not_matter(seed):
    polygon = star(seed)
    np.testing.assert_allclose(
        coverage(polygon, PICTURE), coverage(polygon[::-1], PICTURE), atol=1e-6
    )


@given(st.integers(0, 10**6), st.tuples(*4 * [st.integers(0, 25)]))
def test_a_smaller_box_shows_the_same_coverage(seed, cut):
    polygon = star(seed)
    box = Box(cut[0], cut[1], 60 - cut[2], 50 - cut[3])
    whole = coverage(polygon, PICTURE)
    np.testing.assert_allclose(coverage(polygon, box), whole[box.slices], atol=1e-6)


def test_a_region_enclosed_twice_counts_once():
    inner = np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 7.5), (1.5, 7.5)])
    twice = np.concatenate((inner, inner))
    np.testing.assert_allclose(
        coverage(twice, Box(0, 0, 10, 10)), coverage(inner, Box(0, 0, 10, 10)), atol=1e-6
    )


def test_a_polygon_outside_the_box_covers_nothing_of_it():
    for shift in ((100, 0), (-100, 0), (0, 100), (0, -100)):
        assert coverage(star(1) + shift, PICTURE).max() < 1e-12


def test_an_empty_box_has_no_coverage():
    assert coverage(star(1), Box(10, 10, 10, 20)).shape == (10, 0)


@pytest.mark.parametrize("slope_deg", [0.0, 0.7, 3.0, 17.0, 44.0])
def test_straight_edges_lie_where_they_should_to_a_thousandth_of_a_pixel(slope_deg):
    """Summed along a row, the coverage of a half plane ends at its border."""
    slope = np.tan(np.deg2rad(slope_deg))
    rows = np.arange(40)
    start = 12.345
    edge = np.array([(start, -0.5), (start + 40 * slope, 39.5), (-200.0, 39.5), (-200.0, -0.5)])
    covered = coverage(edge, Box(0, 0, 80, 40)).sum(axis=1, dtype=float)
    expected = start + slope * (rows + 0.5) + 0.5
    np.testing.assert_allclose(covered, expected, atol=1e-3)


def test_a_bounding_box_holds_all_touched_pixels_and_stays_in_the_picture():
    polygon = np.array([(3.6, 5.2), (58.0, 5.2), (58.0, 90.0)])
    assert bounding_box([polygon], 0, PICTURE) == Box(4, 5, 59, 50)
    assert bounding_box([polygon], 3, PICTURE) == Box(1, 2, 60, 50)
    assert bounding_box([polygon + 500], 3, PICTURE).empty
