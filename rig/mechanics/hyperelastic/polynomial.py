"""Polynomial energies of the isochoric invariants: neo-Hookean, Mooney-Rivlin, Yeoh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rig.mechanics.hyperelastic.invariants import InvariantEnergy, Slopes
from rig.mechanics.hyperelastic.protocol import Array


@dataclass(frozen=True)
class NeoHookean(InvariantEnergy):
    """W = mu/2 (I1 - 3), with mu the shear modulus at rest in Pa (Treloar, 1943)."""

    shear_modulus: float
    _has_second: ClassVar[bool] = False

    def _value(self, i1: Array, _i2: Array, /) -> Array:
        return self.shear_modulus / 2 * (i1 - 3)

    def _slopes(self, _i1: Array, _i2: Array, /) -> Slopes:
        return Slopes(self.shear_modulus / 2)


@dataclass(frozen=True)
class MooneyRivlin(InvariantEnergy):
    """W = sum of c_ij (I1 - 3)^i (I2 - 3)^j, all in Pa; shear modulus at rest 2 (c10 + c01).

    Two terms are c10 and c01 (Mooney, 1940), three have c11, too, five all of second order
    (Rivlin and Saunders, 1951).
    """

    c10: float
    c01: float
    c11: float = 0.0
    c20: float = 0.0
    c02: float = 0.0

    def _value(self, i1: Array, i2: Array, /) -> Array:
        x, y = i1 - 3, i2 - 3
        return x * (self.c10 + self.c11 * y + self.c20 * x) + y * (self.c01 + self.c02 * y)

    def _slopes(self, i1: Array, i2: Array, /) -> Slopes:
        x, y = i1 - 3, i2 - 3
        return Slopes(
            by_1=self.c10 + self.c11 * y + 2 * self.c20 * x,
            by_2=self.c01 + self.c11 * x + 2 * self.c02 * y,
            by_11=2 * self.c20,
            by_12=self.c11,
            by_22=2 * self.c02,
        )


@dataclass(frozen=True)
class Yeoh(InvariantEnergy):
    """W = sum of c_i0 (I1 - 3)^i for i = 1, 2, 3, in Pa; shear modulus at rest 2 c10.

    Yeoh, Rubber Chem. Technol. 66 (1993) 754.
    """

    c10: float
    c20: float = 0.0
    c30: float = 0.0
    _has_second: ClassVar[bool] = False

    def _value(self, i1: Array, _i2: Array, /) -> Array:
        x = i1 - 3
        return x * (self.c10 + x * (self.c20 + x * self.c30))

    def _slopes(self, i1: Array, _i2: Array, /) -> Slopes:
        x = i1 - 3
        return Slopes(
            by_1=self.c10 + x * (2 * self.c20 + 3 * self.c30 * x),
            by_11=2 * self.c20 + 6 * self.c30 * x,
        )
