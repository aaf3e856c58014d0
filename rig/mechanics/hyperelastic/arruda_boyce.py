"""The eight-chain energy of rubber whose chains lock, as the usual series of five terms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rig.mechanics.hyperelastic.invariants import InvariantEnergy, Slopes
from rig.mechanics.hyperelastic.protocol import Array

_SERIES = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)
"""Of the inverse Langevin function, eq. (23) of Arruda and Boyce; the order is the power of I1."""


@dataclass(frozen=True)
class ArrudaBoyce(InvariantEnergy):
    """W = mu sum of a_i (I1^i - 3^i) / lock^(2 i - 2), i = 1 to 5, in Pa.

    `modulus` is mu in Pa, `locking_stretch` the chain stretch sqrt(I1 / 3) at which the chains
    lock; truncated after five terms the series stiffens there without becoming infinite. The
    shear modulus at rest is mu (1 + 3/5 k + 99/175 k^2 + 513/875 k^3 + 42039/67375 k^4) with
    k = 1 / lock^2, a little above mu. Arruda and Boyce, J. Mech. Phys. Solids 41 (1993) 389.
    """

    modulus: float
    locking_stretch: float
    _has_second: ClassVar[bool] = False

    def _value(self, i1: Array, _i2: Array, /) -> Array:
        coefficients = self._coefficients()
        return _horner(coefficients, i1) - _horner(coefficients, np.full_like(i1, 3.0))

    def _slopes(self, i1: Array, _i2: Array, /) -> Slopes:
        first = _derivative(self._coefficients())
        return Slopes(by_1=_horner(first, i1), by_11=_horner(_derivative(first), i1))

    def _coefficients(self) -> list[float]:
        """Of the polynomial in I1, lowest power first; the constant is zero."""
        squared = self.locking_stretch**2
        return [0.0, *(self.modulus * a / squared**i for i, a in enumerate(_SERIES))]


def _derivative(coefficients: list[float]) -> list[float]:
    return [power * c for power, c in enumerate(coefficients)][1:]


def _horner(coefficients: list[float], x: Array) -> Array:
    result = np.full_like(x, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        result *= x
        result += coefficient
    return result
