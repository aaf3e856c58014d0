"""The six closure equations of the deformed half convolution."""

from __future__ import annotations

import numpy as np
import pytest
from bellow_strategies import bending_bellows
from hypothesis import given
from hypothesis import strategies as st

from rig.mechanics.bellow import BellowShape
from rig.mechanics.convolution import UNFOLDED, HalfConvolution, unfold


def _trace(unfolded):
    """Walk trough arc, flank and crest arc with small steps; end point and end heading."""
    share = (np.arange(20000) + 0.5) / 20000
    trough, crest = float(unfolded.trough_angle), float(unfolded.crest_angle)
    headings = np.concatenate([share * trough, np.full_like(share, trough), trough - share * crest])
    lengths = np.repeat(
        [
            float(unfolded.trough_radius) * trough,
            float(unfolded.flank),
            float(unfolded.crest_radius) * crest,
        ],
        share.size,
    )
    steps = lengths / share.size
    return steps @ np.cos(headings), steps @ np.sin(headings), trough - crest


@given(geometry=bending_bellows(), part=st.floats(-0.2, 0.999))
def test_unfolding_a_straight_bellow_keeps_the_arc_lengths(geometry, part):
    half = BellowShape.of(geometry).middle_surface
    growth = part * half.max_elongation
    unfolded = unfold(half, half.half_length + growth)
    quarter = np.pi / 2
    for deformed, kept in (
        (unfolded.crest_radius * unfolded.crest_angle, half.crest_radius * quarter),
        (unfolded.trough_radius * unfolded.trough_angle, half.trough_radius * quarter),
        (unfolded.flank, half.flank),
    ):
        assert float(deformed) == pytest.approx(kept, rel=1e-9)
    assert float(unfolded.crest_angle) == pytest.approx(float(unfolded.trough_angle), rel=1e-12)
    tilt = np.pi / 2 - float(unfolded.trough_angle)
    assert float(unfolded.flank_tilt) == pytest.approx(tilt, abs=1e-12)
    assert float(unfolded.u) == pytest.approx(half.half_length + growth, rel=1e-10)


@given(geometry=bending_bellows(), part=st.floats(0.0, 0.9), wedge=st.floats(-0.02, 0.3))
def test_a_walk_along_the_surface_ends_on_the_crests_symmetry_line(geometry, part, wedge):
    half = BellowShape.of(geometry).middle_surface
    width = half.half_length + part * half.max_elongation
    unfolded = unfold(half, width, wedge, slope=np.tan(wedge / 2))
    u, v, heading = _trace(unfolded)
    assert u == pytest.approx(float(unfolded.u), rel=1e-6)
    assert v == pytest.approx(float(unfolded.v), rel=1e-6, abs=1e-9)
    assert heading == pytest.approx(-wedge, abs=1e-12)
    assert u - np.tan(wedge / 2) * v == pytest.approx(width, rel=1e-6)


def test_no_growth_changes_nothing():
    half = HalfConvolution(crest_radius=3.5e-3, trough_radius=2e-3, flank=2.5e-3)
    unfolded = unfold(half, half.half_length)
    assert float(unfolded.crest_radius) == pytest.approx(3.5e-3, rel=1e-12)
    assert float(unfolded.trough_radius) == pytest.approx(2e-3, rel=1e-12)
    assert float(unfolded.trough_angle) == pytest.approx(np.pi / 2, rel=1e-12)
    assert float(unfolded.v) == pytest.approx(8e-3, rel=1e-12)


def test_beyond_unfolding_everything_stretches_alike():
    half = HalfConvolution(crest_radius=3.5e-3, trough_radius=2e-3, flank=2.5e-3)
    longest = half.half_length + half.max_elongation
    below, above = unfold(half, [0.999999 * longest, 1.2 * longest], 0.0).stretch
    assert below == 1.0
    assert above == pytest.approx(1.2, rel=1e-12)
    unfolded = unfold(half, 1.2 * longest)
    assert float(unfolded.trough_angle) == UNFOLDED
    assert float(unfolded.flank) == pytest.approx(1.2 * half.flank, rel=1e-12)


def test_shapes_of_widths_and_wedges_broadcast():
    half = HalfConvolution(crest_radius=3.5e-3, trough_radius=2e-3, flank=2.5e-3)
    unfolded = unfold(half, half.half_length * np.ones((3, 1)), np.zeros(4))
    assert unfolded.u.shape == unfolded.stretch.shape == (3, 4)
