"""The real footage of a default bellow actuator: no ruler, perspective, video quality."""

from __future__ import annotations

import csv

import cv2
import numpy as np
import pytest

from rig.vision.measure import AngleMeter

LABEL_TOLERANCE_DEG = 4.0


@pytest.fixture
def measured(footage):
    with (footage / "labels.csv").open(newline="") as file:
        labels = list(csv.DictReader(file))
    meter = AngleMeter()
    return [(label, meter.measure(cv2.imread(str(footage / label["file"])))) for label in labels]


def test_no_frame_of_the_real_actuator_is_rejected(measured):
    assert [(label["file"], r.reason) for label, r in measured if not r.accepted] == []


def test_the_angle_never_falls_as_the_pressure_rises(measured):
    angles = [r.angle_deg for _, r in measured]
    assert len(angles) == 10
    assert angles == sorted(angles)


def test_the_labelled_frames_agree_with_the_eye(measured):
    labelled = [
        (float(label["cap_angle_deg"]), r) for label, r in measured if label["cap_angle_deg"]
    ]
    assert len(labelled) == 3
    for by_hand, result in labelled:
        assert abs(result.angle_deg - by_hand) < LABEL_TOLERANCE_DEG


def test_the_uncertainty_admits_that_there_is_no_ruler(measured):
    assert all(1.0 <= r.u_deg < 3.0 for _, r in measured)


@pytest.mark.parametrize("share", [0.85, 1.2])
def test_a_little_more_or_less_light_keeps_the_labels(footage, share):
    meter = AngleMeter()
    for name, by_hand in (("motion_3938", 47.0), ("motion_3998", 95.0), ("motion_4018", 108.0)):
        image = cv2.imread(str(footage / f"{name}.png"))
        dimmed = np.clip(image.astype(float) * share, 0, 255).astype(np.uint8)
        assert abs(meter.measure(dimmed).angle_deg - by_hand) < LABEL_TOLERANCE_DEG


@pytest.mark.parametrize("turn", [-4.0, 4.0])
def test_turning_the_real_picture_leaves_the_angle(footage, turn):
    meter = AngleMeter()
    for path in sorted(footage.glob("*.png"))[1:-1]:
        image = cv2.imread(str(path))
        matrix = cv2.getRotationMatrix2D((195.0, 60.0), turn, 1.0)
        turned = cv2.warpAffine(image, matrix, (391, 391), borderValue=(30, 32, 36))
        straight, tilted = meter.measure(image), meter.measure(turned)
        assert tilted.accepted, (path.name, tilted.reason)
        assert tilted.angle_deg == pytest.approx(straight.angle_deg, abs=4.0), path.name


@pytest.mark.parametrize("factor", [2, 3])
def test_an_enlarged_picture_is_measured_at_the_size_at_which_it_is_sharp(footage, factor):
    meter = AngleMeter()
    for name, by_hand in (("motion_3938", 47.0), ("motion_3998", 95.0), ("motion_4018", 108.0)):
        image = cv2.imread(str(footage / f"{name}.png"))
        large = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
        assert abs(meter.measure(large).angle_deg - by_hand) < LABEL_TOLERANCE_DEG
