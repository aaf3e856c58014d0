"""Ogden's energy in principal stretches, with its exact tangent also where stretches are equal.

Ogden, Proc. R. Soc. A 326 (1972) 565. Quotients of stress differences by stretch differences are
evaluated in closed form, through expm1; see `principal` for what they are needed for.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic.principal import (
    PAIRS,
    isochoric_logs,
    log_ratios,
    piola_of,
    principal_axes,
    tangent_of,
)
from rig.mechanics.hyperelastic.protocol import Array
from rig.mechanics.hyperelastic.spectral import spectrum
from rig.mechanics.hyperelastic.tensors import cofactor, determinant, in_blocks


@dataclass(frozen=True)
class OgdenTerm:
    """One term 2 mu / alpha^2 (sum of l_a^alpha - 3): mu in Pa, alpha any number but zero."""

    mu: float
    alpha: float


@dataclass(frozen=True)
class Ogden:
    """W = sum over terms of 2 mu / alpha^2 (l_1^alpha + l_2^alpha + l_3^alpha - 3), in Pa.

    l_a = J^(-1/3) lambda_a are isochoric principal stretches. This is the convention of Abaqus:
    the shear modulus at rest is the sum of all mu. For the classic mu / alpha see `classic`.
    Raises MechanicsError without terms and for an alpha of zero. Implements `Energy`.
    """

    terms: tuple[OgdenTerm, ...]

    def __post_init__(self) -> None:
        if not self.terms or any(term.alpha == 0 for term in self.terms):
            raise MechanicsError(
                "Ogden's energy needs at least one term, and every exponent alpha other than zero "
                f"(the stretch to the power of zero is no energy); got {list(self.terms)}"
            )

    @classmethod
    def classic(cls, terms: Iterable[tuple[float, float]]) -> Ogden:
        """From (mu, alpha) of W = sum of mu / alpha (...), as Ogden's paper and COMSOL have it.

        The shear modulus at rest is then half the sum of mu alpha, and each mu alpha > 0.
        """
        return cls(tuple(OgdenTerm(mu * alpha / 2, alpha) for mu, alpha in terms))

    def energy(self, deformation_gradient: Array, /) -> Array:
        """W in Pa, shape (...), for F of shape (3, 3, ...); infinite where det F <= 0."""

        def compute(f: Array, out: Array) -> None:
            logs = isochoric_logs(spectrum(f).stretches)
            value = sum(
                2 * t.mu / t.alpha**2 * np.expm1(t.alpha * logs).sum(axis=0) for t in self.terms
            )
            out[:] = np.where(determinant(f, cofactor(f)) > 0, value, np.inf)

        return in_blocks(deformation_gradient, 0, compute)

    def first_piola(self, deformation_gradient: Array, /) -> Array:
        """P = sum over a of dW/dlambda_a n_a (x) N_a in Pa, shape (3, 3, ...)."""

        def compute(f: Array, out: Array) -> None:
            axes = principal_axes(f)
            piola_of(axes, self._kirchhoff(isochoric_logs(axes.stretches)), out)

        return in_blocks(deformation_gradient, 2, compute)

    def tangent(self, deformation_gradient: Array, /) -> Array:
        """A = dP/dF in Pa, shape (3, 3, 3, 3, ...), with the turning of the principal axes."""

        def compute(f: Array, out: Array) -> None:
            axes = principal_axes(f)
            kirchhoff = self._kirchhoff(isochoric_logs(axes.stretches))
            tangent_of(axes, kirchhoff, *self._slopes(axes.stretches), out)

        return in_blocks(deformation_gradient, 4, compute)

    def _kirchhoff(self, logs: Array) -> Array:
        """Principal Kirchhoff stresses lambda_a dW/dlambda_a, (3, n)."""
        result = np.zeros_like(logs)
        for term in self.terms:
            power = np.expm1(term.alpha * logs)
            result += 2 * term.mu / term.alpha * (power - power.mean(axis=0))
        return result

    def _slopes(self, stretches: Array) -> tuple[Array, Array]:
        """Of the principal Kirchhoff stresses t: dt_a / d ln lambda_b, (3, 3, n), and
        (t_a - t_b) / (lambda_a - lambda_b) for each of `PAIRS`, (3, n)."""
        logs = isochoric_logs(stretches)
        by_logs = np.zeros((3, *stretches.shape))
        quotient = np.zeros_like(stretches)
        ratios = log_ratios(stretches)
        for term in self.terms:
            power = np.exp(term.alpha * logs)
            mean = power.mean(axis=0)
            by_logs += 2 * term.mu / 3 * (mean - power[:, None] - power[None, :])
            for a in range(3):
                by_logs[a, a] += 2 * term.mu * power[a]
            for at, (_, b) in enumerate(PAIRS):
                slope = _power_quotient(term.alpha, ratios[at]) / stretches[b]
                quotient[at] += 2 * term.mu / term.alpha * power[b] * slope
        return by_logs, quotient


def _power_quotient(alpha: float, x: Array) -> Array:
    """(r^alpha - 1) / (r - 1) for r = exp(x), and its limit alpha at r = 1."""
    apart = x != 0
    quotient: Array = np.expm1(alpha * x) / np.expm1(np.where(apart, x, 1.0))
    return np.where(apart, quotient, alpha)
