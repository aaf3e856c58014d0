"""Elastic-plastic solids at finite strain: J2 flow in principal logarithmic strains.

F = Fe Fp; the elastic part is Hencky's, t = 2 mu dev(ln Ve) + K ln J 1 with the Kirchhoff stress
t = J sigma; it flows where sqrt(3/2) |dev t| reaches the yield stress s0 + H a, with the equivalent
plastic strain a, associatively and without a change of volume. The exponential map integrates the
flow: in the principal axes of the trial strain it is the radial return of small strain, exact
where these axes do not turn (Weber & Anand, Comput. Methods Appl. Mech. Eng. 79 (1990) 173; Simo,
ibid. 99 (1992) 61). H = 0 is perfectly plastic.

One step is the minimum of an incremental energy over what flows in it (Ortiz & Stainier, ibid. 171
(1999) 419),

    W(F) = min over g >= 0 of  mu |dev e - sqrt(3/2) g N|^2 + (s0 + H a) g + H g^2 / 2,

with the logarithms e of the principal stretches of the trial Fe = F Fp^-1 and N = dev e / |dev e|.
Its derivatives are the stress at the end of the step and the consistent, symmetric tangent: the
finite elements need nothing but another `Energy` for every step. The change of volume is elastic:
`HenckyVolume` beside it.
"""

from __future__ import annotations

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
from rig.mechanics.hyperelastic.tensors import cofactor, determinant, in_blocks, product

_COMPONENTS = 10
"""Of the history: the inverse of Fp, row by row, and the equivalent plastic strain."""


@dataclass(frozen=True)
class J2Plasticity:
    """Shear modulus, yield stress and hardening modulus in Pa; implements `Flowing`.

    Raises MechanicsError unless the first two are above zero and the last is not below.
    """

    shear_modulus: float
    yield_stress: float
    hardening_modulus: float = 0.0

    def __post_init__(self) -> None:
        if not (self.shear_modulus > 0 and self.yield_stress > 0 and self.hardening_modulus >= 0):
            raise MechanicsError(
                f"no solid flows like {self!r}: expected a shear modulus and a yield stress above "
                "0 and a hardening modulus of at least 0; softening has no unique answer"
            )

    def virgin(self, shape: tuple[int, ...], /) -> Array:
        """Fp = 1 and no plastic strain, (10, *shape)."""
        history = np.zeros((_COMPONENTS, *shape))
        history[:9:4] = 1.0
        return history

    def since(self, history: Array, /) -> J2Step:
        """Incremental energy from a history (10, ...) on."""
        flat = history.reshape(_COMPONENTS, -1)
        return J2Step(self, flat[:9].reshape(3, 3, -1), flat[9])

    def afterwards(self, history: Array, deformation_gradient: Array, /) -> Array:
        """The history (10, ...) after a step from `history` to F (3, 3, ...)."""
        step = self.since(history)
        trial = product(deformation_gradient.reshape(3, 3, -1), step.inverse)
        axes = spectrum(trial)
        logs = isochoric_logs(axes.stretches)
        flow = step.flow(logs)
        back = np.exp(-flow.share * logs)
        turned = np.einsum("ian,an,jan->ijn", axes.right, back, axes.right)
        after = np.empty((_COMPONENTS, logs.shape[-1]))
        after[:9] = product(step.inverse, turned).reshape(9, -1)
        after[9] = step.strain + flow.strain
        return np.where(flow.yields, after, history.reshape(after.shape)).reshape(history.shape)


def plastic_strain(history: Array) -> Array:
    """Equivalent plastic strain, (...), of a history (10, ...)."""
    strain: Array = history[9]
    return strain


@dataclass(frozen=True)
class Flow:
    """What one step does at each point, all (n,)."""

    yields: Array
    """Whether anything flows."""
    share: Array
    """Part of the trial strain's deviator that is plastic in the end; 0 where nothing flows."""
    strain: Array
    """Equivalent plastic strain of the step."""
    yield_stress: Array
    """Before the step, in Pa."""
    stress: Array
    """Equivalent trial stress in Pa."""


@dataclass(frozen=True)
class J2Step:
    """The material within one step; implements `Energy`."""

    law: J2Plasticity
    inverse: Array
    """Fp^-1 before the step, (3, 3, n)."""
    strain: Array
    """Equivalent plastic strain before the step, (n,)."""

    def energy(self, deformation_gradient: Array, /) -> Array:
        """Incremental energy in Pa, shape (...); infinite where det F <= 0."""

        def compute(f: Array, out: Array, inverse: Array, strain: Array) -> None:
            step = J2Step(self.law, inverse, strain)
            trial = product(f, inverse)
            logs = isochoric_logs(spectrum(trial).stretches)
            flow = step.flow(logs)
            elastic = (1 - flow.share) ** 2 * np.einsum("an,an->n", logs, logs)
            value = self.law.shear_modulus * elastic
            value += (flow.yield_stress + self.law.hardening_modulus / 2 * flow.strain) * (
                flow.strain
            )
            out[:] = np.where(determinant(trial, cofactor(trial)) > 0, value, np.inf)

        return in_blocks(deformation_gradient, 0, compute, (self.inverse, self.strain))

    def first_piola(self, deformation_gradient: Array, /) -> Array:
        """P = P_trial Fp^-T in Pa, shape (3, 3, ...)."""

        def compute(f: Array, out: Array, inverse: Array, strain: Array) -> None:
            axes = principal_axes(product(f, inverse))
            logs = isochoric_logs(axes.stretches)
            stress = np.empty_like(f)
            piola_of(axes, J2Step(self.law, inverse, strain)._kirchhoff(logs), stress)
            np.einsum("ian,jan->ijn", stress, inverse, out=out)

        return in_blocks(deformation_gradient, 2, compute, (self.inverse, self.strain))

    def tangent(self, deformation_gradient: Array, /) -> Array:
        """A = dP/dF in Pa, consistent with the step, shape (3, 3, 3, 3, ...)."""

        def compute(f: Array, out: Array, inverse: Array, strain: Array) -> None:
            step = J2Step(self.law, inverse, strain)
            axes = principal_axes(product(f, inverse))
            kirchhoff = step._kirchhoff(isochoric_logs(axes.stretches))
            slope = np.empty((3, 3, 3, 3, f.shape[-1]), dtype=f.dtype)
            tangent_of(axes, kirchhoff, *step._slopes(axes.stretches), slope)
            half = np.einsum("iakln,jan->ijkln", slope, inverse)
            np.einsum("ijkbn,lbn->ijkln", half, inverse, out=out)

        return in_blocks(deformation_gradient, 4, compute, (self.inverse, self.strain))

    def flow(self, logs: Array) -> Flow:
        """Radial return of trial strains: isochoric logarithms, (3, n)."""
        law = self.law
        stress = np.sqrt(6 * np.einsum("an,an->n", logs, logs)) * law.shear_modulus
        limit = law.yield_stress + law.hardening_modulus * self.strain
        stiffness = 3 * law.shear_modulus + law.hardening_modulus
        yields = stress > limit
        strain = np.where(yields, stress - limit, 0.0) / stiffness
        share = 3 * law.shear_modulus * strain / np.where(yields, stress, 1.0)
        return Flow(yields, share, strain, limit, stress)

    def _kirchhoff(self, logs: Array) -> Array:
        """Principal Kirchhoff stresses at the end of the step, (3, n)."""
        return np.asarray(2 * self.law.shear_modulus * (1 - self.flow(logs).share) * logs)

    def _slopes(self, stretches: Array) -> tuple[Array, Array]:
        """Of the principal Kirchhoff stresses t: dt_a / d ln lambda_b, (3, 3, n), and
        (t_a - t_b) / (lambda_a - lambda_b) for each of `PAIRS`, (3, n)."""
        law = self.law
        logs = isochoric_logs(stretches)
        flow = self.flow(logs)
        secant = 2 * law.shear_modulus * (1 - flow.share)
        # the return is radial: beside the secant only the length of the strain counts
        lost = 3 * law.shear_modulus / (3 * law.shear_modulus + law.hardening_modulus)
        size = np.where(flow.yields, flow.stress, 1.0)
        radial = 12 * law.shear_modulus**3 * lost * flow.yield_stress / size**3
        by_logs = -np.where(flow.yields, radial, 0.0) * logs[:, None] * logs[None, :]
        by_logs -= secant / 3
        for a in range(3):
            by_logs[a, a] += secant
        quotient = np.empty_like(stretches)
        for at, ((_, b), x) in enumerate(zip(PAIRS, log_ratios(stretches), strict=True)):
            apart = x != 0
            ratio = np.where(apart, x / np.expm1(np.where(apart, x, 1.0)), 1.0)
            quotient[at] = secant * ratio / stretches[b]
        return by_logs, quotient
