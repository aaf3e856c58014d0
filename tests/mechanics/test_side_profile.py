"""The deformed outlines, the workspace and the cavity volume as functions of the angle."""

from __future__ import annotations

import time

import numpy as np
import pytest
from bellow_strategies import bending_bellows
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.mechanics.bellow import BellowShape
from rig.mechanics.profile import (
    bent_convolution,
    cavity_volume,
    side_profile,
    tip_position,
    unfolding_angle,
    wrap,
)
from rig.mechanics.section import polygon_integrals

WORKING_ANGLES = st.floats(np.radians(-15), np.radians(170))
PARTS = ("connector", "bellow", "bottom_layer", "end_cap")


def _crossings(outline):
    """How many pairs of edges that share no corner cross each other properly."""
    start, end = outline, np.roll(outline, -1, axis=0)
    edge = end - start

    def side(point):
        offset = point[np.newaxis] - start[:, np.newaxis]
        return edge[:, np.newaxis, 0] * offset[..., 1] - edge[:, np.newaxis, 1] * offset[..., 0]

    # areas below 1e-16 m2 are touching within round-off, not crossing
    first, second = side(start), side(end)
    apart = (np.minimum(first, second) < -1e-16) & (np.maximum(first, second) > 1e-16)
    crossing = apart & apart.T
    return int(crossing.sum() // 2)


@given(geometry=bending_bellows(), angle=WORKING_ANGLES)
def test_the_end_cap_is_rigid_and_turned_by_exactly_the_angle(geometry, angle):
    profile, straight = side_profile(geometry, angle), side_profile(geometry, 0.0)
    np.testing.assert_array_equal(profile.connector, straight.connector)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    before = np.roll(straight.end_cap, -1, axis=0) - straight.end_cap
    after = np.roll(profile.end_cap, -1, axis=0) - profile.end_cap
    np.testing.assert_allclose(after, before @ turn.T, atol=1e-14)


@settings(max_examples=60)
@given(geometry=bending_bellows(), part=st.floats(0, 1))
def test_outlines_are_simple_and_counter_clockwise_until_unfolded(geometry, part):
    angle = part * min(unfolding_angle(geometry), np.radians(170))
    profile = side_profile(geometry, angle)
    for name in PARTS:
        outline = getattr(profile, name)
        assert polygon_integrals(outline)[0] > 0, name
        assert not np.allclose(outline[0], outline[-1], atol=1e-9), name
        assert _crossings(outline) == 0, name


@pytest.mark.parametrize("angle_deg", [-15, -5, 0, 1e-9, 30, 90, 130, 170])
def test_outlines_of_the_default_are_simple_over_the_whole_range(default_geometry, angle_deg):
    profile = side_profile(default_geometry, np.radians(angle_deg))
    for name in PARTS:
        assert _crossings(getattr(profile, name)) == 0, name


def test_the_straight_profile_is_the_drawing(default_geometry):
    shape = BellowShape.of(default_geometry)
    profile = side_profile(default_geometry, 0.0)
    millimetres = {name: getattr(profile, name) * 1e3 for name in PARTS}
    assert millimetres["connector"].min(0) == pytest.approx([-7.5, -13])
    assert millimetres["connector"].max(0) == pytest.approx([-1.5, 5])
    assert millimetres["bottom_layer"].min(0) == pytest.approx([-1.5, -13])
    assert millimetres["bottom_layer"].max(0) == pytest.approx([67.5, -10])
    assert millimetres["end_cap"].min(0) == pytest.approx([67.5, -13])
    assert millimetres["end_cap"].max(0) == pytest.approx([69, 3.5])
    assert millimetres["bellow"].min(0) == pytest.approx([-1.5, -10])
    assert millimetres["bellow"].max(0) == pytest.approx([67.5, 11.5], abs=1e-6)
    exact = shape.outer_profile(samples=10)
    upper = profile.bellow[profile.bellow[:, 1] >= shape.end_wall_top - 1e-9]
    gaps = np.linalg.norm(exact[:, np.newaxis] - upper[np.newaxis], axis=2).min(axis=1)
    assert gaps.max() < 1e-8


@given(geometry=bending_bellows(), part=st.floats(-0.1, 0.999))
def test_bending_keeps_the_arc_lengths(geometry, part):
    half = BellowShape.of(geometry).middle_surface
    bent = bent_convolution(geometry, part * unfolding_angle(geometry))
    quarter = np.pi / 2
    assert float(bent.crest_radius * bent.crest_angle) == pytest.approx(
        half.crest_radius * quarter, rel=1e-9
    )
    assert float(bent.trough_radius * bent.trough_angle) == pytest.approx(
        half.trough_radius * quarter, rel=1e-9
    )
    assert float(bent.flank) == pytest.approx(half.flank, rel=1e-9)


@given(geometry=bending_bellows(), angle=WORKING_ANGLES)
def test_the_underside_keeps_its_length(geometry, angle):
    shape = BellowShape.of(geometry)
    x = np.linspace(0, shape.effective_length, 2001)
    underside = wrap(shape, angle, x, 0.0)
    length = np.linalg.norm(np.diff(underside, axis=0), axis=1).sum()
    assert length == pytest.approx(shape.effective_length, rel=1e-6)


@given(geometry=bending_bellows(), angle=WORKING_ANGLES)
def test_length_difference_between_top_and_underside_is_the_papers(geometry, angle):
    """Eq. (9) read backwards: at the height 2 ro + tb the arc is longer by that times Theta."""
    shape = BellowShape.of(geometry)
    height = 2 * shape.outer_radius + shape.bottom_thickness
    x = np.linspace(0, shape.effective_length, 4001)
    top = wrap(shape, angle, x, height)
    length = np.linalg.norm(np.diff(top, axis=0), axis=1).sum()
    growth = angle * height
    assert length == pytest.approx(abs(shape.effective_length + growth), rel=1e-6, abs=1e-9)


def test_outlines_move_smoothly_with_the_angle(default_geometry):
    """No jumps: a hundredth of a degree moves no corner by more than a rotation about the clamp."""
    reach = 0.09
    angles = np.radians(np.arange(-15, 170, 0.25))
    step = np.radians(0.01)
    for angle in angles:
        before, after = (side_profile(default_geometry, a) for a in (angle, angle + step))
        for name in PARTS:
            moved = np.abs(getattr(after, name) - getattr(before, name)).max()
            assert moved < reach * step, (np.degrees(angle), name)


def test_tip_of_the_workspace_is_the_lower_far_corner_of_the_cap(default_geometry):
    angles = np.radians([-10, 0, 45, 120])
    tips = tip_position(default_geometry, angles)
    assert tips.shape == (4, 2)
    np.testing.assert_allclose(tips[1], [69e-3, -13e-3], atol=1e-15)
    for angle, tip in zip(angles, tips, strict=True):
        cap = side_profile(default_geometry, angle).end_cap
        assert np.linalg.norm(cap - tip, axis=1).min() < 1e-15
    assert np.all(np.diff(tips[:, 0])[1:] < 0)
    assert tips[3, 1] < tips[2, 1] < tips[1, 1] < tips[0, 1]


@given(geometry=bending_bellows())
def test_cavity_of_the_straight_bellow_is_the_undeformed_one(geometry):
    exact = BellowShape.of(geometry).cavity_volume
    assert float(cavity_volume(geometry, 0.0)) == pytest.approx(exact, rel=1e-5)


@settings(max_examples=60)
@given(geometry=bending_bellows())
def test_cavity_grows_with_bending_until_unfolded(geometry):
    highest = min(unfolding_angle(geometry), np.radians(170))
    volume = cavity_volume(geometry, np.linspace(-0.05 * highest, highest, 60))
    assert volume[0] > 0
    assert np.all(np.diff(volume) > 0)


def test_cavity_of_the_default_grows_over_the_whole_range(default_geometry):
    volume = cavity_volume(default_geometry, np.radians(np.arange(-15, 171)))
    assert np.all(np.diff(volume) > 0)


def test_a_side_profile_takes_less_than_a_millisecond(default_geometry):
    side_profile(default_geometry, 1.0)
    best = np.inf
    for _ in range(5):
        start = time.process_time()
        for angle in np.linspace(0, 2, 50):
            side_profile(default_geometry, angle)
        best = min(best, (time.process_time() - start) / 50)
    assert best < 1e-3
