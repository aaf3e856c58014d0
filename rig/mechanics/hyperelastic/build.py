"""From a material's spec to the energy that computes."""

from __future__ import annotations

from rig.mechanics.hyperelastic.arruda_boyce import ArrudaBoyce
from rig.mechanics.hyperelastic.elastic import LinearElastic, SaintVenantKirchhoff
from rig.mechanics.hyperelastic.material import Hyperelastic, neo_hookean_from
from rig.mechanics.hyperelastic.moduli import bulk_modulus_beside, shear_modulus_at_rest
from rig.mechanics.hyperelastic.ogden import Ogden, OgdenTerm
from rig.mechanics.hyperelastic.polynomial import MooneyRivlin, NeoHookean, Yeoh
from rig.mechanics.hyperelastic.protocol import Energy, Volumetric
from rig.mechanics.hyperelastic.volumetric import LogarithmicVolume, QuadraticVolume, abaqus_volume
from rig.spec.hyperelastic import (
    AbaqusVolume,
    ArrudaBoyceEnergy,
    BulkModulusVolume,
    ElasticEnergy,
    MooneyRivlinEnergy,
    NeoHookeanEnergy,
    OgdenEnergy,
    YeohEnergy,
)
from rig.spec.material import MaterialSpec


def hyperelastic_from(material: MaterialSpec) -> Hyperelastic:
    """The energies that the spec describes.

    Without a `hyperelastic` section: neo-Hookean from Young's modulus and Poisson's ratio. With
    one but without its `volume`: U = K/2 (J - 1)^2, K from the energy's own shear modulus at rest
    and the material's Poisson's ratio. Plastic flow is none of their business.
    """
    young, poisson = material.young_modulus.value, material.poisson_ratio.value
    section = material.hyperelastic
    if section is None:
        return neo_hookean_from(young, poisson)
    if isinstance(section, ElasticEnergy):
        law = LinearElastic if section.energy == "linear" else SaintVenantKirchhoff
        return Hyperelastic(law(young, poisson), None)
    distortion = _distortion(section)
    if section.volume is not None:
        return Hyperelastic(distortion, _volume(section.volume))
    bulk_modulus = bulk_modulus_beside(shear_modulus_at_rest(distortion), poisson)
    return Hyperelastic(distortion, QuadraticVolume(bulk_modulus))


def _distortion(
    section: NeoHookeanEnergy | MooneyRivlinEnergy | YeohEnergy | OgdenEnergy | ArrudaBoyceEnergy,
) -> Energy:
    match section:
        case NeoHookeanEnergy():
            return NeoHookean(section.shear_modulus)
        case MooneyRivlinEnergy():
            return MooneyRivlin(section.c10, section.c01, section.c11, section.c20, section.c02)
        case YeohEnergy():
            return Yeoh(section.c10, section.c20, section.c30)
        case OgdenEnergy(convention="classic"):
            return Ogden.classic((term.mu, term.alpha) for term in section.terms)
        case OgdenEnergy():
            return Ogden(tuple(OgdenTerm(term.mu, term.alpha) for term in section.terms))
        case ArrudaBoyceEnergy():
            return ArrudaBoyce(section.modulus, section.locking_stretch)


def _volume(section: BulkModulusVolume | AbaqusVolume) -> Volumetric:
    if isinstance(section, AbaqusVolume):
        return abaqus_volume(section.d1)
    if section.function == "quadratic":
        return QuadraticVolume(section.bulk_modulus)
    return LogarithmicVolume(section.bulk_modulus)
