"""Rows of chambers as finite element models: those that bend, and those that lengthen."""

from __future__ import annotations

from rig.mechanics.chambers import ChamberRow
from rig.mechanics.mesh.chamber_row import RowResolution, mesh_chamber_row
from rig.mechanics.simulate.bending import BendingModel, bending_model_on
from rig.mechanics.simulate.linear import HeldLinearModel, LinearModel, linear_model_on
from rig.mechanics.simulate.solids import Items, Layer
from rig.spec.chambers import (
    BellowRectangularGeometry,
    MultiChamberBendingGeometry,
    MultiChamberLinearGeometry,
)
from rig.spec.material import MaterialSpec

LAYER_POISSON_RATIO = 0.45
"""Of the inextensible layer, which the paper does not state: between silicone and fibre."""


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
    layer = Layer.elastic(body.layer, geometry.layer_modulus, LAYER_POISSON_RATIO)
    return bending_model_on(body, material, layer=layer, items=items, arc=arc)


def multi_chamber_linear_model(
    geometry: MultiChamberLinearGeometry,
    material: MaterialSpec,
    *,
    resolution: RowResolution,
    held: bool = False,
) -> LinearModel | HeldLinearModel:
    """A cast block of chambers that lengthens, without weight.

    Its cap is free along the axis, or `held`.
    """
    body = mesh_chamber_row(ChamberRow.of(geometry), resolution, quarter=True)
    return linear_model_on(body, material, held=held)
