"""A finite element model: solids, loads and supports put together to one system of equations."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from rig.mechanics.fe.coordinates import Cartesian, Coordinates, Placement, blend
from rig.mechanics.fe.discretisation import Discretisation, Integers
from rig.mechanics.fe.errors import FiniteElementError
from rig.mechanics.fe.pattern import Pattern
from rig.mechanics.fe.pressure import PressureSurface
from rig.mechanics.fe.rigid import RigidBody
from rig.mechanics.fe.rotation import rotation_matrix, rotation_vector
from rig.mechanics.fe.solid import Evaluation, Solid
from rig.mechanics.fe.state import Pose, State

Array = NDArray[np.float64]


class Item(Protocol):
    """Anything else that acts on fixed degrees of freedom, such as contact with an obstacle."""

    dofs: Integers
    """Degrees of freedom it acts on, (parts, dofs), the same for the life of the model."""

    symmetric: bool
    """Whether its derivative is."""

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Residual (parts, dofs), minus the force on the model, and its derivative by x."""
        ...


class Interface(Protocol):
    """What acts on fixed degrees of freedom and remembers its path, such as friction."""

    dofs: Integers
    """As an item's."""

    symmetric: bool
    """Whether its derivative is."""

    def virgin(self, size: int, /) -> Array:
        """The memory at rest, in a model of `size` degrees of freedom."""
        ...

    def evaluate(self, x: Array, memory: Array, /) -> tuple[Array, Array]:
        """Residual and derivative as an item's, with the memory of the last accepted step."""
        ...

    def settled(self, x: Array, memory: Array, /) -> Array:
        """The memory after a step to `x` is accepted."""
        ...


@dataclass(frozen=True)
class Support:
    """Degrees of freedom with prescribed displacements `motion * values` in m."""

    dofs: Integers
    values: Array

    @staticmethod
    def of(
        discretisation: Discretisation, nodes: Integers, components: Sequence[int], value: float = 0
    ) -> Support:
        """Some displacement components of nodes held, or moved by `value` m at motion 1."""
        dofs = (discretisation.dim * nodes[:, None] + np.asarray(components)).reshape(-1)
        return Support(dofs, np.full(len(dofs), float(value)))


@dataclass(frozen=True)
class Assembly:
    """The system of equations at one state; vectors are over all degrees of freedom."""

    residual: Array
    """Internal less external forces in N (continuous pressures: volumes in m3)."""
    data: Array | None
    """Tangent as data of the model's pattern; None where only the residual was asked for."""
    pressure_slope: Array
    """Derivative of the residual by the cavity's pressure in m2."""
    volume: float
    """Volume of the cavity in m3."""
    volume_slope: Array
    """Derivative of that volume by the displacements in m2."""
    volume_error: float
    """Largest volume ratio less that of the pressure, weighted with a pressure shape function."""
    scale: float
    """Size of the element forces that balance in the residual, N."""
    evaluations: tuple[Evaluation, ...]

    @property
    def gap(self) -> float:
        """Largest difference between independent strain and strain of the displacements."""
        return max(e.gap for e in self.evaluations)

    @property
    def least_volume_ratio(self) -> float:
        """Smallest det F at a quadrature point; not above zero where an element is inverted."""
        return min(e.least_volume_ratio for e in self.evaluations)


class Model:
    """Solids on one discretisation under the pressure of one cavity, dead loads and supports."""

    def __init__(
        self,
        discretisation: Discretisation,
        solids: Sequence[Solid],
        *,
        supports: Sequence[Support] = (),
        surface: PressureSurface | None = None,
        dead_load: Array | None = None,
        bodies: Sequence[RigidBody] = (),
        items: Sequence[Item] = (),
        interfaces: Sequence[Interface] = (),
        coordinates: Coordinates | None = None,
    ) -> None:
        """`dead_load` in N over all degrees of freedom, as `gravity` and `traction` give it.
        `coordinates` are those that steps go straight in, Cartesian ones unless told.

        Raises FiniteElementError where a degree of freedom is in two rigid bodies, or no material
        is there for some element.
        """
        self.discretisation = discretisation
        self.solids = tuple(solids)
        self.surface = surface
        self.bodies = tuple(bodies)
        self.items = tuple(items)
        self.interfaces = tuple(interfaces)
        self.coordinates: Coordinates = coordinates or Cartesian()
        n = discretisation.size
        self.size = n
        self._pressure_volume = _pressure_volume(discretisation)
        self.dead_load = np.zeros(n) if dead_load is None else np.asarray(dead_load, dtype=float)
        covered = np.sort(np.concatenate([s.elements for s in self.solids]))
        if not np.array_equal(covered, np.arange(len(discretisation.connectivity))):
            raise FiniteElementError(
                f"the solids cover {len(covered)} of {len(discretisation.connectivity)} elements; "
                "each element needs exactly one material."
            )
        tied = np.concatenate([b.dofs for b in self.bodies]) if bodies else _no_dofs()
        if len(np.unique(tied)) != len(tied):
            raise FiniteElementError("two rigid bodies share nodes; make them one body.")
        self._motion = np.zeros(n)
        held = np.zeros(n, dtype=bool)
        for support in supports:
            held[support.dofs] = True
            self._motion[support.dofs] = support.values
        # a body's own freedoms decide about its nodes, whatever support they also touch
        held[tied] = False
        self._motion[tied] = 0.0
        self.held = np.flatnonzero(held)
        self.tied = tied
        """Degrees of freedom that follow a rigid body."""
        free = ~held
        free[tied] = False
        self.free = np.flatnonzero(free)
        blocks = [s.dofs for s in self.solids]
        if surface is not None:
            blocks.append(surface.dofs)
        blocks.extend(item.dofs for item in self.items)
        blocks.extend(interface.dofs for interface in self.interfaces)
        dim = discretisation.dim if discretisation.pressure_nodes == 0 else 1
        self.pattern = Pattern(n, blocks, dim)
        self._free_part = self.pattern.submatrix(self.free)
        self._body_slices = _slices([b.size for b in self.bodies])
        self.body_size = sum(b.size for b in self.bodies)
        self.body_load = (
            np.concatenate([b.load() for b in self.bodies]) if self.bodies else np.zeros(0)
        )

    @property
    def symmetric(self) -> bool:
        """Whether the tangent is symmetric."""
        surface = self.surface
        walls = surface is None or surface.symmetric or not surface.follower
        acting = [i.symmetric for i in self.items] + [i.symmetric for i in self.interfaces]
        return walls and all(acting)

    def start(self) -> State:
        """At rest, without loads."""
        return State(
            x=np.zeros(self.size),
            points=tuple(s.initial() for s in self.solids),
            poses=tuple(Pose() for _ in self.bodies),
            memories=tuple(i.virgin(self.size) for i in self.interfaces),
        )

    def prescribed(self, motion: float) -> Array:
        """Displacements of the `held` degrees of freedom in m."""
        return np.asarray(motion * self._motion[self.held])

    def assemble(self, state: State, tangent: bool = True) -> Assembly:
        """Residual and, if wanted, tangent at a state."""
        x, n = state.x, self.size
        evaluations = tuple(
            s.evaluate(x, p, tangent) for s, p in zip(self.solids, state.points, strict=True)
        )
        residual = -state.dead * self.dead_load
        scale = np.abs(residual)
        blocks = []
        for solid, e in zip(self.solids, evaluations, strict=True):
            flat = solid.dofs.reshape(-1)
            residual += np.bincount(flat, weights=e.residual.reshape(-1), minlength=n)
            scale += np.bincount(flat, weights=np.abs(e.residual).reshape(-1), minlength=n)
            if e.tangent is not None:
                blocks.append(e.tangent)
        pressure_slope, volume_slope, volume = np.zeros(n), np.zeros(n), 0.0
        if self.surface is not None:
            wall = self.surface.evaluate(x)
            flat = self.surface.dofs.reshape(-1)
            pressure_slope += np.bincount(flat, weights=wall.residual.reshape(-1), minlength=n)
            volume_slope += np.bincount(flat, weights=wall.volume_slope.reshape(-1), minlength=n)
            residual += state.pressure * pressure_slope
            volume = wall.volume
            blocks.append(state.pressure * wall.tangent)
        acting = [(item.dofs, item.evaluate(x)) for item in self.items]
        acting += [
            (interface.dofs, interface.evaluate(x, memory))
            for interface, memory in zip(self.interfaces, state.memories, strict=True)
        ]
        for dofs, (force, stiffness) in acting:
            residual += np.bincount(dofs.reshape(-1), weights=force.reshape(-1), minlength=n)
            blocks.append(stiffness)
        n_u = self.discretisation.displacement_size
        errors = [e.volume_error for e in evaluations]
        if n > n_u:
            errors.append(float((np.abs(residual[n_u:]) / self._pressure_volume).max()))
        return Assembly(
            residual=residual,
            data=self.pattern.assemble(blocks) if tangent else None,
            pressure_slope=pressure_slope,
            volume=volume,
            volume_slope=volume_slope,
            volume_error=max(errors),
            scale=float(np.linalg.norm(scale[:n_u])),
            evaluations=evaluations,
        )

    def free_matrix(self, data: Array) -> sparse.csc_array:
        """The tangent of the free degrees of freedom."""
        return self._free_part.take(data)

    def body_directions(self, state: State) -> Array:
        """Derivative of all displacements by the freedoms of the rigid bodies, (n, freedoms)."""
        result = np.zeros((self.size, self.body_size))
        for body, pose, part in zip(self.bodies, state.poses, self._body_slices, strict=True):
            result[body.dofs, part] = body.directions(pose)
        return result

    def body_curvature(self, state: State, residual: Array) -> Array:
        """Stiffness that the forces on rigid bodies give to their rotations, N m."""
        result = np.zeros((self.body_size, self.body_size))
        for body, pose, part in zip(self.bodies, state.poses, self._body_slices, strict=True):
            result[part, part] = body.curvature(pose, residual[body.dofs])
        return result

    def body_scale(self) -> Array:
        """Length in m that makes a body's moments comparable with forces, per freedom."""
        parts = [b.lever() for b in self.bodies]
        return np.concatenate(parts) if parts else np.zeros(0)

    def advanced(
        self, state: State, assembly: Assembly, dx: Array, freedoms: Array, length: float
    ) -> State:
        """The state after `length` times a step: displacements dx, freedoms of rigid bodies."""
        points = tuple(
            s.advance(p, e, state.x, dx, length)
            for s, p, e in zip(self.solids, state.points, assembly.evaluations, strict=True)
        )
        poses = tuple(
            body.moved(pose, length * freedoms[part])
            for body, pose, part in zip(self.bodies, state.poses, self._body_slices, strict=True)
        )
        x, poses = self.coordinates.moved(state, length * dx, poses)
        held = state.x[self.held] + length * dx[self.held]
        return replace(state, x=self._constrained(x, poses, held), points=points, poses=poses)

    def settled(self, state: State) -> State:
        """The state of a step that is accepted; see `Solid.settled` and `Interface.settled`."""
        points = (s.settled(state.x, p) for s, p in zip(self.solids, state.points, strict=True))
        memories = (
            i.settled(state.x, m) for i, m in zip(self.interfaces, state.memories, strict=True)
        )
        return replace(state, points=tuple(points), memories=tuple(memories))

    def blended(self, states: Sequence[State], weights: Array, motion: float) -> Placement:
        """Displacements and poses of a weighted sum of states, supports moved by `motion`.

        Rotations are blended as they differ from that of the last state; the weights sum to one.
        """
        poses = tuple(
            _blended_pose(parts, weights) for parts in zip(*(s.poses for s in states), strict=True)
        )
        x, poses = self.coordinates.blended(states, weights, poses)
        return self._constrained(x, poses, self.prescribed(motion)), poses

    def _constrained(self, x: Array, poses: tuple[Pose, ...], held: Array) -> Array:
        """`x` with supports and the nodes of rigid bodies where they must be."""
        x = x.copy()
        x[self.held] = held
        for body, pose in zip(self.bodies, poses, strict=True):
            x[body.dofs] = body.displacements(pose)
        return x


def _pressure_volume(d: Discretisation) -> Array:
    """Volume in m3 that each continuous pressure stands for."""
    if d.pressure_connectivity is None:
        return np.zeros(0)
    parts = np.einsum("eq,eqm->em", d.weights, d.pressure_values)
    total: Array = np.bincount(
        d.pressure_connectivity.reshape(-1), parts.reshape(-1), minlength=d.pressure_nodes
    ).astype(np.float64)
    return total


def _blended_pose(poses: Sequence[Pose], weights: Array) -> Pose:
    last = poses[-1]
    spin = blend(weights, [rotation_vector(p.rotation @ last.rotation.T) for p in poses])
    shift = blend(weights, [p.shift for p in poses])
    return Pose(shift, rotation_matrix(spin) @ last.rotation, last.angles + spin)


def _no_dofs() -> Integers:
    return np.zeros(0, dtype=np.int64)


def _slices(sizes: Sequence[int]) -> list[slice]:
    ends = np.cumsum([0, *sizes])
    return [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]
