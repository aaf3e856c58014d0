"""The joint bellow as a finite element model: its whole meridian, standing on its lower disc.

As in the paper (Guo et al., Biocybern. Biomed. Eng. 40 (2020) 1359): without weight or inertia. It
leaves the body free under pressure; here the lower disc's outer face is clamped, which adds a fixed
frame and, on a disc, no stress that reaches the bellows. Flanks that touch are told, not resisted.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from rig.mechanics.fe import (
    Discretisation,
    Kinematics,
    Model,
    PressureSurface,
    Solid,
    Solution,
    Support,
    discretise,
)
from rig.mechanics.mesh.bellow_joint import JointBellow, JointResolution, mesh_joint_bellow
from rig.mechanics.simulate.energies import mixed_energies
from rig.mechanics.simulate.flanks import Flanks
from rig.mechanics.simulate.linear import pushed
from rig.mechanics.simulate.meridian import MeridianModel, supports_of
from rig.spec.actuator import BellowJointGeometry
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class JointModel(MeridianModel):
    """The whole bellow, with what turns its state into elongation and points of interest."""

    shape: JointBellow

    @cached_property
    def top(self) -> int:
        """Node at the rim of the upper disc's outer face, which the bellows move."""
        d = self.model.discretisation
        nodes = d.nodes_on("top")
        return int(nodes[np.argmax(d.nodes[nodes, 0])])

    @cached_property
    def flanks(self) -> Flanks:
        """What watches the folds of outside and cavity."""
        shape = self.shape
        return Flanks(self.model.discretisation, between=shape.pitch - shape.wall, wall=shape.wall)

    def measures(self, solution: Solution) -> dict[str, float]:
        """Displacement (rise of the upper disc) and volume; the gap between flanks in m."""
        d = self.model.discretisation
        return {
            "displacement": float(solution.state.x[d.dim * self.top + 1]),
            "volume": solution.volume,
            "flank_gap": self.flanks.gap(solution.state),
        }


@dataclass(frozen=True)
class HeldJointModel(JointModel):
    """The whole bellow between two fixed discs."""

    def measures(self, solution: Solution) -> dict[str, float]:
        """Force in N with which the upper disc pushes upwards; volume; the gap between flanks."""
        d = self.model.discretisation
        measured = super().measures(solution)
        del measured["displacement"]
        return {"force": pushed(solution, d.dim * d.nodes_on("top") + 1), **measured}


def held_joint_model(
    geometry: BellowJointGeometry,
    material: MaterialSpec,
    *,
    resolution: JointResolution | None = None,
) -> HeldJointModel:
    """The model with its upper disc held where it is at rest; arguments as in `joint_model`."""
    held = joint_model(geometry, material, resolution=resolution, moved=0.0)
    return HeldJointModel(held.model, held.soft, held.density, held.shape)


def joint_model(
    geometry: BellowJointGeometry,
    material: MaterialSpec,
    *,
    resolution: JointResolution | None = None,
    moved: float | None = None,
) -> JointModel:
    """Mesh the meridian and put its model together.

    `moved` takes hold of the upper disc's outer face: it rises by so many metres times the factor
    `motion` of a loading, instead of where pressure brings it. Raises MechanicsError for a
    material without a volumetric energy.
    """
    shape = JointBellow.of(geometry)
    body = mesh_joint_bellow(shape, resolution)
    d = discretise(body.mesh, Kinematics.AXISYMMETRIC)
    soft = Solid(d, *mixed_energies(material))
    supports = supports_of(d)
    if moved is not None:
        supports.append(Support.of(d, d.nodes_on("top"), (1,), moved))
    model = Model(
        d,
        [soft],
        supports=supports,
        # the volume is the same from anywhere: the cavity is closed
        surface=PressureSurface(d, d.facets_on("cavity")),
    )
    return JointModel(model, soft, material.density.value, shape)


def nodes_at(discretisation: Discretisation, places: Array) -> Integers:
    """The node at each of some places (..., dim) in m, which must be nodes; of their shape."""
    _, found = cKDTree(discretisation.nodes).query(places.reshape(-1, places.shape[-1]))
    return np.asarray(found, dtype=np.int64).reshape(places.shape[:-1])
