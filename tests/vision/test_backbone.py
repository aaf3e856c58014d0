"""The backbone of rendered actuators: the underside of the flat layer is an arc of known radius."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rig.mechanics.bellow import BellowShape
from rig.mechanics.profile import side_profile
from rig.validate.picture_budget import Picturing
from rig.validate.uncertainty import combine
from rig.vision.backbone import fit_backbone
from rig.vision.errors import UntrustedFrameError, VisionError
from rig.vision.measure import AngleMeter
from tests.vision.intervals import require_coverage
from tests.vision.test_track import CALIBRATIONS, LIBRARY, camera, frame

GEOMETRY = LIBRARY.actuator("bellow-bending").geometry
LENGTH_MM = 1e3 * BellowShape.of(GEOMETRY).effective_length


@pytest.fixture(scope="module")
def seen_camera():
    return camera(4)


def backbone(seen_camera, angle_deg):
    image = frame(seen_camera, angle_deg)
    seen = AngleMeter(CALIBRATIONS.camera, CALIBRATIONS.ruler).measure(image).sighting
    return image, seen, fit_backbone(image, seen)


@pytest.mark.parametrize("angle_deg", [20.0, 60.0, 110.0])
def test_the_radius_of_an_arc_is_its_length_over_its_angle(seen_camera, angle_deg):
    found = backbone(seen_camera, angle_deg)[2]
    assert found.radius_mm == pytest.approx(LENGTH_MM / np.radians(angle_deg), rel=0.01)
    assert found.residual_mm < 0.03


def test_a_straight_actuator_has_no_curvature(seen_camera):
    found = backbone(seen_camera, 0.0)[2]
    assert found.curvature_per_mm * LENGTH_MM < np.radians(1.0)
    assert found.angle_deg < 1.5


def test_the_turn_of_the_circle_is_near_the_bending_angle(seen_camera):
    """Not the same: the rigid end walls are straight, but the circle goes on through them."""
    found = backbone(seen_camera, 60.0)[2]
    assert 60.0 < found.angle_deg < 60.0 * 1.2


def turn_deg(angle_deg: float) -> float:
    """Turn about the middle of the true arc from the middle of the connector to the cap's."""
    profile = side_profile(GEOMETRY, np.radians(angle_deg))
    radius = 1e-3 * LENGTH_MM / np.radians(angle_deg)
    middle = np.array([0.0, BellowShape.of(GEOMETRY).underside - radius])
    one, other = (part.mean(axis=0) - middle for part in (profile.connector, profile.end_cap))
    return float(np.degrees(abs(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other))))


def measured(seed: int):
    """Errors and expanded uncertainties of curvature (1/mm) and turn (deg) on a bench of this seed.

    Its lens, viewpoint, light, noise and the pitch of its ruler are drawn.
    """
    rng = np.random.default_rng((seed, 7))
    ruler, angle_deg = CALIBRATIONS.ruler, float(rng.uniform(8.0, 130.0))
    truly = ruler.model_copy(update={"pitch": ruler.pitch + ruler.pitch_u * rng.normal()})
    image = frame(camera(seed, truly), angle_deg)
    seen = AngleMeter(CALIBRATIONS.camera, ruler).measure(image).sighting
    found = fit_backbone(image, seen)
    picturing = Picturing(CALIBRATIONS.camera, ruler, 0.0)
    bend = combine(found.curvature_per_mm, picturing.components(found.curvature_parts, "1/mm"))
    turn = combine(found.angle_deg, picturing.components(found.angle_parts, "deg"))
    return (
        (bend.value - np.radians(angle_deg) / LENGTH_MM, bend.u95),
        (turn.value - turn_deg(angle_deg), turn.u95),
    )


def test_the_intervals_of_curvature_and_turn_hold_the_truth():
    for pairs in zip(*(measured(seed) for seed in range(12)), strict=True):
        require_coverage(pairs, 0.75, 1.0)


@pytest.mark.slow
def test_of_many_backbones_as_many_as_said_are_within_their_intervals():
    for pairs in zip(*(measured(seed) for seed in range(300)), strict=True):
        require_coverage(pairs, 0.92, 0.99)


def test_what_is_not_round_is_told_and_uncertain(seen_camera):
    """The lower half of the picture pulled aside: no lens, no circle."""
    image, seen, round_ = backbone(seen_camera, 20.0)
    rows = np.arange(image.shape[0])[:, None]
    columns = np.arange(image.shape[1])[None, :]
    low, high = (part.centroid[1] for part in (seen.connector, seen.cap))
    pull = 6.0 * np.sin(2.0 * np.pi * (rows - low) / (high - low))
    where = [np.broadcast_to(m, image.shape[:2]).astype(np.float32) for m in (columns + pull, rows)]
    waved = fit_backbone(cv2.remap(image, *where, cv2.INTER_LINEAR), seen)
    assert waved.residual_mm > 10.0 * round_.residual_mm
    assert waved.curvature_parts.scatter_u > 10.0 * round_.curvature_parts.scatter_u


def test_without_a_body_there_is_no_backbone(seen_camera):
    image, seen, _ = backbone(seen_camera, 40.0)
    grey = image.copy()
    grey[:] = image.mean(axis=2, keepdims=True)
    with pytest.raises(UntrustedFrameError, match="no soft body"):
        fit_backbone(grey, seen)


def test_a_yellow_thing_beside_a_grey_body_is_no_backbone(seen_camera):
    image, seen, _ = backbone(seen_camera, 60.0)
    grey = image.copy()
    grey[:] = image.mean(axis=2, keepdims=True)
    low, high = (int(s * image.shape[0]) for s in (0.80, 0.97))
    grey[low:high, 20:700] = (150, 200, 212)
    with pytest.raises(UntrustedFrameError, match="does not reach from connector to end cap"):
        fit_backbone(grey, seen)


def test_without_a_ruler_there_is_no_scale(seen_camera):
    image = frame(seen_camera, 40.0)
    seen = AngleMeter(CALIBRATIONS.camera).measure(image).sighting
    with pytest.raises(VisionError, match="needs the ruler"):
        fit_backbone(image, seen)
