"""Drucker stability of an energy: does more strain always take more stress?

An incompressible material is stable where the Kirchhoff stresses and the logarithmic strains of
any small further deformation along the principal axes have a positive product, that is where W is
convex in the logarithmic strains (Abaqus Theory Guide, Section 4.6.1). Checked along the paths of
the three material tests, as Abaqus does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic.build import hyperelastic_from
from rig.mechanics.hyperelastic.protocol import Array, Energy
from rig.mechanics.hyperelastic.responses import (
    Mode,
    diagonal,
    incompressible_free_stretch,
    principal_stretches,
)
from rig.spec.material import MaterialSpec

LOWEST_STRETCH, HIGHEST_STRETCH = 0.1, 10.0
"""The range that Abaqus checks: nominal strains from -0.9 to 9."""

_POINTS = 400
_REFINEMENTS = 4
_ROUND_OFF = 1e-12
_ON_CONSTANT_VOLUME = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, -1.0]])
"""The third logarithmic strain is minus the sum of the others."""


@dataclass(frozen=True)
class StableRange:
    """Stretches `low` to `high` around 1 in which a mode is stable.

    None: nothing unstable up to the end of what was checked. Both are 1 for an energy that is
    unstable at rest.
    """

    mode: Mode
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Stability:
    """What `check_stability` found, over stretches from `lowest` to `highest`."""

    energy: Energy
    lowest: float
    highest: float
    ranges: tuple[StableRange, ...]

    @property
    def stable(self) -> bool:
        """Whether nothing unstable was found."""
        return all(found.low is None and found.high is None for found in self.ranges)

    @property
    def warning(self) -> str | None:
        """One paragraph for people, naming mode and stretch of every first instability."""
        if self.stable:
            return None
        places = []
        for found in self.ranges:
            if found.low == found.high == 1:
                places.append(f"{found.mode} loading already at rest")
                continue
            if found.low is not None:
                places.append(f"{found.mode} compression below a stretch of {found.low:.4g}")
            if found.high is not None:
                places.append(f"{found.mode} tension above a stretch of {found.high:.4g}")
        return (
            f"{self.energy!r} is unstable (Drucker) in {', '.join(places)}; checked were stretches "
            f"from {self.lowest:g} to {self.highest:g}. A computation that strains any point that "
            "far may stop or show a collapse that no specimen has; keep the pressure below it, or "
            "fit the coefficients again with data that reach these stretches"
        )


def material_stability(material: MaterialSpec) -> Stability:
    """`check_stability` of a material as far as it can be stretched without breaking.

    That is to 1 + its elongation at break, and to the inverse of it in compression; over Abaqus'
    range where no elongation is known.
    """
    energy = hyperelastic_from(material).distortion
    if material.elongation_at_break is None:
        return check_stability(energy)
    highest = 1 + material.elongation_at_break.high
    return check_stability(energy, 1 / highest, highest)


def check_stability(
    energy: Energy, lowest: float = LOWEST_STRETCH, highest: float = HIGHEST_STRETCH
) -> Stability:
    """First Drucker instability of `energy` in each mode, outwards from a stretch of 1.

    `energy` is taken at constant volume. Raises MechanicsError unless 0 < lowest < 1 < highest.
    """
    if not 0 < lowest < 1 < highest < np.inf:
        raise MechanicsError(
            f"stability cannot be checked from a stretch of {lowest:g} to {highest:g}: expected "
            "limits with 0 < lowest < 1 < highest, as compression and tension start at 1"
        )
    ranges = []
    for mode in Mode:
        if not _is_stable(energy, mode, np.ones(1))[0]:
            ranges.append(StableRange(mode, 1.0, 1.0))
            continue
        low = _first_unstable(energy, mode, lowest)
        ranges.append(StableRange(mode, low, _first_unstable(energy, mode, highest)))
    return Stability(energy, lowest, highest, tuple(ranges))


def _first_unstable(energy: Energy, mode: Mode, end: float) -> float | None:
    """The unstable stretch nearest to 1 on the way to `end`, by ever finer sampling."""
    inner, outer = 1.0, end
    for _ in range(_REFINEMENTS):
        stretches = np.geomspace(inner, outer, _POINTS)
        unstable = np.flatnonzero(~_is_stable(energy, mode, stretches))
        if not unstable.size:
            return None
        first = int(unstable[0])
        inner, outer = float(stretches[max(first - 1, 0)]), float(stretches[first])
    return outer


def logarithmic_stiffness(energy: Energy, mode: Mode, stretch: Array) -> Array:
    """Hessian of W in two independent logarithmic strains at constant volume, (2, 2, n), in Pa.

    `energy` is stable at a stretch where it is positive definite. It is
    lambda_a lambda_b A_aabb + d_ab lambda_a P_aa, seen along the two strains, and linear in the
    energy.
    """
    principal = principal_stretches(mode, stretch, incompressible_free_stretch(mode, stretch))
    f = diagonal(principal)
    stiffness = np.einsum("aabbn->abn", energy.tangent(f))
    hessian = principal[:, None] * principal[None, :] * stiffness
    hessian += np.eye(3)[..., None] * (principal * np.einsum("aan->an", energy.first_piola(f)))
    found: Array = np.einsum("ai,abn,bj->ijn", _ON_CONSTANT_VOLUME, hessian, _ON_CONSTANT_VOLUME)
    return found


def _is_stable(energy: Energy, mode: Mode, stretch: Array) -> NDArray[np.bool_]:
    """Whether W is convex in the logarithmic strains; where an energy overflows it is not.

    A determinant within round-off of zero counts as positive: at stretches of ten and more one
    direction is so much stiffer than the other that the difference of its products is noise.
    """
    d = logarithmic_stiffness(energy, mode, stretch)
    products = d[0, 0] * d[1, 1]
    determinant = products - d[0, 1] * d[1, 0]
    stable: NDArray[np.bool_] = (d[0, 0] + d[1, 1] > 0) & (determinant > -_ROUND_OFF * products)
    return stable
