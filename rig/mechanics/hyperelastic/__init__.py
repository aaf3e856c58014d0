"""Hyperelastic materials: one protocol, closed-form stresses and tangents, responses, stability."""

from rig.mechanics.hyperelastic.arruda_boyce import ArrudaBoyce
from rig.mechanics.hyperelastic.build import hyperelastic_from
from rig.mechanics.hyperelastic.elastic import LinearElastic, SaintVenantKirchhoff
from rig.mechanics.hyperelastic.material import Hyperelastic, neo_hookean_from
from rig.mechanics.hyperelastic.moduli import (
    bulk_modulus_beside,
    bulk_modulus_from,
    shear_modulus_at_rest,
    shear_modulus_from,
)
from rig.mechanics.hyperelastic.ogden import Ogden, OgdenTerm
from rig.mechanics.hyperelastic.polynomial import MooneyRivlin, NeoHookean, Yeoh
from rig.mechanics.hyperelastic.protocol import Array, Energy, Flowing, Volumetric
from rig.mechanics.hyperelastic.responses import (
    Mode,
    Response,
    incompressible_response,
    response,
)
from rig.mechanics.hyperelastic.stability import (
    Stability,
    check_stability,
    logarithmic_stiffness,
    material_stability,
)
from rig.mechanics.hyperelastic.volumetric import (
    HenckyVolume,
    LogarithmicVolume,
    QuadraticVolume,
    abaqus_volume,
)

__all__ = [
    "Array",
    "ArrudaBoyce",
    "Energy",
    "Flowing",
    "HenckyVolume",
    "Hyperelastic",
    "LinearElastic",
    "LogarithmicVolume",
    "Mode",
    "MooneyRivlin",
    "NeoHookean",
    "Ogden",
    "OgdenTerm",
    "QuadraticVolume",
    "Response",
    "SaintVenantKirchhoff",
    "Stability",
    "Volumetric",
    "Yeoh",
    "abaqus_volume",
    "bulk_modulus_beside",
    "bulk_modulus_from",
    "check_stability",
    "hyperelastic_from",
    "incompressible_response",
    "logarithmic_stiffness",
    "material_stability",
    "neo_hookean_from",
    "response",
    "shear_modulus_at_rest",
    "shear_modulus_from",
]
