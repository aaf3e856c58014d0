"""What is done with specimens before a fit: rupture, outliers, averaging, region, thinning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rig.fitting.errors import FittingError
from rig.fitting.specimen import (
    Specimen,
    averaged,
    thinned,
    until_rupture,
    within,
    without_outlying_points,
    without_outlying_specimens,
)
from rig.mechanics.hyperelastic import Mode

POINTS = 120
"""Points a curve that are fitted: more cost time and tell a smooth model nothing new."""


@dataclass(frozen=True)
class Preparation:
    """What is done with specimens before a fit."""

    region: tuple[float, float] | None = None
    """Engineering strains from and to; None: all."""
    keep_outliers: bool = False
    average: bool = False
    """Fit the mean curve of each mode's specimens instead of all of them."""
    points: int = POINTS


@dataclass(frozen=True)
class Prepared:
    """Specimens as tested and as fitted, and all that was noticed on the way."""

    tested: tuple[Specimen, ...]
    """To their rupture, without outliers."""
    fitted: tuple[Specimen, ...]
    notes: tuple[str, ...]


def prepare(specimens: Sequence[Specimen], how: Preparation) -> Prepared:
    """Rupture, outliers, averaging, region and thinning, in this order; raises FittingError."""
    tested: list[Specimen] = []
    fitted: list[Specimen] = []
    notes: list[str] = []
    for mode in Mode:
        own = [until_rupture(s) for s in specimens if s.mode is mode]
        if not own:
            continue
        if not how.keep_outliers:
            own = [without_outlying_points(s) for s in own]
            kept, told = without_outlying_specimens(own)
            own, notes = list(kept), notes + list(told)
        notes += [note for s in own for note in s.notes]
        tested += own
        if how.average and len(own) > 1:
            own = [averaged(own, how.points)]
            notes.append(own[0].notes[-1])
        if how.region is not None:
            own = [within(s, *how.region) for s in own]
        fitted += [thinned(s, how.points) for s in own]
    if not fitted:
        raise FittingError("there are no specimens to fit to.")
    return Prepared(tuple(tested), tuple(fitted), tuple(dict.fromkeys(notes)))
