"""A frame that cannot be trusted is rejected with a reason, never guessed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rig.vision.errors import VisionError
from rig.vision.measure import AngleMeter
from tests.vision.synthetic import CAMERA, RULER, Scene, render


def rejection(image: np.ndarray, meter: AngleMeter | None = None) -> str:
    result = (meter or AngleMeter(CAMERA, RULER)).measure(image)
    assert not result.accepted
    assert result.angle_deg is None
    assert result.quality == 0.0
    assert result.u_deg == 0.0
    return result.reason


def flat(level: int) -> np.ndarray:
    return np.full((720, 1280, 3), level, np.uint8)


def test_a_black_frame_is_too_dark():
    assert "too dark" in rejection(flat(0))


def test_a_white_frame_is_overexposed():
    assert "overexposed" in rejection(flat(255))


def test_a_grey_frame_has_no_actuator():
    assert "no actuator" in rejection(flat(120))


def test_noise_is_no_actuator():
    noise = np.random.default_rng(1).integers(0, 256, (720, 1280, 3)).astype(np.uint8)
    assert rejection(noise)


def test_a_wholly_blue_frame_is_no_actuator():
    blue = flat(0)
    blue[..., 0] = 220
    assert "only one blue part" in rejection(blue)


def test_a_bench_without_the_actuator_is_no_actuator():
    assert "no actuator" in rejection(render(Scene(cap=False, connector=False)))


def test_a_removed_cap_is_missed():
    assert "only one blue part" in rejection(render(Scene(cap=False)))


def test_a_removed_connector_is_missed():
    assert "only one blue part" in rejection(render(Scene(connector=False)))


@pytest.mark.parametrize("share", [0.75, 0.85, 0.95, 1.05])
def test_a_cap_hidden_for_the_most_part_is_not_trusted(share):
    assert rejection(render(Scene(cap_hidden=share)))


@pytest.mark.parametrize("share", [0.2, 0.4, 0.6])
def test_what_is_left_of_a_partly_hidden_cap_is_right_or_rejected(share):
    result = AngleMeter(CAMERA, RULER).measure(render(Scene(cap_hidden=share)))
    assert not result.accepted or abs(result.angle_deg - 40.0) < 3.0 * result.u_deg


def test_a_cap_with_something_across_its_middle_is_ambiguous():
    image = render(Scene(angle=90.0))
    outline = AngleMeter(CAMERA, RULER).measure(image).geometry.cap.outline
    middle = outline.mean(axis=0).astype(int)
    image[middle[1] - 12 : middle[1] + 12, middle[0] - 60 : middle[0] + 60] = 110
    assert "could be the end cap" in rejection(image)


def test_two_caps_are_ambiguous():
    assert "2 blue parts could be the end cap" in rejection(render(Scene(caps=2)))


def test_a_cap_behind_a_slanted_card_is_right_or_rejected():
    """The card's own edge must not be taken for the cap's."""
    for slant in (10.0, 20.0, 35.0):
        image = render(Scene(angle=0.0, roll=0.0))
        box = AngleMeter(CAMERA, RULER).measure(image).geometry.cap.outline
        (left, top), (right, bottom) = box.min(axis=0), box.max(axis=0)
        rows, columns = np.mgrid[:720, :1280]
        line = top + 3.0 + np.tan(np.radians(slant)) * (columns - left)
        card = (rows > line) & (columns > left - 30) & (columns < right + 30)
        card &= rows < bottom + 60
        image[card] = 115
        result = AngleMeter(CAMERA, RULER).measure(image)
        assert not result.accepted or abs(result.angle_deg) < max(3.0 * result.u_deg, 0.3)


@pytest.mark.parametrize("blur", [3.0, 5.0, 6.0])
def test_a_soft_frame_is_right_within_its_uncertainty_or_rejected(blur):
    result = AngleMeter(CAMERA).measure(render(Scene(blur=blur)))
    assert not result.accepted or abs(result.angle_deg - 40.0) < 2.0 * result.u_deg


@pytest.mark.parametrize("blur", [4.0, 5.0])
def test_a_blurred_frame_is_not_trusted(blur):
    small = np.ascontiguousarray(render(Scene(blur=blur))[:600, :620])  # too small to halve
    assert "too blurred" in rejection(small, AngleMeter())


@pytest.mark.parametrize("blur", [10.0, 14.0])
def test_a_frame_that_is_blurred_beyond_recognition_is_not_trusted(blur):
    image = render(Scene(blur=blur))
    rejection(image, AngleMeter(CAMERA))
    assert "ruler not found" in rejection(image) or "blue part" in rejection(image)


def test_an_underexposed_frame_is_not_trusted():
    assert "too dark" in rejection(render(Scene(gain=0.01)))


def test_an_overexposed_actuator_is_not_trusted():
    assert "overexposed" in rejection(render(Scene(gain=6.0)))


def test_a_cap_at_the_border_is_cut():
    assert "cut by the border" in rejection(render(Scene(offset=(-85.0, -46.0))))


def test_an_actuator_upside_down_is_not_measured():
    image = np.ascontiguousarray(render(Scene())[::-1])
    assert "connector must be on top" in rejection(image, AngleMeter())


def test_a_tip_that_curls_to_the_other_side_is_named():
    image = np.ascontiguousarray(render(Scene(angle=60.0))[:, ::-1])
    assert "curls to the right by 60 deg" in rejection(image, AngleMeter())


def test_a_missing_ruler_is_named():
    assert "ruler not found" in rejection(render(Scene(ruler=False)))


def test_a_missing_ruler_can_be_allowed():
    meter = AngleMeter(CAMERA, RULER, ruler_required=False)
    result = meter.measure(render(Scene(ruler=False)))
    assert result.accepted
    assert result.u_deg > 0.9


def test_a_hidden_corner_of_the_ruler_is_not_guessed():
    assert "ruler not found" in rejection(render(Scene(hidden_marks=(0,))))


def test_a_ruler_with_more_marks_than_calibrated_is_not_taken():
    other = RULER.model_copy(update={"marks": 9})
    assert "ruler not found" in rejection(render(Scene()), AngleMeter(CAMERA, other))


def test_an_image_of_another_size_than_the_calibration_says_so():
    with pytest.raises(VisionError, match=r"640x480.*1280x720"):
        AngleMeter(CAMERA).measure(np.zeros((480, 640, 3), np.uint8))


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((10, 10), np.uint8),
        np.zeros((10, 10, 4), np.uint8),
        np.zeros((10, 10, 3), np.float32),
        np.zeros((0, 10, 3), np.uint8),
    ],
)
def test_an_array_that_is_no_colour_image_is_refused(image):
    with pytest.raises(VisionError, match="colour image"):
        AngleMeter().measure(image)


small_images = st.tuples(st.integers(1, 40), st.integers(1, 40)).flatmap(
    lambda size: arrays(np.uint8, (*size, 3))
)


@settings(max_examples=150)
@given(image=small_images, bends=st.sampled_from(["left", "right"]))
def test_no_small_image_whatsoever_crashes(image, bends):
    result = AngleMeter(ruler=RULER, ruler_required=False, bends=bends).measure(image)
    assert result.accepted == (result.angle_deg is not None)
    assert result.accepted or result.reason


@settings(max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(0, 40),
    size=st.sampled_from([(90, 120), (391, 391), (720, 1280), (400, 30)]),
)
def test_no_picture_of_random_blue_white_and_black_shapes_crashes(seed, count, size):
    image = blocks(np.random.default_rng(seed), count, size)
    result = AngleMeter(ruler=RULER, ruler_required=False).measure(image)
    assert result.accepted == (result.angle_deg is not None)
    assert result.accepted or result.reason
    assert 0.0 <= result.quality <= 1.0


def blocks(rng: np.random.Generator, count: int, size: tuple[int, int]) -> np.ndarray:
    """Rectangles and discs in the colours that the search looks for."""
    import cv2

    image = np.full((*size, 3), 40, np.uint8)
    for _ in range(count):
        colour = [(190, 60, 20), (225, 225, 225), (20, 20, 20), (150, 200, 210)][rng.integers(4)]
        place = rng.integers(0, [size[1], size[0]]).tolist()
        if rng.random() < 0.5:
            cv2.circle(image, place, int(rng.integers(1, 40)), colour, -1)
        else:
            box = (place, rng.uniform(2, 300, 2).tolist(), float(rng.uniform(0, 180)))
            cv2.fillPoly(image, [cv2.boxPoints(box).astype(np.int32)], colour)
    return image
