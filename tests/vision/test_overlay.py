"""Overlays show the result and leave the frame alone."""

from __future__ import annotations

import numpy as np
import pytest

from rig.vision.measure import AngleMeter
from rig.vision.overlay import CAP, CONNECTOR, MARKS, draw_overlay
from tests.vision.synthetic import Scene, render


def has_colour(image: np.ndarray, colour: tuple[int, int, int]) -> bool:
    return bool((np.abs(image.astype(int) - colour).max(axis=2) < 25).sum() > 20)


@pytest.mark.parametrize("angle", [0.0, 45.0, 120.0])
def test_an_accepted_frame_shows_edges_and_marks(meter, angle):
    image = render(Scene(angle=angle))
    before = image.copy()
    drawn = draw_overlay(image, meter.measure(image))
    assert drawn.shape == image.shape
    assert np.array_equal(image, before)
    for colour in (CONNECTOR, CAP, MARKS):
        assert has_colour(drawn, colour)
        assert not has_colour(image, colour)


def test_the_edges_are_drawn_where_the_parts_are(meter):
    image = render(Scene(angle=45.0))
    geometry = meter.measure(image).geometry
    for part in (geometry.connector, geometry.cap):
        low, high = part.outline.min(axis=0) - 3.0, part.outline.max(axis=0) + 3.0
        for edge in part.edges:
            assert (edge >= low).all()
            assert (edge <= high).all()


def test_a_rejected_frame_shows_why(meter):
    image = render(Scene(caps=2))
    result = meter.measure(image)
    drawn = draw_overlay(image, result)
    assert not result.accepted
    assert not np.array_equal(drawn[-60:], image[-60:])


@pytest.mark.parametrize("size", [(1, 1), (20, 30), (64, 2000), (900, 60)])
def test_frames_of_any_size_take_an_overlay(size):
    image = np.full((*size, 3), 90, np.uint8)
    assert draw_overlay(image, AngleMeter().measure(image)).shape == (*size, 3)
