"""Exact rigid bodies: nodes of the solid that move as one, with the body's six freedoms or fewer.

x = c + R (X - C), with the reference point moving from C to c. The nodes' freedoms are replaced
by those of the body in every iteration, so there is no stiff material to spoil Newton. Rotations
are incremented by a spin from where the body is, R <- exp(spin) R, and the tangent holds the
second derivative of that motion, which keeps it symmetric and Newton quadratic (Simo, Comput.
Methods Appl. Mech. Eng. 96 (1992) 189).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Discretisation, Integers, node_dofs
from rig.mechanics.fe.errors import FiniteElementError
from rig.mechanics.fe.rotation import rotation_matrix, skew
from rig.mechanics.fe.state import Pose

Array = NDArray[np.float64]

MOTIONS = ("x", "y", "z", "about_x", "about_y", "about_z")


class RigidBody:
    """Nodes tied to a body that may do the motions named in `free`; the others are held."""

    def __init__(
        self,
        discretisation: Discretisation,
        nodes: Integers,
        *,
        free: tuple[str, ...],
        centre: Array,
        weight: Array | None = None,
    ) -> None:
        """`free` is a choice of MOTIONS, `centre` the reference point in m, (3,).

        In two dimensions the plane is x and y (r and z when axisymmetric: only motion "y", along
        the axis, makes sense). `weight` is a dead force on the reference point in N, (3,).
        """
        unknown = sorted(set(free) - set(MOTIONS))
        if unknown:
            raise FiniteElementError(
                f"a rigid body cannot do '{unknown[0]}'; its motions are {', '.join(MOTIONS)}."
            )
        if len(nodes) == 0:
            raise FiniteElementError("a rigid body needs nodes to move; none were given.")
        self.nodes = np.asarray(nodes, dtype=np.int64)
        self.free = tuple(m for m in MOTIONS if m in free)
        self.centre = np.asarray(centre, dtype=float)
        self.weight = np.zeros(3) if weight is None else np.asarray(weight, dtype=float)
        self._dim = discretisation.dim
        self.dofs = node_dofs(self.nodes, self._dim)
        position = np.zeros((len(self.nodes), 3))
        position[:, : self._dim] = discretisation.nodes[self.nodes]
        self._position = position
        self._arms = position - self.centre
        self._free = np.array([MOTIONS.index(m) for m in self.free], dtype=np.int64)

    @property
    def size(self) -> int:
        """Number of freedoms."""
        return len(self._free)

    def displacements(self, pose: Pose) -> Array:
        """Displacements of the body's degrees of freedom in m, in the order of `dofs`."""
        moved = self.centre + pose.shift + self._arms @ pose.rotation.T
        return np.asarray((moved - self._position)[:, : self._dim].reshape(-1))

    def directions(self, pose: Pose) -> Array:
        """Derivative of the displacements by the freedoms, (len(dofs), size)."""
        arms = self._arms @ pose.rotation.T
        motion = np.zeros((len(arms), 3, 6))
        motion[:, :, :3] = np.eye(3)
        motion[:, :, 3:] = np.stack([-skew(a) for a in arms])
        return motion[:, : self._dim, self._free].reshape(-1, self.size)

    def curvature(self, pose: Pose, forces: Array) -> Array:
        """Second derivative of the displacements along `forces` (in the order of dofs), N m."""
        f = np.zeros((len(self.nodes), 3))
        f[:, : self._dim] = forces.reshape(-1, self._dim)
        arms = self._arms @ pose.rotation.T
        cross = f.T @ arms
        full = np.zeros((6, 6))
        full[3:, 3:] = (cross + cross.T) / 2 - np.trace(cross) * np.eye(3)
        return full[np.ix_(self._free, self._free)]

    def moved(self, pose: Pose, increment: Array) -> Pose:
        """The pose after an increment of the freedoms (m and rad)."""
        full = np.zeros(6)
        full[self._free] = increment
        return Pose(
            pose.shift + full[:3],
            rotation_matrix(full[3:]) @ pose.rotation,
            pose.angles + full[3:],
        )

    def lever(self) -> Array:
        """Per freedom the length in m that makes its moment a force; 1 for forces."""
        arm = float(np.linalg.norm(self._arms, axis=1).max()) or 1.0
        return np.where(self._free < 3, 1.0, arm)

    def load(self) -> Array:
        """Work of the weight per freedom, (size,)."""
        full = np.concatenate((self.weight, np.zeros(3)))
        return np.asarray(full[self._free])
