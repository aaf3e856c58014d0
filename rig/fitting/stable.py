"""Least squares for moduli under Drucker stability, where stability is a condition on all of them.

The Hessian of an energy in logarithmic strains is linear in the moduli c, so that the set of
stable moduli is convex, and so is the problem: there is one smallest residual. Stiffness is
measured against the neo-Hookean energy of a shear modulus of one: M(c) = L^-1 D(c) L^-T, with L L^T
the neo-Hookean Hessian, must have no eigenvalue below a small positive number at stretches sampled
in all three modes. Each direction v in which it has one cuts off a half space, v M(c) v >= least;
cuts are added until there is none (Kelley's method), each time solving least squares with linear
inequalities exactly (Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space, solve_triangular
from scipy.optimize import nnls

from rig.fitting.errors import FittingError
from rig.fitting.families import Family
from rig.fitting.specimen import Array
from rig.mechanics.hyperelastic import Energy, Mode, NeoHookean, logarithmic_stiffness

_SAMPLES = 200
"""Stretches a mode, from the shortest to the longest."""
_LEAST = 2e-3
"""Of the stiffness of the neo-Hookean material that fits best."""
_ROUNDS = 200
_MET = 1e-3
"""Of `_LEAST`: what a condition may be missed by."""


@dataclass(frozen=True)
class StableFit:
    """Moduli and the covariance that the residuals give them, per unit of residual variance."""

    moduli: Array
    covariance: Array | None
    """(k, k), along the active conditions; None if they leave nothing free."""
    held: bool
    """Whether stability and not the data alone chose the moduli."""


def stable_least_squares(
    family: Family, columns: Array, data: Array, lowest: float, highest: float
) -> StableFit:
    """Moduli c of least |columns c - data| that are stable from `lowest` to `highest` stretch.

    `columns` is (n, k), the stresses of unit moduli in any scaling of the residuals; `data` (n,).
    Raises FittingError where the columns are not independent, or no stable moduli are found.
    """
    size = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    q, r = np.linalg.qr(columns / size)
    if np.linalg.matrix_rank(r, tol=1e-10) < r.shape[0]:
        raise FittingError(
            f"{family.name}: the data cannot tell its {r.shape[0]} coefficients apart. Add tests "
            f"of other modes or of larger strains, or fit an energy of fewer terms."
        )
    target = q.T @ data
    first = columns[:, 0]
    modulus = 2 * max(float(first @ data) / float(first @ first), np.finfo(float).tiny)
    stiffness = _relative_stiffness(family, lowest, highest) / size[:, None, None, None]
    cuts = np.empty((0, r.shape[0]))
    for _ in range(_ROUNDS):
        scaled, active = _with_inequalities(r, target, cuts, _LEAST * modulus)
        added = _cuts(stiffness, scaled, _LEAST * (1 - _MET) * modulus)
        if not added.size:
            break
        cuts = np.concatenate([cuts, added])
    else:
        raise FittingError(
            f"{family.name}: no stable coefficients were found for these data; fit another energy."
        )
    basis = null_space(cuts[active], rcond=1e-8) if active.any() else np.eye(r.shape[0])
    return StableFit(
        moduli=scaled / size,
        covariance=_covariance(r, basis, size) if basis.shape[1] else None,
        held=bool(active.any()),
    )


def _with_inequalities(
    r: Array, target: Array, cuts: Array, least: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Least |r y - target| with cuts y >= least, and which of the cuts are active, (m,).

    With z = r y - target it is the point of least distance from the origin in a polyhedron, which
    non-negative least squares finds.
    """
    free = solve_triangular(r, target)
    if not cuts.size:
        return free, np.zeros(0, dtype=bool)
    rows = solve_triangular(r, cuts.T, trans="T").T
    bounds = least - cuts @ free
    length = np.linalg.norm(rows, axis=1)
    rows, bounds = rows / length[:, None], bounds / length
    unit = float(np.max(np.abs(bounds)))  # so that both parts of the system are of one size
    system = np.vstack([rows.T, bounds / unit])
    wanted = np.zeros(system.shape[0])
    wanted[-1] = 1.0
    weights, _ = nnls(system, wanted)
    left = system @ weights - wanted
    if abs(left[-1]) < 1e-12:
        raise FittingError("the conditions of stability contradict each other.")
    return free + solve_triangular(r, -left[:-1] / left[-1] * unit), weights > 0


def _cuts(stiffness: Array, moduli: Array, least: float) -> Array:
    """Half spaces that exclude the worst place of each third of the samples, (m, k)."""
    matrices = np.einsum("k,kijm->mij", moduli, stiffness)
    eigenvalues, vectors = np.linalg.eigh(matrices)
    places = []
    for part in np.array_split(np.arange(eigenvalues.shape[0]), 3 * len(Mode)):
        worst = part[int(np.argmin(eigenvalues[part, 0]))]
        if eigenvalues[worst, 0] < least:
            places.append(worst)
    return np.array(
        [np.einsum("kij,i,j->k", stiffness[..., m], *[vectors[m, :, 0]] * 2) for m in places]
    )


def _relative_stiffness(family: Family, lowest: float, highest: float) -> Array:
    """M of unit moduli at all samples of all modes, (k, 2, 2, m)."""
    stretch = np.geomspace(lowest, highest, _SAMPLES)
    units = [
        family.build(dict(zip(family.moduli, row, strict=True)))
        for row in np.eye(len(family.moduli)).tolist()
    ]
    parts = []
    for mode in Mode:
        reference = _by_place(NeoHookean(1.0), mode, stretch)
        inverse = np.linalg.inv(np.linalg.cholesky(reference))
        own = np.stack([_by_place(unit, mode, stretch) for unit in units])
        parts.append(inverse @ own @ np.swapaxes(inverse, -1, -2))
    return np.moveaxis(np.concatenate(parts, axis=1), 1, -1)


def _by_place(energy: Energy, mode: Mode, stretch: Array) -> Array:
    return np.moveaxis(logarithmic_stiffness(energy, mode, stretch), -1, 0)


def _covariance(r: Array, basis: Array, size: Array) -> Array:
    """Inverse of the normal matrix within the space that the active conditions leave, (k, k)."""
    reduced = np.linalg.inv(basis.T @ r.T @ r @ basis)
    return np.asarray(basis @ reduced @ basis.T / np.outer(size, size))
