"""Material specs: every number carries its source."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from rig.spec.base import Label, SpecModel, require
from rig.spec.hyperelastic import HyperelasticSpec
from rig.spec.quantity import Density, Duration, Modulus, Ratio, Strength


class SourcedModulus(SpecModel):
    """A modulus in pascals and where it comes from."""

    value: Modulus = Field(gt=0)
    source: str = Field(min_length=3)


class SourcedDensity(SpecModel):
    """A density in kg/m3 and where it comes from."""

    value: Density = Field(gt=0)
    source: str = Field(min_length=3)


class SourcedPoissonRatio(SpecModel):
    """A Poisson's ratio and where it comes from; 0.5 would be incompressible."""

    value: Ratio = Field(gt=-1, lt=0.5)
    source: str = Field(min_length=3)


class StrengthRange(SpecModel):
    """Tensile strength from `low` to `high` in pascals."""

    low: Strength = Field(gt=0)
    high: Strength = Field(gt=0)
    source: str = Field(min_length=3)

    @model_validator(mode="after")
    def _ordered(self) -> StrengthRange:
        require(self.low <= self.high, "expected 'low' at most 'high'")
        return self


class RatioRange(SpecModel):
    """A dimensionless range; elongation 2.2 means 220 %."""

    low: Ratio = Field(gt=0)
    high: Ratio = Field(gt=0)
    source: str = Field(min_length=3)

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

    terms: tuple[RelaxationTerm, ...] = Field(min_length=1)
    source: str = Field(min_length=3)

    @model_validator(mode="after")
    def _something_stays(self) -> RelaxationSpec:
        require(
            sum(term.weight for term in self.terms) < 1,
            "expected the sum of 'weight' below 1: a solid keeps some of its stress",
        )
        return self


class MaterialSpec(SpecModel):
    """An elastomer as the models need it."""

    kind: Literal["material"]
    name: Label
    description: str = ""
    young_modulus: SourcedModulus
    poisson_ratio: SourcedPoissonRatio
    density: SourcedDensity
    tensile_strength: StrengthRange | None = None
    elongation_at_break: RatioRange | None = None
    hyperelastic: HyperelasticSpec | None = Field(
        None,
        description="energy at large strain; without it, neo-Hookean from the two constants",
    )
    relaxation: RelaxationSpec | None = None
