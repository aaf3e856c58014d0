"""From an actuator's spec to what a deck is made from."""

from __future__ import annotations

from rig.mechanics.deck.errors import DeckError
from rig.mechanics.deck.write import DeckModel
from rig.mechanics.simulate.families import FAMILIES
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec


def deck_model(actuator: ActuatorSpec, material: MaterialSpec) -> DeckModel:
    """The model of predictions with its tip free.

    Raises DeckError where a deck cannot say what it is made of, MechanicsError for a material
    without a volumetric energy.
    """
    family = actuator.geometry.family
    model = FAMILIES[family].model.free(actuator.geometry, material)
    if not isinstance(model, DeckModel):
        raise DeckError(
            f"there is no input deck of the family '{family}': decks cannot say what its model is "
            f"made of. Export it as STL or STEP."
        )
    return model
