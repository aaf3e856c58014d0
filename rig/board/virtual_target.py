"""Calibration targets held before the camera of a simulated bench: the lens that its runs have."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rig.board.virtual import Seeds, virtual_part
from rig.plant.camera import CameraStreams
from rig.plant.scene import Image
from rig.plant.target import board_surfaces, ruler_surfaces, views
from rig.spec.bench import BenchSpec
from rig.spec.calibration import RulerCalibration
from rig.spec.target import CharucoTarget


def board_views(bench: BenchSpec, target: CharucoTarget, seed: int, count: int) -> Iterator[Image]:
    """Pictures of a board; raises BoardError for a bench that is not simulated."""
    optics = virtual_part(bench).optics
    return views(*board_surfaces(target), optics, _camera(seed), count)


def ruler_views(
    bench: BenchSpec, ruler: RulerCalibration, seed: int, count: int
) -> Iterator[Image]:
    """Pictures of the ruler that the bench's runs have."""
    optics = virtual_part(bench).optics
    return views(*ruler_surfaces(ruler, hidden_lean(bench, seed)), optics, _camera(seed), count)


def hidden_lean(bench: BenchSpec, seed: int) -> float:
    """By how many rad the legs of the bench's ruler are closer than a right angle."""
    return CameraStreams.of(_camera(seed)).lean(virtual_part(bench).optics)


def _camera(seed: int) -> np.random.Generator:
    return np.random.default_rng(Seeds.of(seed, 0).camera)
