"""Conversions among the elastic constants of small strain."""

from __future__ import annotations

import numpy as np

from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic.protocol import Energy


def shear_modulus_from(young_modulus: float, poisson_ratio: float) -> float:
    """E / (2 (1 + nu)) in Pa; raises MechanicsError unless E > 0 and -1 < nu < 0.5."""
    _check_elastic(young_modulus, poisson_ratio)
    return young_modulus / (2 * (1 + poisson_ratio))


def bulk_modulus_from(young_modulus: float, poisson_ratio: float) -> float:
    """E / (3 (1 - 2 nu)) in Pa; raises MechanicsError unless E > 0 and -1 < nu < 0.5."""
    _check_elastic(young_modulus, poisson_ratio)
    return young_modulus / (3 * (1 - 2 * poisson_ratio))


def bulk_modulus_beside(shear_modulus: float, poisson_ratio: float) -> float:
    """2 mu (1 + nu) / (3 (1 - 2 nu)) in Pa; raises MechanicsError as `bulk_modulus_from` does."""
    return bulk_modulus_from(2 * shear_modulus * (1 + poisson_ratio), poisson_ratio)


def shear_modulus_at_rest(energy: Energy) -> float:
    """The shear modulus in Pa that any energy has at small strain, from its tangent at F = 1."""
    tangent = energy.tangent(np.eye(3)[..., None])
    return float(tangent[0, 1, 0, 1, 0] + tangent[0, 1, 1, 0, 0]) / 2


def _check_elastic(young_modulus: float, poisson_ratio: float) -> None:
    if not (young_modulus > 0 and -1 < poisson_ratio < 0.5):
        raise MechanicsError(
            f"no elastic solid has a Young's modulus of {young_modulus:g} Pa with a Poisson's "
            f"ratio of {poisson_ratio:g}: expected a modulus above 0 and a ratio above -1 and "
            "below 0.5; rubber is near 0.49, and 0.5 itself has no finite bulk modulus"
        )
