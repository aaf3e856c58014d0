"""What a simulated bench may be made of: its fluid, its drive, the wall of its actuator.

Everything here can be left out of a bench file; what is left out is ideal.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from rig.spec.base import Number, SpecModel, require
from rig.spec.quantity import (
    Compliance,
    Density,
    Duration,
    Force,
    Frequency,
    Pressure,
    Ratio,
    Torque,
    Viscosity,
    ViscousFriction,
)

AIR_VISCOSITY = 1.82e-5
"""Pa s at 20 degC (CRC Handbook of Chemistry and Physics)."""


class Air(SpecModel):
    """The bench is full of air."""

    kind: Literal["air"] = Field("air", description="which fluid this is")

    @property
    def viscosity(self) -> float:
        """Pa s."""
        return AIR_VISCOSITY


class Liquid(SpecModel):
    """The bench is full of a liquid with some air in it; the valve leads to a tank of the same.

    The defaults are those of water at 20 degC that was filled in without being degassed.
    """

    kind: Literal["liquid"] = Field(description="which fluid this is")
    density: Density = Field(
        998.2, gt=0, description="mass per volume"
    )  # CRC Handbook of Chemistry and Physics
    viscosity: Viscosity = Field(
        1.002e-3, gt=0, description="dynamic, at the bench's temperature"
    )  # the same
    bulk_modulus: Pressure = Field(2.18e9, gt=0, description="without bubbles")  # the same
    entrained_air: Ratio = Field(
        0.005, gt=0, lt=1, description="share of the volume that is bubbles, at ambient pressure"
    )  # a guess: filled by hand
    solubility: Ratio = Field(
        0.0200, ge=0, description="volume of air that dissolves in a volume of it, at any pressure"
    )  # Bunsen coefficient 0.0187 of air in water at 20 degC, at the gas's own temperature
    dissolution_time: Duration = Field(
        60.0, gt=0, description="time constant of bubbles that dissolve or come out"
    )  # a guess: it hangs on the size of the bubbles


class PlungerFriction(SpecModel):
    """Friction of the plunger's seal in the barrel, and what gives when it sticks."""

    breakaway: Force = Field(gt=0, description="at which the resting seal begins to slide")
    sliding: Force = Field(ge=0, description="of the sliding seal, at any speed")
    viscous: ViscousFriction = Field(0.0, ge=0, description="more of it per speed")
    rod_compliance: Compliance = Field(0.0, ge=0, description="between nut and seal")

    @model_validator(mode="after")
    def _sticks(self) -> PlungerFriction:
        require(
            self.breakaway >= self.sliding,
            "a seal that slides harder than it sticks would creep; expected breakaway at least "
            "as large as sliding",
        )
        return self


class MotorTorque(SpecModel):
    """What the stepper can push; without it every pulse is a step."""

    holding: Torque = Field(gt=0, description="pull-out torque at standstill")
    corner_rate: Frequency = Field(
        gt=0, description="full steps a second at which it is down to 1/sqrt(2)"
    )
    start_rate: Frequency = Field(
        gt=0, description="full steps a second up to which a stalled motor starts again"
    )
    screw_efficiency: Ratio = Field(gt=0, le=1, description="of the lead screw")


class CreepTerm(SpecModel):
    """One term of a Prony series."""

    share: Ratio = Field(gt=0, lt=1, description="of the response")
    time: Duration = Field(gt=0, description="after which this term has gone 63 % of its way")


class Mullins(SpecModel):
    """Softening of the virgin wall in its first load cycles (Ogden and Roxburgh, 1999).

    Below the highest pressure p_max so far the wall takes less pressure than when it was new, by
    the share `softening` erf((1 - (p / p_max)^2) / width).
    """

    softening: Ratio = Field(gt=0, lt=1, description="share of the pressure, far below the highest")
    width: Number = Field(1.0, gt=0, description="how far below the highest pressure it is felt")
    cycles: Number = Field(
        0.0, ge=0, description="load cycles in which it comes to 63 %; 0: all in the first"
    )
