from __future__ import annotations

from pathlib import Path

import cv2
import pytest

from rig.vision.measure import AngleMeter
from tests.vision.synthetic import CAMERA, RULER

FOOTAGE = Path(__file__).resolve().parents[3] / "shared" / "data" / "footage"


@pytest.fixture(autouse=True, scope="package")
def one_thread():
    """Tests run side by side: OpenCV's own threads would only fight for the cores."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(threads)


@pytest.fixture
def meter() -> AngleMeter:
    return AngleMeter(CAMERA, RULER)


@pytest.fixture
def footage() -> Path:
    if not FOOTAGE.is_dir():
        pytest.skip("the real footage is not beside this checkout (../shared/data/footage)")
    return FOOTAGE
