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
