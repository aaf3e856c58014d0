"""The `hyperelastic` section of a material file: read, refused, and turned into an energy."""

from __future__ import annotations

from pathlib import Path

import pytest

from rig.mechanics.hyperelastic import (
    ArrudaBoyce,
    Energy,
    Hyperelastic,
    LinearElastic,
    LogarithmicVolume,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    OgdenTerm,
    QuadraticVolume,
    SaintVenantKirchhoff,
    Volumetric,
    Yeoh,
    hyperelastic_from,
    neo_hookean_from,
)
from rig.spec.errors import SpecError
from rig.spec.loading import parse
from rig.spec.material import MaterialSpec

MATERIAL = """\
kind: material
name: rubber
young_modulus: {value: 450 kPa, source: a tensile test}
poisson_ratio: {value: 0.49, source: a tensile test}
density: {value: 1160, source: a balance}
"""
HEAD = f"{MATERIAL}hyperelastic:\n  source: a fit\n  energy: "
BULK_FACTOR = 2 * 1.49 / (3 * 0.02)


def material(text: str) -> MaterialSpec:
    return parse(text, Path("rubber.yaml"), MaterialSpec).spec


def complaints(text: str) -> str:
    with pytest.raises(SpecError) as caught:
        material(text)
    return "\n".join(str(problem) for problem in caught.value.problems)


def test_a_material_without_the_section_is_neo_hookean_of_its_two_constants() -> None:
    assert hyperelastic_from(material(MATERIAL)) == neo_hookean_from(450e3, 0.49)


@pytest.mark.parametrize(
    ("section", "energy", "shear_modulus"),
    [
        ("neo-hookean\n  shear_modulus: 150 kPa", NeoHookean(150e3), 150e3),
        ("mooney-rivlin\n  c10: 60 kPa\n  c01: 15", MooneyRivlin(60e3, 15e3), 150e3),
        (
            "mooney-rivlin\n  c10: 60\n  c01: 15\n  c11: 4\n  c20: -2\n  c02: 3",
            MooneyRivlin(60e3, 15e3, 4e3, -2e3, 3e3),
            150e3,
        ),
        ("yeoh\n  c10: 0.07 MPa\n  c20: -3\n  c30: 400 Pa", Yeoh(70e3, -3e3, 400.0), 140e3),
        (
            "ogden\n  convention: abaqus\n  terms: [{mu: 120, alpha: 2}, {mu: 30, alpha: -2}]",
            Ogden((OgdenTerm(120e3, 2.0), OgdenTerm(30e3, -2.0))),
            150e3,
        ),
        (
            "ogden\n  convention: classic\n  terms: [{mu: 100, alpha: 1.5}, {mu: -50, alpha: -2}]",
            Ogden((OgdenTerm(75e3, 1.5), OgdenTerm(50e3, -2.0))),
            125e3,
        ),
        (
            "arruda-boyce\n  modulus: 140\n  locking_stretch: 1e3",
            ArrudaBoyce(140e3, 1e3),
            140e3 * (1 + 0.6e-6),
        ),
    ],
)
def test_every_energy_can_be_written(section: str, energy: Energy, shear_modulus: float) -> None:
    built = hyperelastic_from(material(HEAD + section))
    assert built.distortion == energy
    assert isinstance(built.volume, QuadraticVolume)
    assert built.volume.bulk_modulus == pytest.approx(BULK_FACTOR * shear_modulus, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "law"), [("saint-venant-kirchhoff", SaintVenantKirchhoff), ("linear", LinearElastic)]
)
def test_laws_of_the_two_constants_need_no_coefficients(
    name: str, law: type[SaintVenantKirchhoff | LinearElastic]
) -> None:
    text = f"{MATERIAL}hyperelastic: {{energy: {name}}}"
    assert hyperelastic_from(material(text)) == Hyperelastic(law(450e3, 0.49), None)


@pytest.mark.parametrize(
    ("volume", "expected"),
    [
        (
            "{function: quadratic, bulk_modulus: 7.5 MPa, source: data sheet}",
            QuadraticVolume(7.5e6),
        ),
        (
            "{function: logarithmic, bulk_modulus: 7.5 MPa, source: data sheet}",
            LogarithmicVolume(7.5e6),
        ),
        ("{function: abaqus, d1: 0.25 MPa**-1, source: data sheet}", QuadraticVolume(8e6)),
        ("{function: abaqus, d1: 0.25, source: data sheet}", QuadraticVolume(8e6)),
    ],
)
def test_the_volume_may_have_its_own_law(volume: str, expected: Volumetric) -> None:
    text = f"{HEAD}neo-hookean\n  shear_modulus: 150\n  volume: {volume}"
    assert hyperelastic_from(material(text)).volume == expected


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("neo-hooke\n  shear_modulus: 150", "did you mean 'neo-hookean'?"),
        ("neo-hookean", "hyperelastic.shear_modulus"),
        ("neo-hookean\n  shear_modulus: -1", "expected a modulus such as '450 kPa'"),
        ("neo-hookean\n  shear_modulus: 3 mm", "'3 mm' is a length, not a pressure"),
        ("mooney-rivlin\n  c10: 10\n  c01: -10", "half the shear modulus at rest"),
        ("mooney-rivlin\n  c10: 10\n  c01: 1\n  c30: 1", "unknown key 'c30'"),
        ("ogden\n  terms: [{mu: 1, alpha: 2}]", "hyperelastic.convention"),
        ("ogden\n  convention: abaqus\n  terms: []", "hyperelastic.terms"),
        ("ogden\n  convention: abaqus\n  terms: [{mu: 1, alpha: 0}]", "'alpha' other than 0"),
        ("ogden\n  convention: abaqus\n  terms: [{mu: -1, alpha: -2}]", "the sum of 'mu' above 0"),
        ("ogden\n  convention: classic\n  terms: [{mu: 1, alpha: -2}]", "'mu' times 'alpha'"),
        ("arruda-boyce\n  modulus: 140\n  locking_stretch: 1", "above 1"),
        (
            "neo-hookean\n  shear_modulus: 1\n  volume: {function: abaqus, d1: 3 MPa, source: me?}",
            "'3 MPa' is a pressure, not a compressibility",
        ),
        (
            "neo-hookean\n  shear_modulus: 150\n  volume: {function: cubic, source: me?}",
            "one of 'quadratic', 'logarithmic', 'abaqus'",
        ),
    ],
)
def test_mistakes_are_named_with_their_place(section: str, words: str) -> None:
    complaint = complaints(HEAD + section)
    assert words in complaint
    assert "rubber.yaml:" in complaint


def test_coefficients_without_a_source_are_refused() -> None:
    text = f"{MATERIAL}hyperelastic: {{energy: neo-hookean, shear_modulus: 150}}"
    assert "hyperelastic.source" in complaints(text)


def test_what_is_written_back_reads_the_same() -> None:
    spec = material(
        f"{HEAD}ogden\n  convention: abaqus\n  terms: [{{mu: 120, alpha: 2}}]\n"
        "  volume: {function: abaqus, d1: 0.25, source: data sheet}"
    )
    assert MaterialSpec.model_validate_json(spec.model_dump_json()) == spec
