"""What actuators' models are put together from: solids of one or two materials, and what acts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe import Discretisation, Solid
from rig.mechanics.fe.model import Interface, Item
from rig.mechanics.hyperelastic import Energy, Volumetric, neo_hookean_from
from rig.mechanics.simulate.energies import mixed_energies
from rig.mechanics.simulate.shape import BendingShape
from rig.spec.material import MaterialSpec

Items = Callable[[Discretisation, BendingShape], Sequence[Item]]
"""What acts on an actuator that bends, beside its own solids: stops, obstacles."""
MakeInterfaces = Callable[[Discretisation], Sequence[Interface]]
"""What joins parts of a mesh and remembers its path."""


@dataclass(frozen=True)
class Layer:
    """Elements of another material."""

    elements: NDArray[np.int64]
    distortion: Energy
    volume: Volumetric

    @classmethod
    def elastic(
        cls, elements: NDArray[np.int64], young_modulus: float, poisson_ratio: float
    ) -> Layer:
        """Neo-Hookean, of a stiff material whose strains stay small; the modulus in Pa."""
        energies = neo_hookean_from(young_modulus, poisson_ratio)
        assert energies.volume is not None
        return cls(elements, energies.distortion, energies.volume)


def solids_of(
    discretisation: Discretisation, material: MaterialSpec, layer: Layer | None
) -> list[Solid]:
    """The elastomer, and the layer if there is one.

    Raises MechanicsError for a material without a volumetric energy.
    """
    d = discretisation
    if layer is None:
        return [Solid(d, *mixed_energies(material))]
    rest = np.setdiff1d(np.arange(len(d.connectivity)), layer.elements)
    return [
        Solid(d, *mixed_energies(material), elements=rest),
        Solid(d, layer.distortion, layer.volume, elements=layer.elements),
    ]
