"""The backbone of rendered actuators: the underside of the flat layer is an arc of known radius."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.bellow import BellowShape
from rig.vision.backbone import fit_backbone
from rig.vision.errors import UntrustedFrameError, VisionError
from rig.vision.measure import AngleMeter
from tests.vision.test_track import CALIBRATIONS, LIBRARY, camera, frame

LENGTH_MM = 1e3 * BellowShape.of(LIBRARY.actuator("bellow-bending").geometry).effective_length


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
    assert found.radius_mm == pytest.approx(LENGTH_MM / np.radians(angle_deg), rel=0.03)
    assert found.residual_mm < 0.2


def test_a_straight_actuator_has_no_curvature(seen_camera):
    found = backbone(seen_camera, 0.0)[2]
    assert found.curvature_per_mm * LENGTH_MM < np.radians(1.0)
    assert found.angle_deg < 1.5


def test_the_turn_of_the_circle_is_near_the_bending_angle(seen_camera):
    """Not the same: the rigid end walls are straight, but the circle goes on through them."""
    found = backbone(seen_camera, 60.0)[2]
    assert 60.0 < found.angle_deg < 60.0 * 1.2


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
