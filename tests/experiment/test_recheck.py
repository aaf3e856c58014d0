"""The camera's calibration is looked at before a run relies on it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.experiment.errors import ExperimentError
from rig.experiment.recheck import MAX_RESIDUAL_PX, recheck_camera
from rig.plant.camera import CameraFault, VirtualCamera
from rig.spec.workspace import Workspace
from rig.vision.measure import AngleMeter

LIBRARY = Workspace(Path(__file__).parents[2])
BENCH = LIBRARY.bench("virtual")
CALIBRATIONS = LIBRARY.resolve_bench(BENCH)


class Looking:
    """A camera at the resting actuator."""

    def __init__(self) -> None:
        self.seen = VirtualCamera(
            BENCH.virtual.optics,
            CALIBRATIONS.ruler,
            LIBRARY.actuator("bellow-bending").geometry,
            BENCH.camera.jpeg_quality,
            np.random.default_rng(2),
        )

    def grab(self) -> tuple[float, bytes]:
        return 0.0, self.seen.grab(0.0, 0.0)


@pytest.fixture(scope="module")
def camera() -> Looking:
    return Looking()


def test_a_lens_within_its_calibrations_uncertainty_passes(camera):
    residual = recheck_camera(camera, AngleMeter(CALIBRATIONS.camera, CALIBRATIONS.ruler))
    assert 0.0 < residual < 0.5 * MAX_RESIDUAL_PX


def test_the_calibration_of_another_lens_is_refused(camera):
    other = CALIBRATIONS.camera.model_copy(update={"distortion": (0.1, 0.0, 0.0, 0.0, 0.0)})
    with pytest.raises(ExperimentError, match=r"does not hold.*`rig calibrate camera`"):
        recheck_camera(camera, AngleMeter(other, CALIBRATIONS.ruler))


def test_a_camera_in_the_dark_is_refused_with_the_reason(camera, monkeypatch):
    monkeypatch.setattr(camera.seen, "fault", CameraFault.DARK)
    with pytest.raises(
        ExperimentError, match=r"cannot be checked before the run \(ruler not found"
    ):
        recheck_camera(camera, AngleMeter(CALIBRATIONS.camera, CALIBRATIONS.ruler))
    camera.seen.fault = CameraFault.NONE
