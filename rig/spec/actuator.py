"""Actuator specs: a geometry family with its parameters, a material, limits and predictions.

A family is one model in the `Geometry` union, told apart by its `family` key; what the family
means mechanically lives in `rig.mechanics`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, Name, SpecModel, require
from rig.spec.chambers import (
    BellowRectangularGeometry,
    MultiChamberBendingGeometry,
    MultiChamberLinearGeometry,
)
from rig.spec.geometry import ActuatorGeometry
from rig.spec.measurand import MEASURANDS, Measurand
from rig.spec.quantity import Length, Pressure, Ratio
from rig.spec.shells import ShellReinforcedBendingGeometry, ShellReinforcedLinearGeometry

ModelName = Literal["beam", "fe"]


class BellowBendingGeometry(ActuatorGeometry):
    """Bending bellow of Yao, He and Maiolino, Table I; lengths in metres.

    Radii are those of the inner surface (the cavity); the wall lies outside.
    """

    deformation = "bending"
    family: Literal["bellow-bending"] = Field(description="which geometry this is")
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

    @property
    def cavity_radius(self) -> float:
        """Largest radius ro of the cavity in metres."""
        return (2 - self.radius_ratio) * self.average_radius

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


class BellowAxisymmetricGeometry(ActuatorGeometry):
    """Axisymmetric bellow of Auysakul et al. (Actuators 12 (2023) 300), Table 1; in metres.

    It stands on its open base and lengthens. The wall is N equal arcs that bulge outwards; the
    inner contour is the outer one moved inwards by t, measured along the radius.
    """

    deformation = "elongation"
    family: Literal["bellow-axisymmetric"] = Field(description="which geometry this is")
    wall_thickness: Length = Field(0.003, gt=0, description="A: t, along the radius")
    bellow_number: Count = Field(6, le=1000, description="B: N, layers of bellows")
    divided_ratio: Ratio = Field(
        2.0, le=1000, description="C: d = h / r, pitch over rise of an arc; 2 is a half circle"
    )
    top_diameter: Length = Field(0.040, gt=0, description="D1, of the top and of the base")
    height: Length = Field(0.035, gt=0, description="H1, of the whole actuator")
    base_height: Length = Field(0.005, gt=0, description="H2, of the fixed base")

    @property
    def pitch(self) -> float:
        """Height h of one layer in metres (eq. 11)."""
        return (self.height - self.base_height - self.wall_thickness) / self.bellow_number

    @property
    def rise(self) -> float:
        """How far an arc bulges in metres, the paper's radian r (eq. 12)."""
        return self.pitch / self.divided_ratio

    @property
    def cavity_radius(self) -> float:
        """Largest radius of the cavity in metres."""
        return self.top_diameter / 2 - self.wall_thickness + self.rise

    @model_validator(mode="after")
    def _describes_a_solid(self) -> BellowAxisymmetricGeometry:
        t, radius = self.wall_thickness * 1e3, self.top_diameter * 1e3 / 2
        room = (self.height - self.base_height) * 1e3
        problems = []
        if self.divided_ratio < 2 * (1 - 1e-12):
            problems.append(
                f"the arcs run into each other: with d = {self.divided_ratio:.4g} they are more "
                f"than half circles; d must be at least 2 (eq. 12); increase divided_ratio"
            )
        if t >= radius * (1 - 1e-12):
            problems.append(
                f"the wall leaves no cavity: t = {t:.3g} mm must be below D1/2 = {radius:.3g} mm; "
                f"reduce wall_thickness or increase top_diameter"
            )
        if t >= room * (1 - 1e-12):
            problems.append(
                f"the layers have no height: t = {t:.3g} mm, which the top takes, must be below "
                f"H1 - H2 = {room:.3g} mm (eq. 11); reduce wall_thickness or base_height, or "
                f"increase height"
            )
        require(not problems, "; ".join(problems))
        return self


class BellowJointGeometry(ActuatorGeometry):
    """Joint bellow of Guo et al. (Biocybern. Biomed. Eng. 40 (2020) 1359); in metres.

    V-shaped bellows between two discs, blow-moulded, so that the wall is equally thick. Radii and
    roundings are those of the middle of the wall. The paper's text gives the number of bellows
    alone, its figure 2 the rest: all other values here are ours, see docs/validation/guo2020.md.
    """

    deformation = "elongation"
    family: Literal["bellow-joint"] = Field(description="which geometry this is")
    bellow_number: Count = Field(14, le=1000, description="V-shaped bellows, trough to trough")
    pitch: Length = Field(0.003, gt=0, description="height of one bellow")
    trough_radius: Length = Field(0.003, gt=0, description="smallest radius of the wall's middle")
    crest_radius: Length = Field(0.0057, gt=0, description="largest radius of the wall's middle")
    rounding: Length = Field(0.0004, gt=0, description="radius of arcs at troughs and crests")
    wall_thickness: Length = Field(0.0003, gt=0, description="t, normal to the wall")
    end_thickness: Length = Field(0.001, gt=0, description="of the discs at both ends")

    @property
    def cavity_radius(self) -> float:
        """Largest radius of the cavity in metres."""
        return self.crest_radius - self.wall_thickness / 2

    @model_validator(mode="after")
    def _describes_a_solid(self) -> BellowJointGeometry:
        t, rounding = self.wall_thickness * 1e3, self.rounding * 1e3
        depth = (self.crest_radius - self.trough_radius) * 1e3
        half = self.pitch * 1e3 / 2
        problems = []
        if self.trough_radius <= self.wall_thickness / 2:
            problems.append(
                f"the troughs leave no cavity: t / 2 = {t / 2:.3g} mm must be below trough_radius "
                f"= {self.trough_radius * 1e3:.3g} mm; reduce wall_thickness or increase "
                f"trough_radius"
            )
        if rounding <= t / 2:
            problems.append(
                f"the wall does not fit round the arcs: rounding = {rounding:.3g} mm must be above "
                f"t / 2 = {t / 2:.3g} mm; increase rounding or reduce wall_thickness"
            )
        if depth <= 2 * rounding or half <= 2 * rounding:
            problems.append(
                f"the flanks have no room: twice the rounding, {2 * rounding:.3g} mm, must be "
                f"below crest_radius - trough_radius = {depth:.3g} mm and below half the pitch, "
                f"{half:.3g} mm; reduce rounding"
            )
        require(not problems, "; ".join(problems))
        return self


class BellowGripperGeometry(ActuatorGeometry):
    """Gripper of Auysakul et al. (Actuators 12 (2023) 300), Section 6.2: two axisymmetric bellows
    that face each other press a rigid object from both sides; in metres.

    The paper states neither the distance of bellows and object nor any friction: both are ours.
    """

    deformation = "elongation"
    wall_field = ("finger", "wall_thickness")
    family: Literal["bellow-gripper"] = Field(description="which geometry this is")
    finger: BellowAxisymmetricGeometry = Field(description="either bellow")
    held: Literal["cube", "cylinder", "sphere"] = Field(
        "cube", description="the object; a cylinder stands upright: it is pulled along its axis"
    )
    object_size: Length = Field(0.050, gt=0, description="side or diameter of the object")
    clearance: Length = Field(
        0.003, ge=0, description="from the top of either bellow at rest to the object"
    )
    friction: Ratio = Field(0.13, gt=0, description="Coulomb's coefficient, bellow on object")

    @property
    def wall_thickness(self) -> float:
        """Of either finger in metres."""
        return self.finger.wall_thickness

    @property
    def cavity_radius(self) -> float:
        """Largest radius of a finger's cavity in metres."""
        return self.finger.cavity_radius

    @model_validator(mode="after")
    def _holds_with_its_top(self) -> BellowGripperGeometry:
        size, top = self.object_size * 1e3, self.finger.top_diameter * 1e3
        require(
            self.held != "cube" or self.object_size >= self.finger.top_diameter,
            f"the cube is smaller than the top that presses it: object_size = {size:.3g} mm must "
            f"be at least top_diameter = {top:.3g} mm; its edges are not modelled",
        )
        return self


Geometry = Annotated[
    BellowBendingGeometry
    | BellowAxisymmetricGeometry
    | BellowJointGeometry
    | BellowGripperGeometry
    | BellowRectangularGeometry
    | MultiChamberBendingGeometry
    | MultiChamberLinearGeometry
    | ShellReinforcedBendingGeometry
    | ShellReinforcedLinearGeometry,
    Field(discriminator="family"),
]


class ActuatorLimits(SpecModel):
    """What the actuator must never be asked for."""

    pressure: Pressure = Field(gt=0, description="highest gauge pressure")


class PartTolerances(SpecModel):
    """How well the printed part is known; relative standard uncertainties.

    They tell an error of a model from one of its inputs.
    """

    young_modulus: Ratio = Field(
        ge=0, description="relative standard deviation of Young's modulus between parts"
    )
    wall_thickness: Ratio = Field(
        ge=0, description="relative standard deviation of the wall thickness between parts"
    )


class ActuatorSpec(SpecModel):
    """One actuator: what it is, what it is made of, how far it may go, what to predict."""

    kind: Literal["actuator"] = Field(description="tells that this is a file of this kind")
    name: Name
    description: str = Field("", description="one line for people: what it is and what it is for")
    geometry: Geometry = Field(description="family and dimensions")
    material: str = Field(description="name of a file in models/materials, or a path")
    limits: ActuatorLimits = Field(description="what the actuator bears")
    tolerances: PartTolerances | None = Field(
        None, description="how well the printed part is known; without it, as drawn"
    )
    predictions: tuple[ModelName, ...] = Field(
        ("beam",), description="models that a run is compared with"
    )

    @property
    def measurand(self) -> Measurand:
        """What the camera measures of it."""
        return MEASURANDS[self.geometry.deformation]
