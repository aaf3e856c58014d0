"""The image stress set: a few of its pictures here, all of them when there is time.

`python -m tests.bench stress` prints the table.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.vision.stress import Conditions, halton, nominal, render, score

FEW, MANY, MORE = 10, 300, 700
OTHER_SEED = 11
"""Of a second sample: the share of intervals that hold needs more pictures than errors do."""
MANY_REJECTED = 0.4
"""Share of the stress set that may be rejected; many of its scenes hide the cap or are as blue."""


def test_nominal_pictures_are_right_within_a_tenth_of_a_degree_rms():
    found = score(nominal(FEW))
    assert found.reasons == {}
    assert found.rms < 0.1


def test_what_is_accepted_of_spoilt_pictures_is_right():
    found = score(halton(FEW))
    assert len(found.errors) >= (1.0 - MANY_REJECTED) * FEW
    assert found.rms < 0.5
    assert found.wrong == 0


@pytest.mark.slow
def test_all_of_the_stress_set_is_right_or_rejected():
    ordinary, spoilt = score(nominal(MANY // 5)), score(halton(MANY))
    more = score(halton(MORE, OTHER_SEED))
    assert ordinary.reasons == {}
    assert ordinary.rms < 0.1
    assert ordinary.wrong == 0
    assert len(spoilt.errors) >= (1.0 - MANY_REJECTED) * MANY
    assert spoilt.rms < 0.5
    assert spoilt.wrong == 0
    assert more.rms < 0.5
    held = spoilt.covered * len(spoilt.errors) + more.covered * len(more.errors)
    assert 0.93 <= held / (len(spoilt.errors) + len(more.errors)) <= 0.97


def test_the_truth_of_a_picture_is_where_its_cap_points():
    """By hand: the blue pixels of a clean, square, flat picture of the straight and bent actuator.

    Nothing of the vision or the renderer tells the angle here but the pixels.
    """
    clean = {"off_normal": 0.0, "roll": 0.0, "k1": 0.0, "noise": 0.0, "blur": 0.0, "gradient": 0.0}
    for bend in (0.0, 90.0):
        image = render(Conditions(bend=bend, side="right", **clean)).image.astype(int)
        blue = image[..., 0] - np.maximum(image[..., 1], image[..., 2]) > 60
        rows, columns = np.nonzero(blue)
        below = rows > rows.min() + 60  # the cap, not the connector
        height, width = np.ptp(rows[below]), np.ptp(columns[below])
        assert (width > 5 * height) if bend == 0.0 else (height > 5 * width)
        assert bend == 0.0 or columns[below].mean() > columns[~below].mean()


def test_the_stress_set_covers_what_it_is_meant_to():
    scenes = halton(MANY)
    assert {s.side for s in scenes} == {"left", "right"}
    assert {s.width for s in scenes} == {640, 800, 1280, 1920}
    assert min(s.bend for s in scenes) < 2.0
    assert max(s.bend for s in scenes) > 168.0
    assert max(s.off_normal for s in scenes) > 14.5
    assert min(s.exposure for s in scenes) < 0.1
    assert sum(s.glare > 0.0 for s in scenes) > 0.5 * MANY
    assert sum(s.clutter > 0 for s in scenes) > 0.5 * MANY
    assert sum(s.background is not None for s in scenes) > 0.5 * MANY
    assert sum(s.hidden != 0.0 for s in scenes) > 0.4 * MANY
