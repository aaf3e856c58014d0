"""Errors of the bending angle over the image stress set.

Run `python -m tests.bench stress`; it takes about seven minutes.
"""

from __future__ import annotations

import cv2

from tests.vision.stress import WRONG_DEG, Score, halton, nominal, score

PICTURES, MORE = 300, 700
OTHER_SEED = 11
NOMINAL_SHARE = 5
"""One nominal picture for so many of the stress set."""
HEADINGS = ("pictures", "bias", "RMS", "99 %", "largest", "rejected", "wrong", "covered")


def main() -> None:
    """Print the error table, and why pictures were rejected."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        print(f"{'errors in deg':<14}" + "".join(f"{name:>10}" for name in HEADINGS))
        show("nominal", score(nominal(PICTURES // NOMINAL_SHARE)))
        stressed = score(halton(PICTURES))
        show("stress set", stressed)
        show("second", score(halton(MORE, OTHER_SEED)))
    finally:
        cv2.setNumThreads(threads)
    print(f"wrong: accepted, and more than {WRONG_DEG:g} deg off")
    print("second: another sample of the stress set, on which END_WIDTHS was chosen")
    print("covered: share of errors within the stated expanded uncertainty (k = 2)")
    for reason, number in sorted(stressed.reasons.items(), key=lambda item: -item[1]):
        print(f"{number:>6}  {reason}")


def show(name: str, found: Score) -> None:
    """One row of the table."""
    print(f"{name:<14}" + "".join(f"{cell:>10}" for cell in found.row()), flush=True)


if __name__ == "__main__":
    main()
