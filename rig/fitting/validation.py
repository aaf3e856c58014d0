"""How well an energy foretells data that it was not fitted to, and how specimens scatter.

With several specimens each is left out in turn. A single one is left out in blocks of its
stretches: the first and the last show how the energy extrapolates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from rig.fitting.errors import FittingError
from rig.fitting.fit import EnergyFit, Settings, fit
from rig.fitting.specimen import Array, Specimen
from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic import Mode

_BLOCKS = 5


class LeftOut(StrEnum):
    """What a fold leaves out."""

    SPECIMEN = "specimen"
    BLOCK = "block of stretches"


@dataclass(frozen=True)
class CrossValidation:
    """Errors of predictions of what was left out."""

    left_out: LeftOut
    rmse: float
    """Root mean square over all that was left out, in Pa."""
    folds: tuple[tuple[str, float], ...]
    """What was left out, and the root mean square of its prediction's errors in Pa."""
    jackknife: tuple[float | None, ...]
    """Standard error of each coefficient from leaving out specimens; None for blocks."""


def cross_validate(
    found: EnergyFit, specimens: Sequence[Specimen], settings: Settings
) -> CrossValidation:
    """Leave-one-out over specimens, or over blocks of the only one, begun from the full fit.

    Raises FittingError and MechanicsError where a fold cannot be fitted.
    """
    settings = replace(settings, stable_to=found.stable_to)
    kind = LeftOut.SPECIMEN if len(specimens) > 1 else LeftOut.BLOCK
    folds = _by_specimen(specimens) if kind is LeftOut.SPECIMEN else _by_block(specimens[0])
    errors, scores, refits = [], [], []
    for fold in folds:
        refit = fit(found.family, fold.kept, settings, start=found.values)
        refits.append([refit.values[c.name] for c in found.coefficients])
        error = found.family.stress(refit.values, fold.mode, fold.stretch) - fold.stress
        errors.append(error)
        scores.append((fold.name, float(np.sqrt(np.mean(error**2)))))
    jackknife: tuple[float | None, ...] = (None,) * len(found.coefficients)
    if kind is LeftOut.SPECIMEN:
        values = np.array(refits)
        n = len(values)
        spread = np.sqrt((n - 1) / n * np.sum((values - values.mean(axis=0)) ** 2, axis=0))
        jackknife = tuple(spread.tolist())
    return CrossValidation(
        left_out=kind,
        rmse=float(np.sqrt(np.mean(np.concatenate(errors) ** 2))),
        folds=tuple(scores),
        jackknife=jackknife,
    )


def try_cross_validation(
    found: EnergyFit, specimens: Sequence[Specimen], settings: Settings
) -> CrossValidation | str:
    """`cross_validate`, or why it cannot be done."""
    try:
        return cross_validate(found, specimens, settings)
    except (FittingError, MechanicsError) as error:
        return str(error)


@dataclass(frozen=True)
class _Fold:
    kept: tuple[Specimen, ...]
    name: str
    mode: Mode
    stretch: Array
    stress: Array


def _by_specimen(specimens: Sequence[Specimen]) -> list[_Fold]:
    return [
        _Fold(
            tuple(s for s in specimens if s is not one), one.name, one.mode, one.stretch, one.stress
        )
        for one in specimens
    ]


def _by_block(specimen: Specimen) -> list[_Fold]:
    folds = []
    everything = np.arange(specimen.stretch.size)
    for rows in np.array_split(everything, _BLOCKS):
        kept = np.setdiff1d(everything, rows)
        rest = replace(specimen, stretch=specimen.stretch[kept], stress=specimen.stress[kept])
        x = specimen.stretch[rows]
        name = f"strains {x[0] - 1:.3g} to {x[-1] - 1:.3g}"
        folds.append(_Fold((rest,), name, specimen.mode, x, specimen.stress[rows]))
    return folds
