"""How long an angle measurement takes on one core at 1280x720.

Targets: 60 frames a second for frames on their own, 100 for those of a film after the first.
Processor time, as others may use the machine.

Run `python -m tests.bench vision`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from itertools import cycle

import cv2
import numpy as np

from rig.vision.edges import long_edges
from rig.vision.measure import AngleMeter
from rig.vision.overlay import draw_overlay
from rig.vision.plane import PicturePlane, rectify
from rig.vision.ruler import find_ruler
from rig.vision.segment import find_blue_parts, pyramid
from rig.vision.track import AngleTracker
from tests.vision.synthetic import CAMERA, RULER, Scene, render

TARGET_HZ, FILM_TARGET_HZ = 60.0, 100.0
REPEATS = 60


def main() -> None:
    """Print frames a second, and where the time goes."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        for row in table():
            print("{:<40}{:>12}{:>12}{:>12}".format(*row))
    finally:
        cv2.setNumThreads(threads)


def table() -> list[tuple[str, str, str, str]]:
    """Work, median and best time in milliseconds, and frames a second at the median."""
    rows = [("vision at 1280x720, one core", "median ms", "best ms", "per second")]
    for angle in (0.0, 60.0, 120.0):
        image = render(Scene(angle=angle))
        for how, meter in (("lens, ruler", AngleMeter(CAMERA, RULER)), ("plain", AngleMeter())):
            result = meter.measure(image)
            assert result.accepted, result.reason
            name = f"angle at {angle:.0f} deg, {how}"
            rows.append(timed(name, partial(meter.measure, image)))
    levels = pyramid(image)
    parts = find_blue_parts(levels)
    plane = PicturePlane(CAMERA)
    marks = find_ruler(levels, RULER.marks)
    rows += [
        timed("  of it: halving the frame", lambda: pyramid(image)),
        timed("  of it: blue parts", lambda: find_blue_parts(levels)),
        timed(
            "  of it: edges of the connector", lambda: long_edges(image, parts[0], plane.undistort)
        ),
        timed("  of it: edges of the cap", lambda: long_edges(image, parts[1], plane.undistort)),
        timed("  of it: marks of the ruler", lambda: find_ruler(levels, RULER.marks)),
        timed("  of it: plane of the ruler", lambda: rectify(CAMERA, RULER, marks)),
        timed("overlay", lambda: draw_overlay(image, result)),
        ("target", "", "", f"{TARGET_HZ:.0f}"),
        timed("frame of a film, lens, ruler", film()),
        ("target", "", "", f"{FILM_TARGET_HZ:.0f}"),
    ]
    return rows


def film() -> Callable[[], object]:
    """What measures the next frame of a film that runs to and fro."""
    angles = 50.0 + 10.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False))
    images = [render(Scene(angle=angle, seed=seed)) for seed, angle in enumerate(angles.tolist())]
    tracker = AngleTracker(AngleMeter(CAMERA, RULER))
    frames = enumerate(cycle(images))

    def work() -> None:
        number, image = next(frames)
        found = tracker.measure(image, number / 60.0)
        assert found.measurement.accepted, found.measurement.reason

    return work


def timed(name: str, work: Callable[[], object]) -> tuple[str, str, str, str]:
    """Row of `name` with the median and best processor time of `work`."""
    work()
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        times.append((time.process_time() - start) * 1e3)
    median = float(np.median(times))
    return name, f"{median:.2f}", f"{min(times):.2f}", f"{1e3 / median:.0f}"


if __name__ == "__main__":
    main()
