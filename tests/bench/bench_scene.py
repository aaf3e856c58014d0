"""How long the virtual camera takes per frame on one core; target: 15 ms with JPEG.

Run `python -m tests.bench.bench_scene`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from rig.mechanics.profile import side_profile
from rig.plant.camera import VirtualCamera
from rig.spec.workspace import Workspace

ANGLES_DEG = (-10.0, 0.0, 30.0, 60.0, 90.0, 120.0, 150.0)
TARGET_MS = 15.0
REPEATS = 40


def main() -> None:
    """Print the median and the best time of every stage."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        for row in table():
            print("{:<34}{:>12}{:>12}".format(*row))
    finally:
        cv2.setNumThreads(threads)


def table() -> list[tuple[str, str, str]]:
    """Stage, median and best time in milliseconds."""
    library = Workspace(Path(__file__).parents[2])
    bench = library.bench("virtual")
    calibrations = library.resolve_bench(bench)
    geometry = library.actuator("bellow-bending").geometry

    def set_up() -> VirtualCamera:
        return VirtualCamera(
            bench.virtual.optics,
            calibrations.ruler,
            geometry,
            bench.camera.jpeg_quality,
            np.random.default_rng(1),
        )

    camera = set_up()
    rows = [("virtual camera, one core", "median ms", "best ms"), ("set up", *timed(set_up, 3))]
    for angle_deg in ANGLES_DEG:
        angle = float(np.deg2rad(angle_deg))
        rows.append(
            (f"frame with JPEG at {angle_deg:.0f} deg", *timed(lambda a=angle: camera.grab(a, 1.0)))
        )
    picture = camera.render(1.0, 1.0)
    encoding = [cv2.IMWRITE_JPEG_QUALITY, bench.camera.jpeg_quality]
    rows += [
        ("  of it: side profile at 57 deg", *timed(lambda: side_profile(geometry, 1.0))),
        ("  of it: picture with noise", *timed(lambda: camera.render(1.0, 1.0))),
        ("  of it: JPEG, 4:2:0", *timed(lambda: cv2.imencode(".jpg", picture, encoding))),
        ("target for a frame", f"{TARGET_MS:.1f}", ""),
    ]
    return rows


def timed(work: Callable[[], object], repeats: int = REPEATS) -> tuple[str, str]:
    """Median and best wall time of `work` in milliseconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append((time.perf_counter() - start) * 1e3)
    return f"{np.median(times):.2f}", f"{min(times):.2f}"


if __name__ == "__main__":
    main()
