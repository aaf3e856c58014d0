"""The stated uncertainty of the lens against the lenses that benches hide, by geometry alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.board.virtual import Seeds, virtual_part
from rig.mechanics.profile import side_profile
from rig.plant.camera import CameraStreams
from rig.plant.layout import lay_out, mark_centres
from rig.plant.optics import draw_projection
from rig.spec.actuator import BellowBendingGeometry
from rig.vision.plane import rectify
from rig.vision.ruler import RulerMarks

from .conftest import make_request

ANGLES_DEG = (0, 20, 40, 60, 80, 100, 110)
LENSES = 100


def long_axis(points: NDArray[np.float64], ends: int = 21) -> NDArray[np.float64]:
    """Points (ends, 2) along the long axis of others (n, 2), as far as they reach."""
    centre = points.mean(axis=0)
    axis = np.linalg.svd(points - centre)[2][0]
    half = np.abs((points - centre) @ axis).max()
    return centre + np.linspace(-half, half, ends)[:, None] * axis


def test_the_lens_is_as_uncertain_as_the_benches_lenses_scatter() -> None:
    setup = make_request().setup
    optics, known, ruler = (
        virtual_part(setup.bench).optics,
        setup.calibrations.camera,
        setup.calibrations.ruler,
    )
    geometry = setup.actuator.geometry
    assert isinstance(geometry, BellowBendingGeometry)
    steps = np.arange(1, ruler.marks + 1)
    grid = np.zeros((2 * ruler.marks + 1, 2))
    grid[1 : ruler.marks + 1, 1], grid[ruler.marks + 1 :, 0] = -steps, steps
    layout, errors = None, []
    for seed in range(LENSES):
        streams = CameraStreams.of(np.random.default_rng(Seeds.of(seed, 0).camera))
        projection = draw_projection(streams.lens(optics), optics, streams.pose)
        layout = layout or lay_out(geometry, ruler, projection, side_profile)
        marks = projection.project(mark_centres(layout.ruler_corner, ruler))
        plane = rectify(known, ruler, RulerMarks(marks, grid))
        for angle_deg in ANGLES_DEG:
            shape = side_profile(geometry, float(np.radians(angle_deg)))
            parts = (layout.place(long_axis(part)) for part in (shape.connector, shape.end_cap))
            seen = [long_axis(plane.undistort(projection.project(p)), 2) for p in parts]
            turn = np.degrees(plane.turn(seen[0], seen[1]))
            errors.append((turn - angle_deg + 90) % 180 - 90)
    rms = float(np.sqrt(np.mean(np.square(errors))))
    assert known.angle_u_deg == pytest.approx(rms, rel=0.12)
