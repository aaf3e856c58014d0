"""A dead-weight tester: pressure by masses on a piston of known area.

A piston that floats, neither rising nor sinking, is borne by the gauge pressure (OIML R 110)

    p = (masses + piston) (1 - air / 8000) g / area,

with conventional masses, local gravity g, and the effective area of the piston's certificate.
"""

from __future__ import annotations

from dataclasses import dataclass

from rig.calibrate.air import BUOYANCY


@dataclass(frozen=True)
class Piston:
    """The piston of a dead-weight tester, where it stands."""

    area_mm2: float
    area_u: float
    """Relative standard uncertainty of the effective area."""
    mass_g: float
    """Of the piston with its carrier, without the masses on it."""
    gravity: float
    """Of the lab, m/s2."""

    def pressure_kpa(self, masses_g: float) -> float:
        """Gauge pressure under which it floats with these masses on it."""
        newtons = (masses_g + self.mass_g) / 1e3 * (1 - BUOYANCY) * self.gravity
        return newtons / self.area_mm2 * 1e3

    def masses_g(self, pressure_kpa: float) -> float:
        """Masses with which it floats at a gauge pressure; below zero where it is too heavy."""
        return pressure_kpa / self.pressure_kpa(1.0 - self.mass_g) - self.mass_g
