"""The bench's camera as its tests set it up."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig.plant.camera import VirtualCamera
from rig.spec.workspace import Workspace

LIBRARY = Workspace(Path(__file__).parents[2])
BENCH = LIBRARY.bench("virtual")
CALIBRATIONS = LIBRARY.resolve_bench(BENCH)
CAMERA, RULER = CALIBRATIONS.camera, CALIBRATIONS.ruler
OPTICS = BENCH.virtual.optics
GEOMETRY = LIBRARY.actuator("bellow-bending").geometry


def camera(seed=1, geometry=GEOMETRY, ruler=RULER, **optics):
    """A virtual camera; keywords replace entries of the bench's optics."""
    return VirtualCamera(
        OPTICS.model_copy(update=optics),
        ruler,
        geometry,
        BENCH.camera.jpeg_quality,
        np.random.default_rng(seed),
    )
