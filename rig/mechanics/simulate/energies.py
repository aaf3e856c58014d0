"""A material's energies as the mixed finite elements take them."""

from __future__ import annotations

from rig.mechanics.errors import MechanicsError
from rig.mechanics.hyperelastic import Energy, Volumetric, hyperelastic_from
from rig.spec.material import MaterialSpec


def mixed_energies(material: MaterialSpec) -> tuple[Energy, Volumetric]:
    """Energy of distortion and of change of volume.

    Raises MechanicsError for a material without a volumetric energy of its own.
    """
    energies = hyperelastic_from(material)
    if energies.volume is None:
        raise MechanicsError(
            f"material '{material.name}': the mixed finite elements need a volumetric energy of "
            "their own, which 'linear' and 'saint-venant-kirchhoff' do not have. Use another "
            "'hyperelastic' energy, or leave the section out for neo-Hookean."
        )
    return energies.distortion, energies.volume
