"""How far a deformed actuator is from tearing: its extremes against the material's data sheet.

A data sheet tells the force that tore a bar over the bar's section at rest, and how much longer
it was then: engineering stress and strain. Each is compared with its own kind: the largest
principal *nominal* stress with the strength, the largest *engineering* principal strain with the
elongation at break. The von Mises stress, which is a true one, is compared with the true stress
at break, strength times (1 + elongation), as an incompressible bar has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from rig.mechanics.fe.extremes import Extremes
from rig.spec.material import MaterialSpec


class Criterion(StrEnum):
    """What is compared with what."""

    NOMINAL_STRESS = "nominal stress"
    """Largest principal nominal stress against tensile strength."""
    ENGINEERING_STRAIN = "engineering strain"
    """Largest engineering principal strain against elongation at break."""
    TRUE_STRESS = "true stress"
    """Largest von Mises stress against the true stress at break."""


@dataclass(frozen=True)
class Margin:
    """One criterion at one pressure; stresses in Pa, strains as ratios."""

    criterion: Criterion
    demand: float
    """The largest value in the solid, notches included."""
    bulk_demand: float
    """The value that 99.5 % of the volume stays below."""
    low: float
    """Capacity at the low end of the data sheet's range."""
    high: float
    """Capacity at its high end."""

    @property
    def factor(self) -> float:
        """Safety factor with the low end of the range and the largest value: the cautious one."""
        return _ratio(self.low, self.demand)

    @property
    def factor_high(self) -> float:
        """Safety factor with the high end of the range and the largest value."""
        return _ratio(self.high, self.demand)

    @property
    def bulk_factor(self) -> float:
        """Safety factor of 99.5 % of the volume, with the low end of the range."""
        return _ratio(self.low, self.bulk_demand)


@dataclass(frozen=True)
class Safety:
    """All criteria that the material's data allow at one pressure."""

    pressure: float
    """In Pa."""
    margins: tuple[Margin, ...]
    """Empty where the material tells neither strength nor elongation."""

    @property
    def governing(self) -> Margin | None:
        """The criterion with the smallest factor."""
        return min(self.margins, key=lambda margin: margin.factor, default=None)


def safety(extremes: Extremes, material: MaterialSpec) -> Safety:
    """Safety of a solid of one material, for as many criteria as its spec has data for."""
    strength, elongation = material.tensile_strength, material.elongation_at_break
    margins = []
    if strength is not None:
        peak = extremes.nominal_stress
        margins.append(
            Margin(Criterion.NOMINAL_STRESS, peak.value, peak.bulk, strength.low, strength.high)
        )
    if elongation is not None:
        peak = extremes.principal_strain
        margins.append(
            Margin(
                Criterion.ENGINEERING_STRAIN, peak.value, peak.bulk, elongation.low, elongation.high
            )
        )
    if strength is not None and elongation is not None:
        peak = extremes.von_mises
        margins.append(
            Margin(
                Criterion.TRUE_STRESS,
                peak.value,
                peak.bulk,
                strength.low * (1 + elongation.low),
                strength.high * (1 + elongation.high),
            )
        )
    return Safety(extremes.pressure, tuple(margins))


def _ratio(capacity: float, demand: float) -> float:
    return capacity / demand if demand > 0 else float("inf")
