"""Material specs: every number carries its source."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from rig.spec.base import Label, SpecModel, require
from rig.spec.hyperelastic import HyperelasticSpec
from rig.spec.quantity import Density, Duration, Modulus, Ratio, Strength


class SourcedModulus(SpecModel):
    """A modulus in pascals and where it comes from."""

    value: Modulus = Field(gt=0, description="the modulus")
    source: str = Field(
        min_length=3, description="where the value comes from: data sheet, paper or measurement"
    )


class SourcedDensity(SpecModel):
    """A density in kg/m3 and where it comes from."""

    value: Density = Field(gt=0, description="mass per volume")
    source: str = Field(
        min_length=3, description="where the value comes from: data sheet, paper or measurement"
    )


class SourcedPoissonRatio(SpecModel):
    """A Poisson's ratio and where it comes from; 0.5 would be incompressible."""

    value: Ratio = Field(gt=-1, lt=0.5, description="0.5 is incompressible")
    source: str = Field(
        min_length=3, description="where the value comes from: data sheet, paper or measurement"
    )


class StrengthRange(SpecModel):
    """Tensile strength from `low` to `high` in pascals."""

    low: Strength = Field(gt=0, description="weakest of the data sheet")
    high: Strength = Field(gt=0, description="strongest of the data sheet")
    source: str = Field(
        min_length=3, description="where the value comes from: data sheet, paper or measurement"
    )

    @model_validator(mode="after")
    def _ordered(self) -> StrengthRange:
        require(self.low <= self.high, "expected 'low' at most 'high'")
        return self


class RatioRange(SpecModel):
    """A dimensionless range; elongation 2.2 means 220 %."""

    low: Ratio = Field(gt=0, description="smallest of the data sheet")
    high: Ratio = Field(gt=0, description="largest of the data sheet")
    source: str = Field(
        min_length=3, description="where the value comes from: data sheet, paper or measurement"
    )

    @model_validator(mode="after")
    def _ordered(self) -> RatioRange:
        require(self.low <= self.high, "expected 'low' at most 'high'")
        return self


class RelaxationTerm(SpecModel):
    """One term of a Prony series: a share of the instant stress that is lost, and how fast."""

    weight: Ratio = Field(ge=0, lt=1, description="g")
    time: Duration = Field(gt=0, description="tau")


class RelaxationSpec(SpecModel):
    """Stress under a strain that is held: s0 (1 - sum of g (1 - exp(-t / tau))).

    Part of the material's record; the quasi-static models do not use it.
    """

    terms: tuple[RelaxationTerm, ...] = Field(min_length=1, description="of the Prony series")
    source: str = Field(
        min_length=3, description="where the value comes from: data sheet, paper or measurement"
    )

    @model_validator(mode="after")
    def _something_stays(self) -> RelaxationSpec:
        require(
            sum(term.weight for term in self.terms) < 1,
            "expected the sum of 'weight' below 1: a solid keeps some of its stress",
        )
        return self


class PlasticitySpec(SpecModel):
    """Flow after von Mises at a yield stress that grows with the equivalent plastic strain.

    Elastic strains are logarithmic then, of Young's modulus and Poisson's ratio alone.
    """

    yield_stress: Strength = Field(gt=0, description="s0, true stress")
    hardening_modulus: Modulus = Field(
        0.0, ge=0, description="H, of true stress over plastic strain; 0 is perfectly plastic"
    )
    source: str = Field(
        min_length=3, description="where the value comes from: data sheet, paper or measurement"
    )


class MaterialSpec(SpecModel):
    """An elastomer or a soft thermoplastic as the models need it."""

    kind: Literal["material"] = Field(description="tells that this is a file of this kind")
    name: Label
    description: str = Field("", description="one line for people: what it is and what it is for")
    young_modulus: SourcedModulus = Field(description="at small strain")
    poisson_ratio: SourcedPoissonRatio = Field(description="at small strain")
    density: SourcedDensity = Field(description="of the printed part")
    tensile_strength: StrengthRange | None = Field(
        None, description="engineering stress at break; none if unknown"
    )
    elongation_at_break: RatioRange | None = Field(
        None, description="engineering strain at break; none if unknown"
    )
    hyperelastic: HyperelasticSpec | None = Field(
        None,
        description="energy at large strain; without it, neo-Hookean from the two constants",
    )
    plasticity: PlasticitySpec | None = Field(
        None, description="what stays of a large strain; without it, nothing does"
    )
    relaxation: RelaxationSpec | None = Field(
        None, description="of the stress under constant strain; none if unknown"
    )

    @model_validator(mode="after")
    def _one_elasticity(self) -> MaterialSpec:
        require(
            self.plasticity is None or self.hyperelastic is None,
            "expected 'hyperelastic' or 'plasticity', not both: what flows has the elastic strains "
            "of its two constants; remove one of the sections",
        )
        return self
