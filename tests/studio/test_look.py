"""What is made of a picture and of a count, and that nobody waits for it."""

from __future__ import annotations

import threading

import cv2
import numpy as np
import pytest

from rig.experiment.deformation import BendingMeter
from rig.spec.calibration import LoadCellCalibration
from rig.studio.look import Look, Lookout, looked_at
from rig.vision.measure import AngleMeter


def jpeg(grey: int) -> bytes:
    return cv2.imencode(".jpg", np.full((240, 320, 3), grey, np.uint8))[1].tobytes()


def test_a_picture_that_cannot_be_read_or_trusted_gives_a_reason() -> None:
    broken = looked_at(b"no picture", BendingMeter(AngleMeter()))
    assert (broken.jpeg, broken.value) == (b"no picture", None)
    assert "no readable picture" in broken.reason
    dark = looked_at(jpeg(0), BendingMeter(AngleMeter()))
    assert dark.value is dark.u95 is None
    assert "too dark" in dark.reason
    assert dark.jpeg.startswith(b"\xff\xd8")


def test_counts_become_grams_with_the_bow_of_the_cell() -> None:
    cell = LoadCellCalibration.model_construct(counts_per_gram=400.0, span=0.1, bow=2e-3)
    assert cell.grams(0.0) == 0.0
    assert cell.grams(400.0 * 50.0) == pytest.approx(52.0)


def test_pictures_that_come_too_fast_replace_each_other() -> None:
    looks: list[Look] = []
    looking, go_on = threading.Event(), threading.Event()

    def tell(look: Look) -> None:
        looks.append(look)
        looking.set()
        assert go_on.wait(30)

    lookout = Lookout(BendingMeter(AngleMeter()), tell)
    lookout.show(1.0, jpeg(0))
    assert looking.wait(30)
    for time_s in (2.0, 3.0, 4.0):
        lookout.show(time_s, jpeg(0))
    looking.clear()
    go_on.set()
    assert looking.wait(30)
    lookout.close()
    assert [look.time_s for look in looks] == [1.0, 4.0]
