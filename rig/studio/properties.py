"""A material in the words and units of its file: what its models count with, and where from."""

from __future__ import annotations

from dataclasses import dataclass

from rig.spec.base import SpecModel
from rig.spec.explain import unit_of
from rig.spec.hyperelastic import ElasticEnergy
from rig.spec.material import MaterialSpec, RatioRange, StrengthRange

UNKNOWN = "unknown"


@dataclass(frozen=True)
class Property:
    """One line."""

    what: str
    value: str
    source: str


def properties_of(material: MaterialSpec) -> tuple[Property, ...]:
    """Elasticity, density and strength, then the laws beyond them that the material has."""
    constants = [
        Property(what, _text(part, "value"), part.source)
        for what, part in (
            ("Young's modulus", material.young_modulus),
            ("Poisson's ratio", material.poisson_ratio),
            ("density", material.density),
        )
    ]
    strengths = [
        Property(what, UNKNOWN, "") if part is None else Property(what, _range(part), part.source)
        for what, part in (
            ("tensile strength", material.tensile_strength),
            ("elongation at break", material.elongation_at_break),
        )
    ]
    return (*constants, *strengths, *_laws(material))


def _laws(material: MaterialSpec) -> list[Property]:
    energy, plasticity, relaxation = (
        material.hyperelastic,
        material.plasticity,
        material.relaxation,
    )
    laws = []
    if plasticity is not None:
        flow = f"yields at {_text(plasticity, 'yield_stress')}"
        laws.append(Property("plasticity", flow, plasticity.source))
    elif energy is None:
        laws.append(Property("energy", "neo-hookean, from the two constants", ""))
    elif isinstance(energy, ElasticEnergy):
        laws.append(Property("energy", f"{energy.energy}, from the two constants", ""))
    else:
        laws.append(Property("energy", energy.energy, energy.source))
    if relaxation is not None:
        lost = sum(term.weight for term in relaxation.terms)
        laws.append(Property("relaxation", f"loses {lost:.0%} of its stress", relaxation.source))
    return laws


def _range(part: StrengthRange | RatioRange) -> str:
    if isinstance(part, RatioRange):
        low, high = (f"{100 * share:.4g} %" for share in (part.low, part.high))
    else:
        low, high = _text(part, "low"), _text(part, "high")
    return low if low == high else f"{low} to {high}"


def _text(part: SpecModel, name: str) -> str:
    unit = unit_of(type(part).model_fields[name])
    value = getattr(part, name)
    return f"{value:g}" if unit is None else unit.in_lab_units(value).replace("**3", "³")
