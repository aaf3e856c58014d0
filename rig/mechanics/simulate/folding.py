"""One of many joint bellows folded flat: its flanks push each other instead of passing through.

In a long row every trough and crest stays in a plane of symmetry, so that half a bellow is enough:
its outer face meets that of the neighbour in the trough's plane, its inner face meets itself in the
crest's, which moves. Either is contact with a rigid plane, without friction; a point seen from the
crest moves by its own displacement less the crest's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import (
    Kinematics,
    Model,
    Options,
    Point,
    Solid,
    Support,
    discretise,
    follow,
)
from rig.mechanics.fe.contact import Contact, Sampling
from rig.mechanics.fe.extremes import summarise
from rig.mechanics.fe.obstacles import Plane
from rig.mechanics.mesh.bellow_joint import JointBellow, JointResolution, half_bellow
from rig.mechanics.mesh.lattice import Block, join
from rig.mechanics.plasticity import plastic_strain
from rig.mechanics.simulate.energies import mixed_energies
from rig.spec.actuator import BellowJointGeometry
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]

_PENALTY = 30.0
"""Of Young's modulus over the wall's thickness: at 10 MPa flanks sink in by a thousandth of it."""
_TOLERANCE = 1e-7
_OPTIONS = Options(least_step=1 / 256)


@dataclass(frozen=True)
class Fold:
    """A row of bellows pressed together, one bellow of it at k heights, the first at rest."""

    shortening: Array
    """Of one bellow in m, (k,)."""
    force: Array
    """That presses the row in N, (k,)."""
    pushed: Array
    """Force between flanks in N, outer and inner faces, (k, 2)."""
    von_mises: Array
    """Largest von Mises stress in Pa, (k,)."""
    plastic: Array
    """Largest equivalent plastic strain, (k,)."""


def fold(
    geometry: BellowJointGeometry,
    material: MaterialSpec,
    shortenings: Array,
    *,
    resolution: JointResolution | None = None,
    contact: bool = True,
) -> Fold:
    """Press one bellow of a long row by `shortenings` in m, (k,), ascending from 0.

    Without `contact` flanks pass through each other. Raises MechanicsError where the way cannot be
    finished, telling where it ended.
    """
    shape = JointBellow.of(geometry)
    mesh, named = join([_half(shape, resolution or JointResolution.resolving(shape))])
    d = discretise(mesh.with_boundaries(named, boundaries_only=False), Kinematics.AXISYMMETRIC)
    trough, crest = d.nodes_on("trough"), d.nodes_on("crest")
    outer = Sampling.of_facets(d, d.facets_on("outside"))
    inner = _seen_from(Sampling.of_facets(d, d.facets_on("cavity")), d.dim * crest[0] + 1)
    stiffness = _PENALTY * material.young_modulus.value / shape.wall
    planes = (
        Contact(outer, Plane((0.0, 0.0), (0.0, 1.0)), penalty=stiffness, tolerance=_TOLERANCE),
        Contact(
            inner,
            Plane((0.0, shape.pitch / 2), (0.0, -1.0)),
            penalty=stiffness,
            tolerance=_TOLERANCE,
        ),
    )
    model = Model(
        d,
        [Solid(d, *mixed_energies(material))],
        supports=[Support.of(d, trough, (1,)), Support.of(d, crest, (1,), -0.5)],
        items=planes if contact else (),
    )
    result = follow(model, [Point(0.0, motion=s) for s in shortenings], options=_OPTIONS)
    if result.failure is not None:
        raise MechanicsError(
            f"a bellow cannot be folded by {1e3 * float(shortenings[-1]):.4g} mm: {result.failure}"
        )
    found = result.solutions
    return Fold(
        shortening=np.asarray(shortenings, dtype=np.float64),
        # the crest's supports take what its own plane is pushed with as well
        force=np.array([-s.residual[d.dim * crest + 1].sum() for s in found]),
        pushed=np.array([[abs(p.touch(s.state.x).force[1]) for p in planes] for s in found])
        if contact
        else np.zeros((len(found), 2)),
        von_mises=np.array([summarise(model, s).von_mises.value for s in found]),
        plastic=np.array([_plastic(s.state.points[0].history) for s in found]),
    )


def _half(shape: JointBellow, resolution: JointResolution) -> Block:
    block = half_bellow(shape, resolution)
    return replace(block, names={**block.names, "j-": "trough", "j+": "crest"})


def _seen_from(sampling: Sampling, dof: int) -> Sampling:
    """The same points as seen from a node that moves along z."""
    dofs = np.concatenate([sampling.dofs, np.full((len(sampling.dofs), 1), dof)], axis=1)
    column = np.zeros((*sampling.matrix.shape[:3], 1))
    column[:, :, 1] = -1.0
    matrix = np.concatenate([sampling.matrix, column], axis=3)
    return replace(sampling, dofs=dofs, matrix=matrix)


def _plastic(history: Array | None) -> float:
    return 0.0 if history is None else float(plastic_strain(history).max())
