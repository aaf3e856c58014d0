"""Every energy fitted to one material, validated and ranked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rig.fitting.errors import FittingError
from rig.fitting.families import Family
from rig.fitting.fit import EnergyFit, Settings, fit
from rig.fitting.specimen import Specimen
from rig.fitting.validation import CrossValidation, try_cross_validation
from rig.mechanics.errors import MechanicsError

_NEARLY = 1.1
"""Times the least error on what was left out."""


@dataclass(frozen=True)
class Candidate:
    """An energy that was fitted, and how it predicts what it has not seen."""

    fit: EnergyFit
    validation: CrossValidation | str
    """The result, or why there is none."""


@dataclass(frozen=True)
class Ranking:
    """All energies on one material."""

    candidates: tuple[Candidate, ...]
    """Best first, see `rank`."""
    failures: dict[str, str] = field(default_factory=dict)
    """Energies without a fit, and why."""

    @property
    def best(self) -> Candidate:
        """The one of fewest coefficients among those that predict nearly as well as the first."""
        first = self.candidates[0]
        if isinstance(first.validation, str):
            return first
        enough = [
            one
            for one in self.candidates
            if one.fit.stable == first.fit.stable
            and not isinstance(one.validation, str)
            and one.validation.rmse <= _NEARLY * first.validation.rmse
        ]
        return min(enough, key=lambda one: len(one.fit.coefficients))


def fit_all(
    families: Sequence[Family], specimens: Sequence[Specimen], settings: Settings
) -> Ranking:
    """Fit, validate and rank; an energy that cannot be fitted is told of, not left out."""
    candidates, failures = [], {}
    for family in families:
        try:
            found = fit(family, specimens, settings)
        except (FittingError, MechanicsError) as error:
            failures[family.name] = str(error)
            continue
        candidates.append(Candidate(found, try_cross_validation(found, specimens, settings)))
    return Ranking(tuple(sorted(candidates, key=rank)), failures)


def rank(candidate: Candidate) -> tuple[bool, float]:
    """Sorting key: stable energies first, then by the error on what was left out.

    Information criteria take residuals for independent, which those of smooth curves are not, and
    so favour many coefficients; what was left out does not.
    """
    validation = candidate.validation
    error = validation.rmse if isinstance(validation, CrossValidation) else float("inf")
    return (not candidate.fit.stable, error)
