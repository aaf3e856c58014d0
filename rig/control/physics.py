"""What Boyle's law says of the pressure system: stiffness at a pressure, and the motor's limit.

Gas of volume V at absolute pressure P in a cavity that grows by C = dV/dp obeys, pushed in by dx,

    dp/dx = n P / (V + n P C),    n = 1 isothermal (slow), n = 1.4 adiabatic (quick).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

ADIABATIC_EXPONENT = 1.4
"""Of air (CRC Handbook of Chemistry and Physics)."""


@dataclass(frozen=True)
class GasColumn:
    """Syringe, tube and actuator at one pressure."""

    pressure_kpa: float
    """Gauge."""
    ambient_kpa: float
    volume_ml: float
    """Of all gas."""
    compliance_ml_kpa: float
    """Growth of the actuator's cavity with pressure; 0 if it is not known."""
    exponent_quick: float = ADIABATIC_EXPONENT
    """Of a movement too quick for heat; 1 for bubbles in a liquid, which holds their heat."""

    def stiffness(self, exponent: float = 1.0) -> float:
        """dp/dx in kPa/mL of gas that is compressed with this polytropic exponent."""
        absolute = exponent * (self.ambient_kpa + self.pressure_kpa)
        return absolute / (self.volume_ml + absolute * self.compliance_ml_kpa)

    @property
    def isothermal(self) -> float:
        """kPa/mL of a slow movement."""
        return self.stiffness()

    @property
    def quick(self) -> float:
        """kPa/mL of a movement too quick for heat, and slow enough for the shape to follow."""
        return self.stiffness(self.exponent_quick)


def compression_ml(
    from_kpa: float, to_kpa: float, ambient_kpa: float, gas_ml: float, growth_ml: float
) -> float:
    """Plunger volume that brings `gas_ml` at `from_kpa` gauge to `to_kpa`, isothermally.

    `growth_ml` is how much the cavity grows meanwhile.
    """
    ratio = (ambient_kpa + from_kpa) / (ambient_kpa + to_kpa)
    return gas_ml * (1 - ratio) + growth_ml


def motor_limit_s(volume_ml: float, max_flow_ml_s: float, acceleration_ml_s2: float) -> float:
    """Least time for a plunger to sweep `volume_ml` from rest to rest: a trapezoid of speed."""
    ramp_ml = max_flow_ml_s**2 / acceleration_ml_s2
    if volume_ml <= ramp_ml:
        return 2 * math.sqrt(volume_ml / acceleration_ml_s2)
    return volume_ml / max_flow_ml_s + max_flow_ml_s / acceleration_ml_s2
