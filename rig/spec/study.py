"""Study files: which fields of an actuator and its material vary, by which design, and what is
computed at every point.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, Integer, Name, Number, SpecModel, require
from rig.spec.explain import one_of
from rig.spec.quantity import Pressure

QuantityName = Literal[
    "angle",
    "displacement",
    "blocked_force",
    "volume",
    "max_von_mises",
    "angle_range",
    "inner_radius",
    "tip_travel",
    "max_strain",
    "safety_factor",
    "outer_diameter",
    "groove_width",
]
_IN_UNITS = "deg, mm, g, mL, kPa, %, or a plain factor"
_MEASURED = ("angle", "blocked_force")
_OF_SHAPES = ("outer_diameter", "groove_width")
_OF_STRESS = ("max_von_mises", "max_strain", "safety_factor")


class StudyFactor(SpecModel):
    """A numeric field of the actuator, or of its material, and its two levels."""

    name: Name
    field: str = Field(
        pattern=r"^(actuator|material)(\.[a-z0-9_]+)+$",
        description="as actuator.geometry.wall_thickness or material.hyperelastic.terms.0.mu",
    )
    low: Number | str = Field(description="in the unit of the field, as '3 mm'")
    high: Number | str = Field(description="in the unit of the field, as '6 mm'")


class BoxBehnkenDesign(SpecModel):
    """Midpoints of the cube's edges, and its centre; three factors or more."""

    kind: Literal["box-behnken"] = Field(description="which design this is")
    centre_points: Count = Field(3, description="runs in the middle")


class CentralCompositeDesign(SpecModel):
    """Corners, centre, and points on the axes: beyond the levels, or within them."""

    kind: Literal["central-composite"] = Field(description="which design this is")
    face: Literal["circumscribed", "inscribed", "faced"] = Field(
        "faced", description="where the star points are"
    )
    centre_points: Count = Field(4, description="runs in the middle")


class FullFactorialDesign(SpecModel):
    """All combinations of evenly spaced levels."""

    kind: Literal["full-factorial"] = Field(description="which design this is")
    levels: Integer = Field(2, ge=2, le=9, description="of each factor")


class FractionalFactorialDesign(SpecModel):
    """A fraction of the two-level factorial, told by generators such as 'a b c abc'."""

    kind: Literal["fractional-factorial"] = Field(description="which design this is")
    generators: str = Field(
        pattern=r"^[+-]?[a-z]+( [+-]?[a-z]+)*$", description="words of the design, as `a b c ab`"
    )
    centre_points: Integer = Field(0, ge=0, description="runs in the middle")


class SpaceFillingDesign(SpecModel):
    """Points of a Latin hypercube or a Sobol sequence (scrambled), between the levels."""

    kind: Literal["latin-hypercube", "sobol"] = Field(description="which design this is")
    points: Count = Field(description="how many")
    seed: Integer = Field(0, ge=0, description="of the draws")


Design = Annotated[
    BoxBehnkenDesign
    | CentralCompositeDesign
    | FullFactorialDesign
    | FractionalFactorialDesign
    | SpaceFillingDesign,
    Field(discriminator="kind"),
]


class StudyResponse(SpecModel):
    """One number of every point: a quantity of a model, of a recorded run, or of the shape."""

    name: Name
    quantity: QuantityName = Field(description="what is asked of the models")
    model: Literal["beam", "fe", "run", "shape"] = Field(
        description="run: of the run folder that is called as the point; shape: at rest"
    )
    pressure: Pressure = Field(0.0, ge=0, description="not of shapes")
    goal: Literal["maximise", "minimise"] | None = Field(
        None, description="what is better; none if it is only looked at"
    )
    at_least: Number | None = Field(None, description=_IN_UNITS)
    at_most: Number | None = Field(None, description=_IN_UNITS)

    @property
    def is_limited(self) -> bool:
        """Whether it must stay within limits."""
        return self.at_least is not None or self.at_most is not None

    @model_validator(mode="after")
    def _can_be_answered(self) -> StudyResponse:
        if self.at_least is not None and self.at_most is not None:
            require(self.at_least < self.at_most, "expected 'at_least' below 'at_most'")
        if self.model == "run":
            require(self.quantity in _MEASURED, f"a run measures {one_of(_MEASURED)}")
        require(
            (self.model == "shape") == (self.quantity in _OF_SHAPES),
            f"the model 'shape' tells {one_of(_OF_SHAPES)}, and no other does",
        )
        require(
            self.model == "fe" or self.quantity not in _OF_STRESS,
            f"'{self.quantity}' is told by the model 'fe' only",
        )
        require(
            self.model == "shape" or "pressure" in self.model_fields_set,
            "expected 'pressure', as 5 kPa",
        )
        return self


def require_distinct(factors: Sequence[StudyFactor], responses: Sequence[StudyResponse]) -> None:
    """For validators: refuse two factors of one name or field, and two responses of one name."""
    for what, of_one_kind in (("factors", factors), ("responses", responses)):
        names = {one.name for one in of_one_kind}
        require(len(names) == len(of_one_kind), f"expected {what} of different names")
    fields = {factor.field for factor in factors}
    require(len(fields) == len(factors), "expected factors of different fields")


class StudySpec(SpecModel):
    """A designed experiment."""

    kind: Literal["study"] = Field(description="tells that this is a file of this kind")
    name: Name
    description: str = Field("", description="one line for people: what it is and what it is for")
    actuator: str = Field(description="name of a file in models/actuators, or a path")
    runs: str | None = Field(
        None, description="folder of the recorded runs, of responses of the model 'run'"
    )
    factors: tuple[StudyFactor, ...] = Field(
        min_length=1, description="what is varied, and between which bounds"
    )
    design: Design = Field(description="which combinations are computed")
    check_points: Integer = Field(
        0,
        ge=0,
        description="points between the levels, of a Latin hypercube, that surfaces are not "
        "fitted to but judged by",
    )
    responses: tuple[StudyResponse, ...] = Field(min_length=1, description="what is asked of each")

    @model_validator(mode="after")
    def _consistent(self) -> StudySpec:
        require_distinct(self.factors, self.responses)
        if self.design.kind == "box-behnken":
            require(len(self.factors) >= 3, "a Box-Behnken design needs three factors or more")
        if self.design.kind == "central-composite":
            require(len(self.factors) >= 2, "a central composite design needs two factors or more")
        if self.design.kind == "fractional-factorial":
            words = len(self.design.generators.split())
            require(
                words == len(self.factors),
                f"'generators' has {words} words; expected one for each of the "
                f"{len(self.factors)} factors",
            )
        require(
            self.runs is not None or all(one.model != "run" for one in self.responses),
            "expected 'runs', the folder of the recorded runs",
        )
        require(
            sum(one.goal is not None for one in self.responses) <= 1,
            "expected at most one response with a 'goal'; give the others limits",
        )
        return self
