"""What a material test would show: nominal stress against stretch in the three usual modes.

Uniaxial (one direction pulled, two free), equibiaxial (two pulled, one free) and planar or pure
shear (one pulled, one held, one free). The stress is the nominal one, force per area at rest, in
each pulled direction; stretches below one are compression.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic.protocol import Array, Energy

_MOST_ITERATIONS = 100
_LONGEST_STEP = 0.3
_CONVERGED = 1e-13


class Mode(StrEnum):
    """How a homogeneous specimen is pulled; direction 0 is always pulled, 2 always free."""

    UNIAXIAL = "uniaxial"
    EQUIBIAXIAL = "equibiaxial"
    PLANAR = "planar"


@dataclass(frozen=True)
class Response:
    """A homogeneous test, all arrays of one shape: stretch pulled to, stress in Pa, and the rest.

    `transverse_stretch` is that of the free direction, `volume_ratio` the J that follows.
    """

    mode: Mode
    stretch: Array
    nominal_stress: Array
    transverse_stretch: Array
    volume_ratio: Array


def incompressible_response(energy: Energy, mode: Mode, stretch: Array) -> Response:
    """The test of an incompressible material, of which `energy` is the part for distortion.

    The pressure that keeps the volume is found from the free direction, so that any part for the
    volume in `energy` drops out. Raises MechanicsError for stretches that are not above zero.
    """
    pulled = _checked(stretch)
    free = incompressible_free_stretch(mode, pulled)
    stretches = principal_stretches(mode, pulled, free)
    stress = energy.first_piola(diagonal(stretches))
    nominal = stress[0, 0] - stress[2, 2] * free / pulled
    return Response(mode, pulled, nominal, free, np.ones_like(pulled))


def response(material: Energy, mode: Mode, stretch: Array) -> Response:
    """The test of a compressible material: the free direction is left without stress.

    `material` is the whole energy, volume included, such as a `Hyperelastic`. Raises
    MechanicsError for stretches that are not above zero, and where no transverse stretch
    without stress is found: the material has lost its stability there.
    """
    pulled = _checked(stretch)
    logs = np.log(incompressible_free_stretch(mode, pulled))
    for _ in range(_MOST_ITERATIONS):
        f = diagonal(principal_stretches(mode, pulled, np.exp(logs)))
        residual = material.first_piola(f)[2, 2]
        tangent = material.tangent(f)
        slope = tangent[2, 2, 2, 2]
        if mode is Mode.UNIAXIAL:  # direction 1 follows direction 2
            slope = slope + tangent[2, 2, 1, 1]
        step = np.clip(-residual / (slope * np.exp(logs)), -_LONGEST_STEP, _LONGEST_STEP)
        logs = logs + step
        if np.all(np.abs(step) <= _CONVERGED):
            break
    else:
        lost = pulled[~(np.abs(step) <= _CONVERGED)].flat[0]
        raise MechanicsError(
            f"the {mode} response stops at a stretch of {lost:.4g}: no transverse stretch leaves "
            f"the free direction of {material!r} without stress; expected a stable material, so "
            "stay nearer to a stretch of 1, or check the coefficients for stability"
        )
    free = np.exp(logs)
    stretches = principal_stretches(mode, pulled, free)
    nominal = material.first_piola(diagonal(stretches))[0, 0]
    return Response(mode, pulled, nominal, free, stretches.prod(axis=0))


def incompressible_free_stretch(mode: Mode, stretch: Array) -> Array:
    """Stretch of the free direction that keeps the volume, of the shape of `stretch`."""
    power = {Mode.UNIAXIAL: -0.5, Mode.EQUIBIAXIAL: -2.0, Mode.PLANAR: -1.0}[mode]
    free: Array = stretch**power
    return free


def principal_stretches(mode: Mode, pulled: Array, free: Array) -> Array:
    """The three stretches, (3, ...), of a test with the pulled and free directions' stretches."""
    second = {
        Mode.UNIAXIAL: free,
        Mode.EQUIBIAXIAL: pulled,
        Mode.PLANAR: np.ones_like(pulled),
    }[mode]
    return np.stack((pulled, second, free))


def diagonal(stretches: Array) -> Array:
    """F = diag(stretches), (3, 3, ...), of principal stretches (3, ...)."""
    f = np.zeros((3, *stretches.shape))
    for a in range(3):
        f[a, a] = stretches[a]
    return f


def _checked(stretch: Array) -> Array:
    pulled = np.asarray(stretch, dtype=float)
    if not np.all(np.isfinite(pulled) & (pulled > 0)):
        wrong = pulled[~(np.isfinite(pulled) & (pulled > 0))].flat[0]
        raise MechanicsError(
            f"a stretch of {wrong:g} cannot be: expected lengths over their lengths at rest, above "
            "0; 1 is no deformation, and an engineering strain of 20 % is a stretch of 1.2"
        )
    return pulled
