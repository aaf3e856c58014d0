"""A material's energies as the mixed finite elements take them."""

from __future__ import annotations

from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic import (
    Energy,
    Flowing,
    HenckyVolume,
    Volumetric,
    bulk_modulus_from,
    hyperelastic_from,
    shear_modulus_from,
)
from rig.mechanics.plasticity import J2Plasticity
from rig.spec.material import MaterialSpec


def mixed_energies(material: MaterialSpec) -> tuple[Energy | Flowing, Volumetric]:
    """Energy of distortion, or what flows in its place, and of change of volume.

    Raises MechanicsError for a material without a volumetric energy of its own.
    """
    flow = material.plasticity
    if flow is not None:
        constants = material.young_modulus.value, material.poisson_ratio.value
        return (
            J2Plasticity(shear_modulus_from(*constants), flow.yield_stress, flow.hardening_modulus),
            HenckyVolume(bulk_modulus_from(*constants)),
        )
    energies = hyperelastic_from(material)
    if energies.volume is None:
        raise MechanicsError(
            f"material '{material.name}': the mixed finite elements need a volumetric energy of "
            "their own, which 'linear' and 'saint-venant-kirchhoff' do not have. Use another "
            "'hyperelastic' energy, or leave the section out for neo-Hookean."
        )
    return energies.distortion, energies.volume
