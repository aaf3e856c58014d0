"""Actuators that lengthen as finite element models: a quarter of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from rig.mechanics.fe import Model, PressureSurface, RigidBody, Solution, Support, discretise
from rig.mechanics.mesh.curved import CurvedHex
from rig.mechanics.simulate.shape import Array
from rig.mechanics.simulate.solids import Layer, MakeInterfaces, solids_of
from rig.spec.material import MaterialSpec


class LinearShape(Protocol):
    """What the model needs to know of the shape."""

    @property
    def cap_centre(self) -> Array:
        """Centre of mass of the cap, (3,)."""
        ...


class LinearBody(Protocol):
    """A quarter of the soft body, y >= 0 and z >= 0, meshed."""

    @property
    def mesh(self) -> CurvedHex:
        """With the boundaries `clamped`, `cap`, `symmetry`, `floor` and `cavity`."""
        ...

    @property
    def shape(self) -> LinearShape:
        """Its dimensions."""
        ...


@dataclass(frozen=True)
class LinearModel:
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


def linear_model_on(
    body: LinearBody,
    material: MaterialSpec,
    *,
    layer: Layer | None = None,
    interfaces: MakeInterfaces | None = None,
) -> LinearModel:
    """A model without weight on a mesh that is there already, its cap free along the axis.

    `layer` and `interfaces` as `bending_model_on` takes them. Raises MechanicsError for a material
    without a volumetric energy.
    """
    d = discretise(body.mesh)
    model = Model(
        d,
        solids_of(d, material, layer),
        supports=[
            Support.of(d, d.nodes_on("clamped"), (0, 1, 2)),
            Support.of(d, d.nodes_on("symmetry"), (1,)),
            Support.of(d, d.nodes_on("floor"), (2,)),
        ],
        surface=PressureSurface(d, d.facets_on("cavity")),
        bodies=[RigidBody(d, d.nodes_on("cap"), free=("x",), centre=body.shape.cap_centre)],
        interfaces=interfaces(d) if interfaces is not None else (),
    )
    return LinearModel(model, material.density.value)
