"""Calibrations from pictures: where the pictures come from, and the dated file they end in."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date, timedelta
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console

from rig.board.camera import open_camera
from rig.spec.bench import BenchSpec
from rig.spec.calibration import CameraCalibration, Environment, Provenance
from rig.spec.calibration_file import free_path, write_calibration
from rig.spec.loading import AnyCalibration
from rig.spec.workspace import Workspace
from rig.vision.footage import expand, read_frames
from rig.vision.segment import Image, as_image


def frames_of_files(named: list[str]) -> Iterator[Image]:
    """All frames of images, videos, folders and globs; raises VisionError."""
    for file in expand(named):
        for frame in read_frames(file):
            yield frame.image


def frames_of_camera(bench: BenchSpec, mode: CameraCalibration) -> Iterator[Image]:
    """What a real bench's camera sees, in the mode of its present calibration.

    Ends with Ctrl-C, or when nobody asks any more. Raises BoardError.
    """
    camera = open_camera(bench.camera, mode, lambda: 0.0)
    try:
        while True:
            jpeg = camera.grab()[1]
            yield as_image(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR))
    finally:
        camera.close()


def provenance(
    bench: BenchSpec,
    *,
    method: str,
    instrument: str,
    serial_number: str,
    operator: str,
    valid_days: int,
    simulated: bool,
    reference: str = "",
) -> Provenance:
    """Who calibrated what and when; counts from today."""
    today = date.today()
    return Provenance(
        date=today,
        valid_until=today + timedelta(days=valid_days),
        method=method,
        instrument=instrument,
        serial_number=serial_number,
        operator=operator,
        reference=reference,
        environment=Environment(
            temperature=bench.ambient.temperature - 273.15 if simulated else None
        ),
        simulated=simulated,
    )


def finish(
    console: Console,
    workspace: Workspace,
    calibration: AnyCalibration,
    out: Path | None,
    field: str,
) -> None:
    """Write the calibration and say how runs come to use it; `field` of the bench names it."""
    root = Path.cwd() if workspace.is_library else workspace.root
    path = out or free_path(root / "calibration", calibration, calibration.instrument)
    write_calibration(calibration, path)
    console.print(
        f"Written: {path}, valid until {calibration.provenance.valid_until}. Runs use it once the "
        f"bench names it: {field}: {path.stem}",
        soft_wrap=True,
        highlight=False,
        markup=False,
    )
