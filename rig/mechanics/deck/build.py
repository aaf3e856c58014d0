"""From an actuator's spec to what a deck is made from."""

from __future__ import annotations

from rig.mechanics.deck.errors import DeckError
from rig.mechanics.deck.write import DeckModel
from rig.mechanics.simulate.families import FAMILIES
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec


def deck_model(actuator: ActuatorSpec, material: MaterialSpec) -> DeckModel:
    """The model of predictions with its tip free; raises DeckError where it is no solid in space.

    MechanicsError for a material without a volumetric energy.
    """
    family = actuator.geometry.family
    model = FAMILIES[family].model.free(actuator.geometry, material)
    if not isinstance(model, DeckModel):
        raise DeckError(
            f"there is no input deck of the family '{family}' yet: decks are made of solids in "
            "space. Export it as STL or STEP."
        )
    return model
