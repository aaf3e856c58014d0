"""What a change of volume costs: functions U(J) in common use, equal for small changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig.mechanics.hyperelastic.protocol import Array


@dataclass(frozen=True)
class QuadraticVolume:
    """U = K/2 (J - 1)^2, with the bulk modulus K in Pa."""

    bulk_modulus: float

    def energy(self, volume_ratio: Array, /) -> Array:
        """U in Pa."""
        return self.bulk_modulus / 2 * (volume_ratio - 1) ** 2

    def pressure(self, volume_ratio: Array, /) -> Array:
        """dU/dJ = K (J - 1) in Pa."""
        return self.bulk_modulus * (volume_ratio - 1)

    def stiffness(self, volume_ratio: Array, /) -> Array:
        """d2U/dJ2 = K in Pa."""
        return np.full_like(volume_ratio, self.bulk_modulus)


@dataclass(frozen=True)
class LogarithmicVolume:
    """U = K/4 (J^2 - 1 - 2 ln J), with the bulk modulus K in Pa; infinite as J goes to 0.

    Simo and Taylor, Comput. Methods Appl. Mech. Eng. 85 (1991) 273.
    """

    bulk_modulus: float

    def energy(self, volume_ratio: Array, /) -> Array:
        """U in Pa; infinite where J <= 0."""
        with np.errstate(invalid="ignore", divide="ignore"):
            value = self.bulk_modulus / 4 * (volume_ratio**2 - 1 - 2 * np.log(volume_ratio))
        return np.where(np.real(volume_ratio) > 0, value, np.inf)

    def pressure(self, volume_ratio: Array, /) -> Array:
        """dU/dJ = K/2 (J - 1/J) in Pa; not a number where J <= 0."""
        return self.bulk_modulus / 2 * (volume_ratio - 1 / _positive(volume_ratio))

    def stiffness(self, volume_ratio: Array, /) -> Array:
        """d2U/dJ2 = K/2 (1 + 1/J^2) in Pa; not a number where J <= 0."""
        return self.bulk_modulus / 2 * (1 + 1 / _positive(volume_ratio) ** 2)


@dataclass(frozen=True)
class HenckyVolume:
    """U = K/2 (ln J)^2, with the bulk modulus K in Pa: the mean Kirchhoff stress is K ln J.

    Its pressure is largest at J = e, which no solid here comes near.
    """

    bulk_modulus: float

    def energy(self, volume_ratio: Array, /) -> Array:
        """U in Pa; infinite where J <= 0."""
        with np.errstate(invalid="ignore", divide="ignore"):
            value = self.bulk_modulus / 2 * np.log(volume_ratio) ** 2
        return np.where(np.real(volume_ratio) > 0, value, np.inf)

    def pressure(self, volume_ratio: Array, /) -> Array:
        """dU/dJ = K ln J / J in Pa; not a number where J <= 0."""
        j = _positive(volume_ratio)
        return np.asarray(self.bulk_modulus * np.log(j) / j)

    def stiffness(self, volume_ratio: Array, /) -> Array:
        """d2U/dJ2 = K (1 - ln J) / J^2 in Pa; not a number where J <= 0."""
        j = _positive(volume_ratio)
        return np.asarray(self.bulk_modulus * (1 - np.log(j)) / j**2)


def abaqus_volume(d1: float) -> QuadraticVolume:
    """U = (J - 1)^2 / D1 with D1 in 1/Pa, as Abaqus writes it: the bulk modulus is 2 / D1."""
    return QuadraticVolume(2 / d1)


def _positive(volume_ratio: Array) -> Array:
    return np.where(np.real(volume_ratio) > 0, volume_ratio, np.nan)
