"""Actuator specs: a geometry family with its parameters, a material, limits and predictions.

A family is one model in the `Geometry` union, told apart by its `family` key; what the family
means mechanically lives in `rig.mechanics`.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, Name, SpecModel, require
from rig.spec.quantity import Length, Pressure, Ratio

ModelName = Literal["beam", "fe"]


class BellowBendingGeometry(SpecModel):
    """Bending bellow of Yao, He and Maiolino, Table I; lengths in metres.

    Radii are those of the inner surface (the cavity); the wall lies outside.
    """

    family: Literal["bellow-bending"]
    effective_length: Length = Field(0.066, gt=0, description="L, length of all convolutions")
    bellow_number: Count = Field(6, le=1000, description="N, convolutions from trough to trough")
    average_radius: Length = Field(0.006, gt=0, description="rm = (ri + ro) / 2")
    radius_ratio: Ratio = Field(1 / 3, gt=0, lt=1, description="lambda = ri / rm")
    wall_thickness: Length = Field(0.0015, gt=0, description="t, bellow wall")
    frame_connector_thickness: Length = Field(0.006, gt=0, description="tf, rigid, clamped")

    @property
    def arc_radius(self) -> float:
        """Upper and lower arc radius r1 = r2 = L / (4 N) in metres."""
        return self.effective_length / (4 * self.bellow_number)

    @model_validator(mode="after")
    def _constraints_of_equation_1(self) -> BellowBendingGeometry:
        problems = []
        arc_mm = self.arc_radius * 1e3
        t_mm = self.wall_thickness * 1e3
        if self.wall_thickness >= self.arc_radius * (1 - 1e-12):  # equal but for rounding
            problems.append(
                f"the wall does not fit into the arcs: t = {t_mm:.3g} mm must be below "
                f"L/(4N) = {arc_mm:.3g} mm (eq. 1); reduce wall_thickness below {arc_mm:.3g} mm, "
                f"or bellow_number, or increase effective_length"
            )
        flank_room = (1 - self.radius_ratio) * self.average_radius
        if flank_room < self.arc_radius * (1 - 1e-12):
            problems.append(
                f"the flanks have no room: (1 - lambda) rm = {flank_room * 1e3:.3g} mm must be at "
                f"least L/(4N) = {arc_mm:.3g} mm (eq. 1); increase average_radius or "
                f"bellow_number, or reduce radius_ratio or effective_length"
            )
        require(not problems, "; ".join(problems))
        return self


# One member until the next family lands; then `Annotated[A | B, Field(discriminator="family")]`.
Geometry = BellowBendingGeometry


class ActuatorLimits(SpecModel):
    """What the actuator must never be asked for."""

    pressure: Pressure = Field(gt=0, description="highest gauge pressure")


class ActuatorSpec(SpecModel):
    """One actuator: what it is, what it is made of, how far it may go, what to predict."""

    kind: Literal["actuator"]
    name: Name
    description: str = ""
    geometry: Geometry
    material: str = Field(description="name of a file in models/materials, or a path")
    limits: ActuatorLimits
    predictions: tuple[ModelName, ...] = ("beam",)
