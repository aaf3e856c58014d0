"""Stress and tangent of energies in isochoric principal stretches, also where stretches are equal.

The principal-axis tangent is that of Simo and Taylor, Comput. Methods Appl. Mech. Eng. 85 (1991)
273, but for its quotients of stress differences by stretch differences: the energies evaluate these
in closed form, so that nothing is perturbed, switched or lost as two stretches meet.
"""

from __future__ import annotations

import numpy as np

from rig.mechanics.hyperelastic.protocol import Array
from rig.mechanics.hyperelastic.spectral import Spectrum, spectrum
from rig.mechanics.hyperelastic.tensors import cofactor, determinant, sum_of_dyads

PAIRS = ((0, 1), (0, 2), (1, 2))
"""Pairs of principal axes, in the order of what is told for each of them."""


def principal_axes(f: Array) -> Spectrum:
    """Spectrum of F (3, 3, n), its stretches not a number where det F <= 0: no stress there."""
    axes = spectrum(f)
    sound = determinant(f, cofactor(f)) > 0
    return axes._replace(stretches=np.where(sound, axes.stretches, np.nan))


def isochoric_logs(stretches: Array) -> Array:
    """ln(J^(-1/3) lambda_a), (3, n)."""
    logs: Array = np.log(stretches)
    logs -= logs.mean(axis=0)
    return logs


def log_ratios(stretches: Array) -> tuple[Array, ...]:
    """ln(lambda_a / lambda_b) of each pair, (n,), with full accuracy as stretches meet."""
    return tuple(np.log1p((stretches[a] - stretches[b]) / stretches[b]) for a, b in PAIRS)


def piola_of(axes: Spectrum, kirchhoff: Array, out: Array) -> None:
    """P = sum over a of t_a / lambda_a n_a (x) N_a of principal Kirchhoff stresses t, (3, n)."""
    stress = kirchhoff / axes.stretches
    np.einsum("an,ian,jan->ijn", stress, axes.left, axes.right, out=out)


def tangent_of(
    axes: Spectrum, kirchhoff: Array, by_logs: Array, quotient: Array, out: Array
) -> None:
    """dP/dF with the turning of the principal axes into `out`, (3, 3, 3, 3, n).

    `by_logs` (3, 3, n) is dt_a / d ln lambda_b and is overwritten; `quotient` (3, n) is
    (t_a - t_b) / (lambda_a - lambda_b) of each pair.
    """
    hessian, symmetric, skew = _by_stretches(axes.stretches, kirchhoff, by_logs, quotient)
    dyads = np.empty((9, 3, 3, axes.stretches.shape[-1]))
    for a in range(3):
        np.multiply(axes.left[:, None, a], axes.right[None, :, a], out=dyads[a])
    normal = dyads[:3].copy()
    np.einsum("abn,bijn->aijn", hessian, normal, out=dyads[:3])
    scaled = np.empty_like(dyads)
    scaled[:3] = normal
    for at, (a, b) in enumerate(PAIRS):
        one = axes.left[:, None, a] * axes.right[None, :, b]
        other = axes.left[:, None, b] * axes.right[None, :, a]
        np.add(one, other, out=dyads[3 + at])
        np.subtract(one, other, out=dyads[6 + at])
        np.multiply(symmetric[at] / 2, dyads[3 + at], out=scaled[3 + at])
        np.multiply(skew[at] / 2, dyads[6 + at], out=scaled[6 + at])
    sum_of_dyads(scaled, dyads, out)


def _by_stretches(
    stretches: Array, kirchhoff: Array, by_logs: Array, quotient: Array
) -> tuple[Array, Array, Array]:
    """d2W/dlambda_a dlambda_b (3, 3, n), and for each of `PAIRS` S and D, (3, n).

    S = (w_a - w_b) / (lambda_a - lambda_b) and D = (w_a + w_b) / (lambda_a + lambda_b), where
    w_a = dW/dlambda_a, are the stiffnesses against shear and rotation of the two axes.
    """
    symmetric, skew = np.empty_like(quotient), np.empty_like(quotient)
    for at, (a, b) in enumerate(PAIRS):
        x, y = stretches[a], stretches[b]
        symmetric[at] = (quotient[at] - kirchhoff[b] / y) / x
        skew[at] = (kirchhoff[a] / x + kirchhoff[b] / y) / (x + y)
    for a in range(3):
        by_logs[a, a] -= kirchhoff[a]
    by_logs /= stretches[:, None] * stretches[None, :]
    return by_logs, symmetric, skew
