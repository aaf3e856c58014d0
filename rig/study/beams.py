"""Beam theory of many bending bellows at once: `rig.mechanics.beam` with arrays for parameters.

The same closed form (Yao, He and Maiolino, eqs (2) to (9)), for studies that ask a hundred thousand
times; tests hold it against `BeamTheory` to round-off.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rig.mechanics.beam import lever_integrals
from rig.mechanics.convolution import QUARTER, UNFOLDED
from rig.spec.actuator import ActuatorSpec, BellowBendingGeometry
from rig.spec.material import MaterialSpec
from rig.study.errors import StudyError
from rig.study.factors import Array
from rig.study.fields import NumericField

_GEOMETRY = (
    "effective_length",
    "bellow_number",
    "average_radius",
    "radius_ratio",
    "wall_thickness",
)


@dataclass(frozen=True)
class ManyBeams:
    """n bellows; arrays (n,), SI."""

    effective_length: Array
    bellow_number: Array
    average_radius: Array
    radius_ratio: Array
    wall_thickness: Array
    young_modulus: Array

    @classmethod
    def of(
        cls,
        actuator: ActuatorSpec,
        material: MaterialSpec,
        fields: Mapping[str, NumericField],
        values: Mapping[str, Array],
    ) -> ManyBeams:
        """The actuator with arrays in place of some of its fields, by factor.

        Raises StudyError for another family, and for fields that beam theory does not know.
        """
        geometry = actuator.geometry
        if not isinstance(geometry, BellowBendingGeometry):
            raise StudyError(f"beam theory is not for the family '{geometry.family}'.")
        count = next(iter(values.values())).size
        parts = {name: np.full(count, float(getattr(geometry, name))) for name in _GEOMETRY}
        parts["young_modulus"] = np.full(count, material.young_modulus.value)
        known = {f"actuator.geometry.{name}": name for name in _GEOMETRY}
        known["material.young_modulus.value"] = "young_modulus"
        for factor, array in values.items():
            where = str(fields[factor])
            if where not in known:
                raise StudyError(
                    f"factor '{factor}': the angle of beam theory does not depend on {where}; "
                    f"expected one of {', '.join(known)}."
                )
            parts[known[where]] = np.rint(array) if fields[factor].whole else array
        return cls(**parts)

    def angle(self, pressure: float) -> Array:
        """Bending angle in rad at a pressure in Pa, (n,).

        Not a number where eq. (1) forbids the shape, and where the bellow would be unfolded or
        bent by more than a half turn.
        """
        inner = self.radius_ratio * self.average_radius
        outer = 2 * self.average_radius - inner
        arc = self.effective_length / (4 * self.bellow_number)
        flank = outer - inner - 2 * arc
        crest, trough = arc + self.wall_thickness / 2, arc - self.wall_thickness / 2
        sound = (flank > -1e-12) & (self.wall_thickness < arc)
        flank = np.maximum(flank, 0.0)
        j0, j1, j2, j3 = vars(lever_integrals(crest, flank, trough)).values()  # type: ignore[arg-type]
        load = (crest + flank + trough + inner) / 2
        rigidity = self.young_modulus * self.wall_thickness**3 / 12
        unit = (load * (j2 - j1**2 / j0) - (j3 - j1 * j2 / j0) / 2) / rigidity
        free = (
            1.6082e4 * self.radius_ratio**0.3 / (self.bellow_number**0.9 * self.young_modulus**0.6)
        )
        growth = pressure * unit / (2 * free)  # of a half convolution
        angle = 2 * self.bellow_number * growth / (2 * outer + 2 * self.wall_thickness)
        unfolded = (crest + trough) * (QUARTER * np.sin(UNFOLDED) / UNFOLDED - 1) + flank * (
            np.cos(UNFOLDED)
        )
        slack = 1 + 1e-12
        sound &= (growth <= unfolded * slack) & (angle <= np.pi * slack)
        return np.where(sound, angle, np.nan)
