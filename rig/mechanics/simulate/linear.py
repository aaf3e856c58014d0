"""Actuators that lengthen as finite element models: a quarter of them, its cap free or held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rig.mechanics.fe import (
    Discretisation,
    Model,
    PressureSurface,
    RigidBody,
    Solution,
    Support,
    discretise,
)
from rig.mechanics.fe.discretisation import Integers
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


QUARTERS = 4


@dataclass(frozen=True)
class QuarterModel:
    """A quarter of the actuator (y >= 0, z >= 0) as a finite element model."""

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


@dataclass(frozen=True)
class LinearModel(QuarterModel):
    """With its cap free along the axis, and what turns its state into elongation."""

    def measures(self, solution: Solution) -> dict[str, float]:
        """Displacement of the cap and volume; it does not bend."""
        return {
            "displacement": float(solution.state.poses[0].shift[0]),
            "volume": QUARTERS * solution.volume,
        }


@dataclass(frozen=True, kw_only=True)
class HeldLinearModel(QuarterModel):
    """With its cap held where it is at rest."""

    cap: Integers
    """Degrees of freedom of the cap along the axis."""

    def measures(self, solution: Solution) -> dict[str, float]:
        """Force in N with which the cap pushes away from the connector, and volume."""
        return {
            "force": QUARTERS * pushed(solution, self.cap),
            "volume": QUARTERS * solution.volume,
        }


def pushed(solution: Solution, dofs: Integers) -> float:
    """Force in N of the model on what holds these degrees of freedom."""
    return -float(np.sum(solution.residual[dofs]))


def linear_model_on(
    body: LinearBody,
    material: MaterialSpec,
    *,
    layer: Layer | None = None,
    interfaces: MakeInterfaces | None = None,
    held: bool = False,
) -> LinearModel | HeldLinearModel:
    """A model without weight on a mesh that is there already.

    Its cap is free along the axis, or `held` altogether. `layer` and `interfaces` as
    `bending_model_on` takes them. Raises MechanicsError for a material without a volumetric energy.
    """
    d = discretise(body.mesh)
    cap = d.nodes_on("cap")
    free = RigidBody(d, cap, free=("x",), centre=body.shape.cap_centre)
    model = Model(
        d,
        solids_of(d, material, layer),
        supports=[*_supports(d), *([Support.of(d, cap, (0, 1, 2))] if held else [])],
        surface=PressureSurface(d, d.facets_on("cavity")),
        bodies=[] if held else [free],
        interfaces=interfaces(d) if interfaces is not None else (),
    )
    density = material.density.value
    if held:
        return HeldLinearModel(model=model, density=density, cap=d.dim * cap)
    return LinearModel(model, density)


def _supports(d: Discretisation) -> list[Support]:
    return [
        Support.of(d, d.nodes_on("clamped"), (0, 1, 2)),
        Support.of(d, d.nodes_on("symmetry"), (1,)),
        Support.of(d, d.nodes_on("floor"), (2,)),
    ]
