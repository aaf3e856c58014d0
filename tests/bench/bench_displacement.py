"""A stroke of 25 mm in 0.4 s, followed at several frame rates: error and processor time.

Run `python -m tests.bench displacement`.
"""

from __future__ import annotations

import time

import cv2
import numpy as np

from rig.vision.displacement import DisplacementTracker
from tests.vision.test_displacement import (
    CAMERA,
    DURATION_S,
    RULER,
    film_of,
    still_outlines,
    stroke_mm,
)

RATES_HZ = (60, 120, 240)


def main() -> None:
    """Print the table."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    taken = film_of(still_outlines())
    try:
        print(
            f"{'frames/s':>9}{'frames':>8}{'rejected':>10}{'RMS mm':>9}{'largest mm':>12}{'ms':>7}"
        )
        for rate in RATES_HZ:
            print(row(rate, taken), flush=True)
    finally:
        cv2.setNumThreads(threads)


def row(rate_hz: int, taken) -> str:
    """One film, whole."""
    tracker = DisplacementTracker(CAMERA, RULER)
    errors, spent = [], []
    times = np.arange(0.0, DURATION_S, 1 / rate_hz)
    for moment in times:
        picture = taken(moment)
        start = time.process_time()
        found = tracker.measure(picture, float(moment))
        spent.append(time.process_time() - start)
        if found.displacement_mm is not None:
            errors.append(found.displacement_mm - stroke_mm(moment))
    rms, largest = np.sqrt(np.mean(np.square(errors))), np.abs(errors).max()
    rejected, ms = len(times) - len(errors), 1e3 * np.median(spent)
    return f"{rate_hz:>9}{len(times):>8}{rejected:>10}{rms:>9.4f}{largest:>12.4f}{ms:>7.1f}"


if __name__ == "__main__":
    main()
