"""What beam theory says of a design at once: curves over pressure, and the shape at one of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.beam import BeamTheory
from rig.mechanics.bellow import BellowShape
from rig.mechanics.errors import MechanicsError
from rig.mechanics.model import available_models, predict
from rig.mechanics.profile import side_profile
from rig.mechanics.response import Response, SideProfile
from rig.mechanics.table import GRAM_FORCE
from rig.spec.actuator import ActuatorSpec, BellowBendingGeometry
from rig.spec.material import MaterialSpec
from rig.studio.drawing import Box, box_of, profile_shapes

Array = NDArray[np.float64]

CURVE_POINTS = 41
BEAM = "beam"


@dataclass(frozen=True)
class Curve:
    """One model's response in the units people read; arrays (n,), None where there is none."""

    label: str
    pressure_kpa: Array
    angle_deg: Array | None
    force_g: Array | None
    displacement_mm: Array


def curve_of(response: Response, label: str) -> Curve:
    """A response as something to draw."""
    angle, force = response.angle, response.blocked_force
    return Curve(
        label=label,
        pressure_kpa=response.pressure / 1e3,
        angle_deg=None if angle is None else np.degrees(angle),
        force_g=None if force is None else force / GRAM_FORCE,
        displacement_mm=response.displacement * 1e3,
    )


@dataclass(frozen=True)
class Beam:
    """A design for which beam theory answers."""

    actuator: ActuatorSpec
    material: MaterialSpec
    geometry: BellowBendingGeometry
    top_pressure: float
    """Highest pressure in Pa that limit and theory allow."""

    @classmethod
    def of(cls, actuator: ActuatorSpec, material: MaterialSpec) -> Beam | None:
        """None for a family without beam theory; raises MechanicsError where it answers nothing."""
        geometry = actuator.geometry
        if BEAM not in available_models(geometry.family):
            return None
        assert isinstance(geometry, BellowBendingGeometry)
        theory = BeamTheory.of(geometry, material)
        # a hair below the end of the theory: it is where an iteration found it
        top = min(actuator.limits.pressure, theory.limit_pressure * (1 - 1e-9))
        if not top > 0:
            raise MechanicsError("beam theory ends at no pressure at all for this design.")
        return cls(actuator, material, geometry, top)

    def curve(self) -> Curve:
        """Up to the highest pressure."""
        grid = np.linspace(0.0, self.top_pressure, CURVE_POINTS)
        return curve_of(predict(self.actuator, self.material, BEAM, grid), self.actuator.name)

    def bent(self, pressure: float) -> Bent:
        """Shape and figures at a gauge pressure in Pa, taken to the range of the theory."""
        at = float(np.clip(pressure, 0.0, self.top_pressure))
        response = predict(self.actuator, self.material, BEAM, [at])
        assert response.angle is not None
        assert response.blocked_force is not None
        angle = float(response.angle[0])
        return Bent(
            pressure_kpa=at / 1e3,
            angle_deg=float(np.degrees(angle)),
            force_g=float(response.blocked_force[0]) / GRAM_FORCE,
            volume_ml=float(response.volume[0]) * 1e6,
            profile=side_profile(self.geometry, angle),
        )

    @cached_property
    def window(self) -> Box:
        """What the side view fills between rest and the highest pressure."""
        angle = np.radians(self.bent(self.top_pressure).angle_deg)
        return box_of(
            [
                shape
                for part in np.linspace(0.0, angle, 7)
                for shape in profile_shapes(side_profile(self.geometry, float(part)))
            ]
        )

    @property
    def mass_g(self) -> float:
        """Of the soft part."""
        return 1e3 * BellowShape.of(self.geometry).soft_mass(self.material.density.value)


@dataclass(frozen=True)
class Bent:
    """One pressure."""

    pressure_kpa: float
    angle_deg: float
    force_g: float
    volume_ml: float
    profile: SideProfile

    @property
    def words(self) -> str:
        """The figures in a line."""
        return (
            f"{self.pressure_kpa:.2f} kPa: bends by {self.angle_deg:.1f} deg, presses with "
            f"{self.force_g:.1f} g when blocked, holds {self.volume_ml:.2f} mL"
        )
