"""One specimen in one test, nominal stress against stretch, and what is done before a fit.

Nothing is left out in silence: whatever drops points writes a note.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.fitting.errors import FittingError
from rig.mechanics.hyperelastic import Mode

Array = NDArray[np.float64]

FEWEST_POINTS = 8
"""Fewer do not show the shape of a curve."""
_OUTLYING = 6.0
"""Robust standard deviations from the neighbours; noise that is normal gets there once in 1e9."""
_VISIBLE = 0.01
"""Of the largest stress: what is less is no outlier."""
_NEIGHBOURS = 5
"""Points on either side that a point is held against."""
_SPIKE = 2
"""Points that a spike may be wide without being taken for the strength."""
_REWEIGHTED = 20
"""Rounds of reweighting; a spike's weight is gone after a few."""
_OUTLYING_SPECIMEN = 3.5
"""Modified z-score of a whole specimen (Iglewicz and Hoaglin, 1993)."""
_FEWEST_SPECIMENS = 4
"""Among three it cannot be told which one is odd."""


@dataclass(frozen=True)
class Specimen:
    """A homogeneous test to failure or less; arrays (n,), stretch ascending."""

    name: str
    mode: Mode
    stretch: Array
    """Length over length at rest, in the pulled direction."""
    stress: Array
    """Nominal: force per area at rest, in Pa."""
    source: str
    """File that it was read from."""
    material: str = ""
    """As the file calls it; empty where it does not."""
    notes: tuple[str, ...] = ()
    """What was noticed or left out on the way."""

    def __post_init__(self) -> None:
        if self.stretch.size < FEWEST_POINTS:
            raise FittingError(
                f"{self.name}: {self.stretch.size} points are too few for a curve; expected at "
                f"least {FEWEST_POINTS}. Widen the region, or record more densely."
            )

    @property
    def longest(self) -> float:
        """Largest stretch."""
        return float(self.stretch[-1])

    def _keeping(self, kept: NDArray[np.bool_], *notes: str) -> Specimen:
        return replace(
            self,
            stretch=self.stretch[kept],
            stress=self.stress[kept],
            notes=(*self.notes, *notes),
        )


def until_rupture(specimen: Specimen) -> Specimen:
    """Without what was recorded after the largest stress: there the specimen tears.

    The largest stress is looked for near the largest running median, which spikes do not move.
    """
    last = _strongest(specimen.stress)
    after = specimen.stretch.size - 1 - last
    if after == 0:
        return specimen
    kept = np.arange(specimen.stretch.size) <= last
    return specimen._keeping(
        kept,
        f"{specimen.name}: {after} points after the largest stress, at a strain of "
        f"{specimen.stretch[last] - 1:.4g}, were left out as rupture.",
    )


def _strongest(stress: Array) -> int:
    """Index of the largest stress that is no spike."""
    width = 2 * _SPIKE + 1
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(stress, _SPIKE, mode="edge"), width)
    middle = np.median(windows, axis=1)
    near = stress.size - 1 - int(np.argmax(middle[::-1]))
    first = max(near - _SPIKE, 0)
    return first + int(np.argmax(stress[first : near + _SPIKE + 1]))


def within(specimen: Specimen, low: float, high: float) -> Specimen:
    """The region of engineering strains from `low` to `high`; FittingError if little is left."""
    if not low < high:
        raise FittingError(
            f"a region of strains from {low:g} to {high:g} is empty; expected LOW below HIGH, "
            f"as 0:1 for 0 to 100 %."
        )
    strain = specimen.stretch - 1
    kept = (strain >= low - 1e-12) & (strain <= high + 1e-12)
    if int(kept.sum()) < FEWEST_POINTS:
        raise FittingError(
            f"{specimen.name}: {int(kept.sum())} points lie between strains of {low:g} and "
            f"{high:g}; expected at least {FEWEST_POINTS}. Its strains go from {strain[0]:.4g} to "
            f"{strain[-1]:.4g}: choose another region."
        )
    return specimen._keeping(kept)


def thinned(specimen: Specimen, count: int) -> Specimen:
    """At most `count` of its own points, evenly spread over the stretches: none is made up."""
    if specimen.stretch.size <= count:
        return specimen
    wanted = np.linspace(specimen.stretch[0], specimen.stretch[-1], count)
    right = np.clip(np.searchsorted(specimen.stretch, wanted), 1, specimen.stretch.size - 1)
    nearer_left = wanted - specimen.stretch[right - 1] < specimen.stretch[right] - wanted
    kept = np.zeros(specimen.stretch.size, dtype=bool)
    kept[np.where(nearer_left, right - 1, right)] = True
    return specimen._keeping(kept)


def without_outlying_points(specimen: Specimen) -> Specimen:
    """Without points far from the parabola through their neighbours, each told of in a note.

    Far is six robust standard deviations (1.4826 MAD of all such distances), and at least 1 % of
    the largest stress: smooth curves bend by more than their noise. The first and the last five
    points have neighbours on one side only, which say too little of a curve, and are kept.
    """
    distance = _distance_from_neighbours(specimen.stretch, specimen.stress)
    spread = 1.4826 * float(np.median(np.abs(distance)))
    odd = np.abs(distance) > max(
        _OUTLYING * spread, _VISIBLE * float(np.max(np.abs(specimen.stress)))
    )
    odd[:_NEIGHBOURS] = odd[-_NEIGHBOURS:] = False
    if not odd.any():
        return specimen
    places = ", ".join(f"{s - 1:.4g}" for s in specimen.stretch[odd][:5])
    more = " and others" if int(odd.sum()) > 5 else ""
    return specimen._keeping(
        ~odd,
        f"{specimen.name}: {int(odd.sum())} of {odd.size} points were left out as outliers, at "
        f"strains of {places}{more}.",
    )


def _distance_from_neighbours(x: Array, y: Array) -> Array:
    """Of each point from the parabola of least absolute deviations through those around it, (n,).

    By iteratively reweighted least squares, for all points at once.
    """
    count = min(2 * _NEIGHBOURS + 1, x.size)
    first = np.clip(np.arange(x.size) - _NEIGHBOURS, 0, x.size - count)
    around = first[:, None] + np.arange(count)
    own = around == np.arange(x.size)[:, None]
    others = around[~own].reshape(x.size, count - 1)
    apart = x[others] - x[:, None]
    reach = np.max(np.abs(apart), axis=1, keepdims=True)
    powers = (apart / np.where(reach > 0, reach, 1.0))[..., None] ** np.arange(3)
    weight = np.ones_like(apart)
    least = max(1e-6 * float(np.max(np.abs(y))), np.finfo(float).tiny)
    for _ in range(_REWEIGHTED):
        root = np.sqrt(weight)[..., None]
        solved = np.linalg.pinv(root * powers) @ (root * y[others][..., None])
        weight = 1 / np.maximum(np.abs(y[others] - (powers @ solved)[..., 0]), least)
    return np.asarray(y - solved[:, 0, 0])


def without_outlying_specimens(
    specimens: Sequence[Specimen],
) -> tuple[tuple[Specimen, ...], tuple[str, ...]]:
    """Specimens of one mode whose curves belong together, and a note on each that does not.

    A specimen is judged by its mean stress over the stretches that all reach (modified z-score
    above 3.5); fewer than four are all kept.
    """
    if len(specimens) < _FEWEST_SPECIMENS:
        return tuple(specimens), ()
    grid = _common_stretches(specimens, 50)
    level = np.array([np.interp(grid, s.stretch, s.stress).mean() for s in specimens])
    centre = float(np.median(level))
    spread = float(np.median(np.abs(level - centre)))
    odd = 0.6745 * np.abs(level - centre) > _OUTLYING_SPECIMEN * max(spread, 1e-9 * abs(centre))
    notes = tuple(
        f"{s.name} was left out: its mean stress, {one / 1e3:.4g} kPa, is far from the median of "
        f"{len(specimens)} specimens, {centre / 1e3:.4g} kPa."
        for s, one, out in zip(specimens, level, odd, strict=True)
        if out
    )
    return tuple(s for s, out in zip(specimens, odd, strict=True) if not out), notes


def averaged(specimens: Sequence[Specimen], count: int) -> Specimen:
    """Mean curve of specimens of one mode at `count` stretches that all of them reach.

    Raises FittingError where they share no stretches.
    """
    first = specimens[0]
    grid = _common_stretches(specimens, count)
    stress = np.mean([np.interp(grid, s.stretch, s.stress) for s in specimens], axis=0)
    return Specimen(
        name=f"mean of {len(specimens)} specimens",
        mode=first.mode,
        stretch=grid,
        stress=stress,
        source=", ".join(dict.fromkeys(s.source for s in specimens)),
        material=first.material,
        notes=(
            *(note for s in specimens for note in s.notes),
            f"{len(specimens)} specimens ({first.mode}) were averaged up to a strain of "
            f"{grid[-1] - 1:.4g}, which all of them reach.",
        ),
    )


def _common_stretches(specimens: Sequence[Specimen], count: int) -> Array:
    low = max(float(s.stretch[0]) for s in specimens)
    high = min(s.longest for s in specimens)
    if not low < high:
        raise FittingError(
            "the specimens share no stretches, so they cannot be held against each other: "
            + "; ".join(f"{s.name} from {s.stretch[0]:.4g} to {s.longest:.4g}" for s in specimens)
        )
    return np.asarray(np.linspace(low, high, count), dtype=np.float64)


def secant_modulus(specimen: Specimen, strain: float) -> float:
    """Equivalent modulus in Pa: nominal stress over engineering strain, at `strain`.

    The stress is that of a straight line through the data within a tenth of the strain (at least
    through the two points around it). Raises FittingError outside the data and at zero strain.
    """
    x = specimen.stretch - 1
    if strain == 0 or not x[0] <= strain <= x[-1]:
        raise FittingError(
            f"{specimen.name}: no equivalent modulus at a strain of {strain:g}; expected one "
            f"within its data, {x[0]:.4g} to {x[-1]:.4g}, other than 0."
        )
    near = np.abs(x - strain) <= abs(strain) / 10
    if int(near.sum()) < 3:
        return float(np.interp(strain, x, specimen.stress)) / strain
    slope, intercept = np.polyfit(x[near], specimen.stress[near], 1)
    return float(slope * strain + intercept) / strain
