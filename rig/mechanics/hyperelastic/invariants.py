"""Isotropic, isochoric energies of the two invariants of J^(-1/3) F, with exact derivatives.

With J = det F and C = F^T F the invariants are I1 = J^(-2/3) tr C and
I2 = J^(-4/3) (tr(C)^2 - tr(C^2)) / 2 (Holzapfel, Nonlinear Solid Mechanics, 2000, Section 6.4;
the bars that mark them as isochoric there are left out). Written in the gradients g1 = dI1/dF,
g2 = dI2/dF and H = dJ/dF the tangent needs at most three dyads; the theory page derives it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from rig.mechanics.hyperelastic.protocol import Array
from rig.mechanics.hyperelastic.tensors import (
    add_cofactor_slope,
    add_identity,
    cofactor,
    determinant,
    in_blocks,
    left_cauchy_green,
    product,
    right_cauchy_green,
    square,
    sum_of_dyads,
)


class Slopes(NamedTuple):
    """Derivatives of W by the invariants, each an array over points or one number for all."""

    by_1: Array | float
    by_2: Array | float = 0.0
    by_11: Array | float = 0.0
    by_12: Array | float = 0.0
    by_22: Array | float = 0.0


class InvariantEnergy(ABC):
    """W(I1, I2), told by its value and its `Slopes`; implements `Energy`."""

    _has_second: ClassVar[bool] = True
    """Whether I2 matters; energies of I1 alone are spared its cost."""

    @abstractmethod
    def _value(self, i1: Array, i2: Array, /) -> Array:
        """W at the invariants."""

    @abstractmethod
    def _slopes(self, i1: Array, i2: Array, /) -> Slopes:
        """First and second derivatives of W at the invariants."""

    def energy(self, deformation_gradient: Array, /) -> Array:
        """W in Pa, shape (...), for F of shape (3, 3, ...); infinite where det F <= 0."""

        def compute(f: Array, out: Array) -> None:
            k = self._kinematics(f)
            out[:] = np.where(np.real(k.j) > 0, self._value(k.i1, k.i2), np.inf)

        return in_blocks(deformation_gradient, 0, compute)

    def first_piola(self, deformation_gradient: Array, /) -> Array:
        """P = W_1 g1 + W_2 g2 in Pa, shape (3, 3, ...)."""

        def compute(f: Array, out: Array) -> None:
            k = self._kinematics(f)
            slopes = self._slopes(k.i1, k.i2)
            np.multiply(slopes.by_1, k.g1, out=out)
            if self._has_second:
                out += slopes.by_2 * k.g2

        return in_blocks(deformation_gradient, 2, compute)

    def tangent(self, deformation_gradient: Array, /) -> Array:
        """A = dP/dF in Pa, shape (3, 3, 3, 3, ...)."""

        def compute(f: Array, out: Array) -> None:
            k = self._kinematics(f)
            slopes = self._slopes(k.i1, k.i2)
            if self._has_second:
                _tangent_of_both(f, k, slopes, out)
            else:
                _tangent_of_first(f, k, slopes, out)

        return in_blocks(deformation_gradient, 4, compute)

    def _kinematics(self, f: Array) -> _Kinematics:
        cof = cofactor(f)
        j = determinant(f, cof)
        a = j ** (-2 / 3)
        trace = square(f)
        i1 = a * trace
        g1 = (2 * a) * f - (2 / 3 * i1 / j) * cof
        if not self._has_second:
            return _Kinematics(cof, j, a, i1, i1, g1, g1)
        i2 = a**2 * square(cof)  # tr(C)^2 - tr(C^2) = 2 tr(cof C) = 2 |cof F|^2
        bf = product(left_cauchy_green(f), f)
        g2 = (2 * a**2) * (trace * f - bf) - (4 / 3 * i2 / j) * cof
        return _Kinematics(cof, j, a, i1, i2, g1, g2)


@dataclass(frozen=True)
class _Kinematics:
    """Cofactor H, J, a = J^(-2/3), the invariants and their gradients; I2 is I1 where unused."""

    cof: Array
    j: Array
    a: Array
    i1: Array
    i2: Array
    g1: Array
    g2: Array


def _tangent_of_first(f: Array, k: _Kinematics, w: Slopes, out: Array) -> None:
    cross = -2 / 3 * w.by_1 / k.j
    left = np.stack((k.g1, k.cof))
    right = np.stack(
        (w.by_11 * k.g1 + cross * k.cof, cross * k.g1 - (cross * k.i1 / (3 * k.j)) * k.cof)
    )
    sum_of_dyads(left, right, out)
    add_identity(out, 2 * k.a * w.by_1)
    add_cofactor_slope(out, cross * k.i1, f)


def _tangent_of_both(f: Array, k: _Kinematics, w: Slopes, out: Array) -> None:
    s = 2 / 3 * k.i1 / k.j
    with_1 = -2 / 3 * w.by_1 / k.j + w.by_2 * s
    with_2 = -4 / 3 * w.by_2 / k.j
    alone = (2 / 9 * w.by_1 * k.i1 - 4 / 9 * w.by_2 * k.i2) / k.j**2 + w.by_2 * s**2
    left = np.stack((k.g1, k.g2, k.cof))
    right = np.stack(
        (
            (w.by_11 + w.by_2) * k.g1 + w.by_12 * k.g2 + with_1 * k.cof,
            w.by_12 * k.g1 + w.by_22 * k.g2 + with_2 * k.cof,
            with_1 * k.g1 + with_2 * k.g2 + alone * k.cof,
        )
    )
    sum_of_dyads(left, right, out)
    add_cofactor_slope(out, (-2 / 3 * w.by_1 * k.i1 - 4 / 3 * w.by_2 * k.i2) / k.j, f)
    # what is left: -2 a^2 W_2 (d_ik C_jl + B_ik d_jl + F_il F_kj) + 2 a (W_1 + W_2 I1) d_ik d_jl
    minus = -2 * k.a**2 * w.by_2
    c = minus * right_cauchy_green(f)
    b = minus * left_cauchy_green(f)
    unit = 2 * k.a * (w.by_1 + w.by_2 * k.i1)
    for i in range(3):
        c[i, i] += unit
    scaled, turned = minus * f, f.swapaxes(0, 1)
    row = np.empty((3, *f.shape), dtype=f.dtype)  # a third of the tangent: fits the cache
    for i in range(3):
        out[i, :, i] += c
        out[:, i, :, i] += b
        np.multiply(scaled[i], turned[:, :, None], out=row)
        out[i] += row
