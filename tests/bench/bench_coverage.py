"""How often the 95 % interval of an angle holds the truth, over a thousand rendered benches.

Run `python -m tests.bench coverage`: about eight minutes of processor time. Each bench has a lens,
a ruler, a viewpoint and a noise of its own, and three frames are taken of it.
"""

from __future__ import annotations

import cv2

from tests.experiment.coverage import angle_coverage

BENCHES, AT_ONCE = 1000, 100


def main() -> None:
    """Print the share after every hundred benches, and of all at the end."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    held = measured = 0
    try:
        for first in range(0, BENCHES, AT_ONCE):
            found = angle_coverage(range(first, first + AT_ONCE))
            held, measured = held + found.held, measured + len(found.errors)
            print(f"benches {first} to {first + AT_ONCE - 1}: {found}", flush=True)
    finally:
        cv2.setNumThreads(threads)
    print(f"{held} of {measured} angles = {held / measured:.1%}; {BENCHES - measured} not measured")


if __name__ == "__main__":
    main()
