"""A whole material: an energy of distortion and, where that is isochoric, one of volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig.mechanics.hyperelastic.moduli import bulk_modulus_from, shear_modulus_from
from rig.mechanics.hyperelastic.polynomial import NeoHookean
from rig.mechanics.hyperelastic.protocol import Array, Energy, Volumetric
from rig.mechanics.hyperelastic.tensors import (
    add_cofactor_slope,
    cofactor,
    determinant,
    in_blocks,
    sum_of_dyads,
)
from rig.mechanics.hyperelastic.volumetric import QuadraticVolume


@dataclass(frozen=True)
class Hyperelastic:
    """W(F) = distortion(F) + volume(det F); implements `Energy` itself.

    `distortion` is any `Energy`; `volume` is None where `distortion` already knows what a change
    of volume costs (Saint Venant-Kirchhoff, linear). Mixed elements take the two parts, elements
    in displacements only the sum.
    """

    distortion: Energy
    volume: Volumetric | None

    def energy(self, deformation_gradient: Array, /) -> Array:
        """W in Pa, shape (...), for F of shape (3, 3, ...)."""
        result = self.distortion.energy(deformation_gradient)
        if self.volume is not None:
            flat = deformation_gradient.reshape(3, 3, -1)
            j = determinant(flat, cofactor(flat)).reshape(result.shape)
            result = result + self.volume.energy(j)
        return result

    def first_piola(self, deformation_gradient: Array, /) -> Array:
        """P + U'(J) cof F in Pa, shape (3, 3, ...)."""
        distortion, volume = self.distortion, self.volume
        if volume is None:
            return distortion.first_piola(deformation_gradient)

        def compute(f: Array, out: Array) -> None:
            cof = cofactor(f)
            np.multiply(volume.pressure(determinant(f, cof)), cof, out=out)
            out += distortion.first_piola(f)

        return in_blocks(deformation_gradient, 2, compute)

    def tangent(self, deformation_gradient: Array, /) -> Array:
        """A + U''(J) cof F (x) cof F + U'(J) d2J/dF2 in Pa, shape (3, 3, 3, 3, ...)."""
        distortion, volume = self.distortion, self.volume
        if volume is None:
            return distortion.tangent(deformation_gradient)

        def compute(f: Array, out: Array) -> None:
            cof = cofactor(f)
            j = determinant(f, cof)
            sum_of_dyads((volume.stiffness(j) * cof)[None], cof[None], out)
            add_cofactor_slope(out, volume.pressure(j), f)
            out += distortion.tangent(f)

        return in_blocks(deformation_gradient, 4, compute)


def neo_hookean_from(young_modulus: float, poisson_ratio: float) -> Hyperelastic:
    """The neo-Hookean material that is linear elasticity with E in Pa and nu at small strain.

    Shear modulus E / (2 (1 + nu)), bulk modulus E / (3 (1 - 2 nu)), U = K/2 (J - 1)^2. Raises
    MechanicsError unless E > 0 and -1 < nu < 0.5: an incompressible material has no bulk modulus.
    """
    return Hyperelastic(
        NeoHookean(shear_modulus_from(young_modulus, poisson_ratio)),
        QuadraticVolume(bulk_modulus_from(young_modulus, poisson_ratio)),
    )
