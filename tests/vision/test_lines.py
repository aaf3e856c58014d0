"""Robust lines and straight runs of outlines."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.vision.edges import LEAST_CORRELATION, straight_runs
from rig.vision.lines import fit_line


def along(direction_deg: float, count: int = 100) -> np.ndarray:
    turn = np.radians(direction_deg)
    return np.linspace(-50, 50, count)[:, None] * np.array([np.cos(turn), np.sin(turn)])


def misses(fit, direction_deg: float) -> float:
    found = np.degrees(np.arctan2(fit.direction[1], fit.direction[0]))
    return (found - direction_deg + 90.0) % 180.0 - 90.0


@settings(max_examples=60)
@given(direction=st.floats(-180.0, 180.0), x=st.floats(-1e3, 1e3), y=st.floats(-1e3, 1e3))
def test_exact_points_give_their_line_wherever_it_lies(direction, x, y):
    fit = fit_line(along(direction) + np.array([x, y]), np.ones(100))
    assert misses(fit, direction) == pytest.approx(0.0, abs=1e-6)
    assert fit.rms_px == pytest.approx(0.0, abs=1e-6)


def test_a_fifth_of_outliers_barely_moves_the_line():
    rng = np.random.default_rng(5)
    points = along(30.0) + 0.05 * rng.standard_normal((100, 2))
    points[10:30] += np.array([-2.0, 3.5])
    assert abs(misses(fit_line(points, np.ones(100)), 30.0)) < 0.5


def test_the_stated_direction_uncertainty_is_the_scatter_of_the_direction():
    rng = np.random.default_rng(11)
    normal = np.array([-np.sin(0.5), np.cos(0.5)])
    fits = [
        fit_line(along(np.degrees(0.5)) + rng.normal(0, 0.1, (100, 1)) * normal, np.ones(100))
        for _ in range(300)
    ]
    scatter = np.std([np.radians(misses(fit, np.degrees(0.5))) for fit in fits])
    assert np.mean([fit.u_direction_rad for fit in fits]) == pytest.approx(scatter, rel=0.25)


@pytest.mark.parametrize(("correlation", "most"), [(0.0, 1.0), (0.6, 0.99)])
def test_the_interval_of_a_short_line_holds_its_direction(correlation, most):
    """As many points as a cap of 30 px has, which resemble each other as those of edges may."""
    rng, held, trials = np.random.default_rng(4), 0, 800
    for _ in range(trials):
        noise = rng.normal(0.0, 0.2, 26)
        for i in range(1, 26):
            noise[i] = correlation * noise[i - 1] + np.sqrt(1 - correlation**2) * noise[i]
        points = np.stack([np.arange(26.0), noise], axis=1)
        fit = fit_line(points, np.ones(26), LEAST_CORRELATION)
        held += abs(np.radians(misses(fit, 0.0))) < 1.96 * fit.u_direction_rad
    assert 0.93 < held / trials <= most


def test_correlated_scatter_claims_a_larger_uncertainty():
    rng = np.random.default_rng(2)
    white = rng.normal(0, 0.1, 100)
    slow = np.convolve(rng.normal(0, 0.1, 120), np.ones(15) / 15, mode="same")[10:110]
    slow *= white.std() / slow.std()
    normal = np.array([0.0, 1.0])
    independent, dependent = (
        fit_line(along(0.0) + noise[:, None] * normal, np.ones(100)) for noise in (white, slow)
    )
    assert dependent.u_direction_rad > 2.0 * independent.u_direction_rad


@pytest.mark.parametrize("turn", [0.0, 17.0, 45.0, 88.0])
def test_the_two_longest_runs_of_a_thin_rectangle_are_its_long_sides(turn):
    canvas = np.zeros((300, 300), np.uint8)
    box = cv2.boxPoints(((150.0, 150.0), (110.0, 11.0), turn))
    cv2.fillPoly(canvas, [np.rint(box).astype(np.int32)], 1)
    outline = cv2.findContours(canvas, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0][0][:, 0]
    runs = straight_runs(outline.astype(float), 300, 300)
    assert len(runs) == 2
    for run in runs:
        reach = run[-1] - run[0]
        assert np.hypot(*reach) > 100.0
        assert (np.degrees(np.arctan2(reach[1], reach[0])) - turn + 90) % 180 - 90 == (
            pytest.approx(0.0, abs=1.5)
        )


def test_a_cut_by_the_border_of_the_frame_is_no_edge():
    canvas = np.zeros((120, 200), np.uint8)
    canvas[:60, 20:180] = 1
    outline = cv2.findContours(canvas, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0][0][:, 0]
    runs = straight_runs(outline.astype(float), 200, 120)
    assert all(run[:, 1].max() > 5 for run in runs)
    assert runs[0][:, 1].min() > 50


def test_an_outline_of_a_few_pixels_has_no_runs():
    assert straight_runs(np.array([[5.0, 5.0], [6.0, 5.0], [6.0, 6.0]]), 100, 100) == []
