"""Whether the camera's calibration still holds, looked at before the first picture of a run counts.

Through the right lens the marks of the ruler lie on a flat grid. A lens whose focus or zoom was
touched, or a calibration of another one, leaves them off it by more than they can be printed off.
"""

from __future__ import annotations

import numpy as np

from rig.experiment.bench import Camera
from rig.experiment.errors import ExperimentError
from rig.vision.measure import AngleMeter
from rig.vision.segment import UNREADABLE, decoded

LOOKS = 3
MAX_RESIDUAL_PX = 0.15
"""RMS; marks printed within 0.01 mm are off by 0.1 px at 0.1 mm a pixel. On the virtual bench a
distortion that leaves 0.05 px turns angles by 0.4 deg."""


def recheck_camera(camera: Camera, meter: AngleMeter) -> float:
    """RMS distance in pixels of the ruler's marks from a flat grid, the median of some frames.

    Raises ExperimentError if no frame can be trusted, and if the calibration does not hold.
    """
    residuals: list[float] = []
    reason = ""
    for _ in range(LOOKS):
        image = decoded(camera.grab()[1])
        if image is None:
            reason = UNREADABLE
            continue
        seen = meter.check_ruler(image)
        if seen.residual_px is None:
            reason = seen.reason
        else:
            residuals.append(seen.residual_px)
    if not residuals:
        raise ExperimentError(
            f"the camera's calibration cannot be checked before the run ({reason}). Check light, "
            "focus and view; `rig measure` on a frame tells more. Nothing was pressurised."
        )
    residual = float(np.median(residuals))
    if residual > MAX_RESIDUAL_PX:
        raise ExperimentError(
            f"the camera's calibration does not hold: the ruler's marks are {residual:.2f} px off "
            f"a flat grid, expected at most {MAX_RESIDUAL_PX:g}. Were focus, zoom or ruler "
            "touched? `rig calibrate camera`, then run again. Nothing was pressurised."
        )
    return residual
