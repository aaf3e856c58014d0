"""The `hyperelastic` section of a material: which energy, its coefficients, and their source.

One fit yields all coefficients of a set, so a set has one source. What the energies mean lives in
`rig.mechanics.hyperelastic`, a page on each in docs/theory/hyperelastic.md.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rig.spec.base import SpecModel, require
from rig.spec.quantity import Compressibility, Modulus, Ratio


class BulkModulusVolume(SpecModel):
    """U(J) from a bulk modulus K: K/2 (J-1)^2, or K/4 (J^2 - 1 - 2 ln J)."""

    function: Literal["quadratic", "logarithmic"] = Field(
        description="which function of the volume this is"
    )
    bulk_modulus: Modulus = Field(gt=0, description="K")
    source: str = Field(
        min_length=3, description="where the value comes from: data sheet, paper or measurement"
    )


class AbaqusVolume(SpecModel):
    """U(J) = (J-1)^2 / D1, as Abaqus writes it; the bulk modulus is 2 / D1."""

    function: Literal["abaqus"] = Field(description="which function of the volume this is")
    d1: Compressibility = Field(gt=0, description="D1")
    source: str = Field(
        min_length=3, description="where the value comes from: data sheet, paper or measurement"
    )


Volume = Annotated[BulkModulusVolume | AbaqusVolume, Field(discriminator="function")]


class _FittedEnergy(SpecModel):
    """What all energies of distortion share."""

    source: str = Field(min_length=3, description="where the coefficients come from")
    volume: Volume | None = Field(
        None, description="cost of a change of volume; without it, from the Poisson's ratio"
    )


class NeoHookeanEnergy(_FittedEnergy):
    """W = mu/2 (I1-3)."""

    energy: Literal["neo-hookean"] = Field(description="which energy function this is")
    shear_modulus: Modulus = Field(gt=0, description="mu, at rest")


class MooneyRivlinEnergy(_FittedEnergy):
    """W = sum of c_ij (I1-3)^i (I2-3)^j; two terms, three with c11, five with c20 and c02."""

    energy: Literal["mooney-rivlin"] = Field(description="which energy function this is")
    c10: Modulus = Field(description="factor of (I1 - 3)")
    c01: Modulus = Field(description="factor of (I2 - 3)")
    c11: Modulus = Field(0.0, description="factor of (I1 - 3)(I2 - 3)")
    c20: Modulus = Field(0.0, description="factor of (I1 - 3) squared")
    c02: Modulus = Field(0.0, description="factor of (I2 - 3) squared")

    @model_validator(mode="after")
    def _stiff_at_rest(self) -> MooneyRivlinEnergy:
        require(
            self.c10 + self.c01 > 0,
            "expected 'c10' + 'c01' above 0, half the shear modulus at rest",
        )
        return self


class YeohEnergy(_FittedEnergy):
    """W = c10 (I1-3) + c20 (I1-3)^2 + c30 (I1-3)^3."""

    energy: Literal["yeoh"] = Field(description="which energy function this is")
    c10: Modulus = Field(gt=0, description="half the shear modulus at rest")
    c20: Modulus = Field(0.0, description="factor of (I1 - 3) squared")
    c30: Modulus = Field(0.0, description="factor of (I1 - 3) cubed")


class OgdenTermSpec(SpecModel):
    """One term of Ogden's energy: a modulus and the exponent of the stretches."""

    mu: Modulus = Field(description="modulus of the term")
    alpha: Ratio = Field(description="exponent of the stretches")

    @model_validator(mode="after")
    def _has_exponent(self) -> OgdenTermSpec:
        require(self.alpha != 0, "expected 'alpha' other than 0")
        return self


class OgdenEnergy(_FittedEnergy):
    """Ogden's energy; papers and programs write its moduli in two ways, so say which.

    Convention `abaqus`: W = sum of 2 mu/alpha^2 (...), shear modulus at rest the sum of mu.
    Convention `classic`: W = sum of mu/alpha (...), shear modulus at rest half the sum of
    mu alpha.
    """

    energy: Literal["ogden"] = Field(description="which energy function this is")
    convention: Literal["abaqus", "classic"] = Field(
        description="abaqus: 2 mu/alpha^2; classic (Ogden, COMSOL): mu/alpha"
    )
    terms: tuple[OgdenTermSpec, ...] = Field(
        min_length=1, max_length=3, description="mu and alpha of each"
    )

    @model_validator(mode="after")
    def _stiff_at_rest(self) -> OgdenEnergy:
        if self.convention == "abaqus":
            require(
                sum(term.mu for term in self.terms) > 0,
                "expected the sum of 'mu' above 0, the shear modulus at rest",
            )
        else:
            require(
                sum(term.mu * term.alpha for term in self.terms) > 0,
                "expected the sum of 'mu' times 'alpha' above 0, twice the shear modulus at rest",
            )
        return self


class ArrudaBoyceEnergy(_FittedEnergy):
    """Eight-chain energy, as the usual series of five terms."""

    energy: Literal["arruda-boyce"] = Field(description="which energy function this is")
    modulus: Modulus = Field(gt=0, description="mu; the shear modulus at rest is a little above")
    locking_stretch: Ratio = Field(gt=1, description="lambda_m, at which the chains lock")


class ElasticEnergy(SpecModel):
    """Of the material's Young's modulus and Poisson's ratio alone, volume included."""

    energy: Literal["saint-venant-kirchhoff", "linear"] = Field(
        description="which energy function this is"
    )


HyperelasticSpec = Annotated[
    NeoHookeanEnergy
    | MooneyRivlinEnergy
    | YeohEnergy
    | OgdenEnergy
    | ArrudaBoyceEnergy
    | ElasticEnergy,
    Field(discriminator="energy"),
]
