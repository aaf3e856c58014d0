"""The two laws made of Hooke's constants alone: Saint Venant-Kirchhoff and linear elasticity.

Both see the whole of F, volume included. They are here for comparison and for small strain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig.mechanics.hyperelastic.moduli import bulk_modulus_from, shear_modulus_from
from rig.mechanics.hyperelastic.protocol import Array
from rig.mechanics.hyperelastic.tensors import (
    add_identity,
    in_blocks,
    left_cauchy_green,
    product,
    right_cauchy_green,
)


@dataclass(frozen=True)
class SaintVenantKirchhoff:
    """W = lambda/2 tr(E)^2 + mu E : E of the Green strain E = (F^T F - 1) / 2.

    Young's modulus in Pa. Right for large rotation with small strain; softens and collapses in
    compression, and stays finite where det F <= 0. Raises MechanicsError for constants that no
    elastic solid has. Implements `Energy`.
    """

    young_modulus: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        _lame(self.young_modulus, self.poisson_ratio)

    def energy(self, deformation_gradient: Array, /) -> Array:
        """W in Pa, shape (...), for F of shape (3, 3, ...)."""
        lam, mu = _lame(self.young_modulus, self.poisson_ratio)

        def compute(f: Array, out: Array) -> None:
            out[:] = _quadratic(lam, mu, _green_strain(f))

        return in_blocks(deformation_gradient, 0, compute)

    def first_piola(self, deformation_gradient: Array, /) -> Array:
        """P = F (lambda tr(E) 1 + 2 mu E) in Pa, shape (3, 3, ...)."""
        lam, mu = _lame(self.young_modulus, self.poisson_ratio)

        def compute(f: Array, out: Array) -> None:
            out[:] = product(f, _hooke(lam, mu, _green_strain(f)))

        return in_blocks(deformation_gradient, 2, compute)

    def tangent(self, deformation_gradient: Array, /) -> Array:
        """A_ijkl = d_ik S_jl + lambda F_ij F_kl + mu (F_il F_kj + B_ik d_jl) in Pa."""
        lam, mu = _lame(self.young_modulus, self.poisson_ratio)

        def compute(f: Array, out: Array) -> None:
            np.multiply((lam * f)[:, :, None, None], f, out=out)
            out += (mu * f)[:, None, None] * f.swapaxes(0, 1)[None, :, :, None]
            stress = _hooke(lam, mu, _green_strain(f))
            b = mu * left_cauchy_green(f)
            for i in range(3):
                out[i, :, i] += stress
                out[:, i, :, i] += b

        return in_blocks(deformation_gradient, 4, compute)


@dataclass(frozen=True)
class LinearElastic:
    """W = lambda/2 tr(e)^2 + mu e : e of the small strain e = (F + F^T) / 2 - 1.

    Young's modulus in Pa. The limit of all the others at small strain and rotation, and the only
    one that is not objective: a rotated body is stressed. Raises MechanicsError for constants
    that no elastic solid has. Implements `Energy`.
    """

    young_modulus: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        _lame(self.young_modulus, self.poisson_ratio)

    def energy(self, deformation_gradient: Array, /) -> Array:
        """W in Pa, shape (...), for F of shape (3, 3, ...)."""
        lam, mu = _lame(self.young_modulus, self.poisson_ratio)

        def compute(f: Array, out: Array) -> None:
            out[:] = _quadratic(lam, mu, _small_strain(f))

        return in_blocks(deformation_gradient, 0, compute)

    def first_piola(self, deformation_gradient: Array, /) -> Array:
        """lambda tr(e) 1 + 2 mu e in Pa, shape (3, 3, ...)."""
        lam, mu = _lame(self.young_modulus, self.poisson_ratio)

        def compute(f: Array, out: Array) -> None:
            out[:] = _hooke(lam, mu, _small_strain(f))

        return in_blocks(deformation_gradient, 2, compute)

    def tangent(self, deformation_gradient: Array, /) -> Array:
        """Hooke's constants, the same at every point, in Pa, shape (3, 3, 3, 3, ...)."""
        lam, mu = _lame(self.young_modulus, self.poisson_ratio)

        def compute(_f: Array, out: Array) -> None:
            out[:] = 0
            add_identity(out, np.asarray(mu))
            for i in range(3):
                for j in range(3):
                    out[i, i, j, j] += lam
                    out[i, j, j, i] += mu

        return in_blocks(deformation_gradient, 4, compute)


def _lame(young_modulus: float, poisson_ratio: float) -> tuple[float, float]:
    mu = shear_modulus_from(young_modulus, poisson_ratio)
    return bulk_modulus_from(young_modulus, poisson_ratio) - 2 / 3 * mu, mu


def _green_strain(f: Array) -> Array:
    strain = right_cauchy_green(f) / 2
    for i in range(3):
        strain[i, i] -= 0.5
    return strain


def _small_strain(f: Array) -> Array:
    strain = (f + f.swapaxes(0, 1)) / 2
    for i in range(3):
        strain[i, i] -= 1
    return strain


def _trace(strain: Array) -> Array:
    result: Array = strain[0, 0] + strain[1, 1] + strain[2, 2]
    return result


def _quadratic(lam: float, mu: float, strain: Array) -> Array:
    squares: Array = np.einsum("ijn,ijn->n", strain, strain)
    return lam / 2 * _trace(strain) ** 2 + mu * squares


def _hooke(lam: float, mu: float, strain: Array) -> Array:
    stress = 2 * mu * strain
    dilation = lam * _trace(strain)
    for i in range(3):
        stress[i, i] += dilation
    return stress
