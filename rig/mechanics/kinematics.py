"""Kinematic model of a row of uniform bellows that bend to an arc (Yin et al., eqs. 1 to 6).

N bellows of the length x bend about their strain-limiting layer, which keeps its length; their
centre lines, h above it, grow by x_e each. Eq. (6) has the extension grow with the volume v_b that
each bellow takes up, x_e = c v_b; c follows from finite elements or from a measurement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.mechanics.errors import MechanicsError
from rig.mechanics.response import Response
from rig.spec.chambers import BellowRectangularGeometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BellowRow:
    """Uniform bellows; lengths in metres."""

    number: int
    """N."""
    pitch: float
    """x, from one bellow to the next."""
    height: float
    """h, of the centre line over the layer that keeps its length."""

    @classmethod
    def of(cls, geometry: BellowRectangularGeometry) -> BellowRow:
        """Of an actuator whose bellows are all alike; h is half its height.

        Raises MechanicsError for a hybrid.
        """
        if geometry.further_groups:
            raise MechanicsError(
                "the kinematic model is one of uniform bellows (eqs. 1 to 5); for a hybrid use "
                "finite elements: `rig predict --model fe`."
            )
        pitch = geometry.bellow_length + 2 * geometry.face_thickness + geometry.spacer_length
        return cls(geometry.bellow_number, pitch, geometry.bellow_height / 2)

    def angle(self, extension: ArrayLike) -> Array:
        """Bend angle in rad of bellows that are longer by `extension` m each (eq. 4)."""
        return self.number * np.asarray(extension, dtype=float) / self.height

    def extension(self, angle: ArrayLike) -> Array:
        """Extension of each bellow in m at a bend angle in rad: the inverse of `angle`."""
        return self.height * np.asarray(angle, dtype=float) / self.number

    def inner_radius(self, extension: ArrayLike) -> Array:
        """Radius r1 of the layer in m (eq. 5); infinite where nothing bends."""
        with np.errstate(divide="ignore"):
            return self.height * self.pitch / np.asarray(extension, dtype=float)

    def extension_for(self, inner_radius: ArrayLike) -> Array:
        """Extension of each bellow in m for a radius r1 in m: the inverse of `inner_radius`.

        Raises MechanicsError for a radius that is not above zero.
        """
        radius = np.asarray(inner_radius, dtype=float)
        if not np.all(radius > 0):
            raise MechanicsError(
                f"an inner bend radius of {1e3 * float(radius.min()):.3g} mm is impossible; "
                f"expected one above zero."
            )
        return self.height * self.pitch / radius


@dataclass(frozen=True)
class VolumeLaw:
    """Eq. (6): extension per volume, fitted through the origin."""

    slope: float
    """c in m of extension for a m3 of volume, of each bellow alike."""
    r_squared: float
    """1 for a perfectly linear relation."""

    @classmethod
    def fitted(cls, row: BellowRow, response: Response) -> VolumeLaw:
        """From the angle and volume of a model; raises MechanicsError where it has no angle."""
        if response.angle is None:
            raise MechanicsError(f"model '{response.model}' gives no angle: nothing bends.")
        angle, volume = response.angle, response.volume
        reached = np.isfinite(angle) & np.isfinite(volume)
        extension = row.extension(angle[reached] - angle[reached][0])
        taken = (volume[reached] - volume[reached][0]) / row.number
        slope = float(extension @ taken / (taken @ taken))
        rest = extension - slope * taken
        spread = extension - extension.mean()
        return cls(slope, 1 - float(rest @ rest) / float(spread @ spread))

    def extension(self, volume: ArrayLike) -> Array:
        """Extension in m of a bellow that took up `volume` m3 (eq. 6)."""
        return self.slope * np.asarray(volume, dtype=float)

    def volume(self, extension: ArrayLike) -> Array:
        """Volume in m3 that a bellow takes up to extend by so many m: the inverse."""
        return np.asarray(extension, dtype=float) / self.slope


def volume_for_radius(row: BellowRow, law: VolumeLaw, inner_radius: ArrayLike) -> Array:
    """Volume in m3 to push into the whole actuator for an inner bend radius in m."""
    return row.number * law.volume(row.extension_for(inner_radius))


def pressure_for_radius(row: BellowRow, response: Response, inner_radius: ArrayLike) -> Array:
    """Pressure in Pa for an inner bend radius in m, as a model's angle has it.

    Pressure is no linear function of the extension, so that it comes from the response itself.
    Raises MechanicsError where the model does not get there.
    """
    return response.pressure_for("angle", row.angle(row.extension_for(inner_radius)))
