"""Rows of chambers as finite element models: those that bend, and those that lengthen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from rig.mechanics.chambers import ChamberRow
from rig.mechanics.fe import (
    Discretisation,
    Model,
    PressureSurface,
    RigidBody,
    Solid,
    Solution,
    Support,
    discretise,
)
from rig.mechanics.fe.model import Item
from rig.mechanics.hyperelastic import (
    NeoHookean,
    QuadraticVolume,
    bulk_modulus_from,
    shear_modulus_from,
)
from rig.mechanics.mesh.chamber_row import RowResolution, mesh_chamber_row
from rig.mechanics.simulate.bending import BendingModel, Layer, bending_model_on
from rig.mechanics.simulate.energies import mixed_energies
from rig.mechanics.simulate.shape import BendingShape
from rig.spec.chambers import (
    BellowRectangularGeometry,
    MultiChamberBendingGeometry,
    MultiChamberLinearGeometry,
)
from rig.spec.material import MaterialSpec

LAYER_POISSON_RATIO = 0.45
"""Of the inextensible layer, which the paper does not state: between silicone and fibre."""

Items = Callable[[Discretisation, BendingShape], Sequence[Item]]


def rectangular_bellow_model(
    geometry: BellowRectangularGeometry,
    material: MaterialSpec,
    *,
    resolution: RowResolution,
    items: Items | None = None,
    arc: bool = True,
) -> BendingModel:
    """Rectangular bellows on their strain-limiting layer, without weight: they work in water.

    `items` and `arc` as in `bending_model`. Raises MechanicsError for a material without a
    volumetric energy.
    """
    body = mesh_chamber_row(ChamberRow.of(geometry), resolution)
    return bending_model_on(body, material, acceleration=(0.0, 0.0, 0.0), items=items, arc=arc)


def multi_chamber_bending_model(
    geometry: MultiChamberBendingGeometry,
    material: MaterialSpec,
    *,
    resolution: RowResolution,
    items: Items | None = None,
    arc: bool = True,
) -> BendingModel:
    """A cast block of chambers on its inextensible layer, hanging; arguments as above."""
    body = mesh_chamber_row(ChamberRow.of(geometry), resolution)
    constants = geometry.layer_modulus, LAYER_POISSON_RATIO
    layer = Layer(
        body.layer,
        NeoHookean(shear_modulus_from(*constants)),
        QuadraticVolume(bulk_modulus_from(*constants)),
    )
    return bending_model_on(body, material, layer=layer, items=items, arc=arc)


@dataclass(frozen=True)
class LinearChamberModel:
    """A quarter of the actuator (y >= 0, z >= 0), with what turns its state into elongation."""

    model: Model
    density: float
    """Of the soft material in kg/m3."""
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """No weight."""
    mirror: int = 1
    """One of the planes of symmetry is y = 0."""

    @property
    def planes(self) -> Mapping[str, int]:
        """Boundaries on planes of symmetry, to the component of displacement that they hold."""
        return {"symmetry": 1, "floor": 2}

    def measures(self, solution: Solution) -> dict[str, float]:
        """Displacement of the cap and volume; it does not bend."""
        return {
            "displacement": float(solution.state.poses[0].shift[0]),
            "volume": 4 * solution.volume,
        }


def multi_chamber_linear_model(
    geometry: MultiChamberLinearGeometry, material: MaterialSpec, *, resolution: RowResolution
) -> LinearChamberModel:
    """A cast block of chambers that lengthens, without weight, its cap free along the axis."""
    shape = ChamberRow.of(geometry)
    body = mesh_chamber_row(shape, resolution, quarter=True)
    d = discretise(body.mesh)
    model = Model(
        d,
        [Solid(d, *mixed_energies(material))],
        supports=[
            Support.of(d, d.nodes_on("clamped"), (0, 1, 2)),
            Support.of(d, d.nodes_on("symmetry"), (1,)),
            Support.of(d, d.nodes_on("floor"), (2,)),
        ],
        surface=PressureSurface(d, d.facets_on("cavity")),
        bodies=[RigidBody(d, d.nodes_on("cap"), free=("x",), centre=shape.cap_centre)],
    )
    return LinearChamberModel(model, material.density.value)
