"""Models of a run whose parameters are estimated, with what is known of these before the run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rig.mechanics.beam import BeamTheory, published_free_parameter
from rig.mechanics.bellow import bending_geometry
from rig.mechanics.blocked import blocked_force
from rig.spec.actuator import ActuatorSpec, BellowBendingGeometry
from rig.spec.material import MaterialSpec
from rig.study.errors import StudyError
from rig.study.factors import Array
from rig.study.measured import Measured

REACH = 6.0
"""Prior deviations that estimates may be from their prior."""
_WALLS = 9
"""Walls at which the blocked force is computed; between them it is interpolated."""


@dataclass(frozen=True)
class Priors:
    """Standard deviations of what is known before the run."""

    modulus: float = 0.05
    """Of Young's modulus, relative."""
    wall: float = 0.02
    """Of the wall thickness, relative."""
    free_parameter: float = 0.05
    """Of b, relative to the published formula at the estimated modulus."""
    stiffening: float = 0.2
    """Of s, around zero."""
    offset: float = float(np.radians(5.0))
    """Of the angle at zero pressure, in rad, around zero."""
    creep: float = 0.03
    """Of the share of the response that was still to come when levels were read, around zero:
    creep, and hysteresis of the branch that has more levels. A few seconds after the pressure
    elastomers lack some per cent, which looks like a modulus that is higher by as much."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise StudyError(
                    f"the prior deviation of {name} is {value:g}; expected one above 0."
                )


class Forward(Protocol):
    """A model of angles and forces; unknowns come in prior deviations from the prior, (k,)."""

    @property
    def names(self) -> tuple[str, ...]:
        """Unknowns, in their order."""
        ...

    @property
    def bounds(self) -> Array:
        """Lowest and highest value of each unknown that the model is good for, (k, 2)."""
        ...

    def covered(self, at: Measured) -> Measured:
        """The levels at pressures that the model has answers for."""
        ...

    def parameters(self, unit: Array) -> dict[str, float]:
        """Physical values of the unknowns, and of what follows from them, SI."""
        ...

    def answers(self, unit: Array, at: Measured) -> tuple[Array, Array]:
        """Angles in rad and forces in N at the levels of `at`."""
        ...

    def error(self, at: Measured) -> tuple[Array, Array]:
        """Standard deviations of the model's own error at those levels, as far as it is known."""
        ...


@dataclass(frozen=True)
class BeamForward:
    """Beam theory with an offset and softening.

        angle = offset + T / (1 + s T / 90 deg),    force = F / (1 + s F / F_limit),

    with T and F those of beam theory for modulus, wall and b. Beam theory alone is a straight line
    through zero; real bellows start off it by their weight and soften as they unfold.
    """

    geometry: BellowBendingGeometry
    prior_modulus: float
    """In Pa."""
    top_pressure: float
    """Limit of the actuator, in Pa."""
    priors: Priors
    force_slope: Callable[[float], float]
    """Wall in m to blocked force per pascal in N."""

    @classmethod
    def of(
        cls, actuator: ActuatorSpec, material: MaterialSpec, priors: Priors | None = None
    ) -> BeamForward:
        """Raises MechanicsError for another family than the bending bellow's."""
        from scipy.interpolate import PchipInterpolator

        priors = priors or Priors()
        geometry = bending_geometry(actuator, "Model updating")
        thickest = 0.999 * geometry.arc_radius / geometry.wall_thickness - 1
        reach = min(REACH * priors.wall, 0.9, thickest)
        walls = geometry.wall_thickness * np.linspace(1 - reach, 1 + reach, _WALLS)
        slopes = [
            float(blocked_force(geometry.model_copy(update={"wall_thickness": w}), 1.0))
            for w in walls.tolist()
        ]
        curve = PchipInterpolator(walls, slopes)
        return cls(
            geometry,
            material.young_modulus.value,
            actuator.limits.pressure,
            priors,
            lambda wall: float(curve(wall)),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Unknowns; the run tells angles' E b although it tells neither E nor b."""
        return ("modulus", "wall", "free_parameter", "stiffening", "offset")

    @property
    def bounds(self) -> Array:
        """Far from anything likely."""
        return np.tile([-REACH, REACH], (len(self.names), 1))

    def covered(self, at: Measured) -> Measured:
        """All."""
        return at

    def error(self, at: Measured) -> tuple[Array, Array]:
        """None is known; where the model misses the levels, their uncertainties are widened."""
        return np.zeros_like(at.angle), np.zeros_like(at.force)

    def parameters(self, unit: Array) -> dict[str, float]:
        """Physical values, SI."""
        modulus = self.prior_modulus * (1 + self.priors.modulus * unit[0])
        free = published_free_parameter(self.geometry, modulus) * (
            1 + self.priors.free_parameter * unit[2]
        )
        return {
            "modulus": modulus,
            "wall": self.geometry.wall_thickness * (1 + self.priors.wall * unit[1]),
            "free_parameter": free,
            "stiffening": self.priors.stiffening * unit[3],
            "offset": self.priors.offset * unit[4],
            "effective_modulus": modulus * free,
        }

    def answers(self, unit: Array, at: Measured) -> tuple[Array, Array]:
        """Angles in rad and forces in N at the levels of `at`."""
        p = self.parameters(unit)
        printed = self.geometry.model_copy(update={"wall_thickness": p["wall"]})
        linear = BeamTheory(printed, p["modulus"], p["free_parameter"]).angle(at.angle_pressure)
        slope = self.force_slope(p["wall"])
        force = slope * at.force_pressure
        limit = slope * self.top_pressure
        return (
            p["offset"] + linear / (1 + p["stiffening"] * linear / (np.pi / 2)),
            force / (1 + p["stiffening"] * force / limit),
        )
