"""Contact of soft surfaces and rigid parts with rigid obstacles, by augmented Lagrangians.

Points y on the surface feel the traction t = max(0, l - e g) along the normal n of the obstacle,
with gap g, multiplier l and penalty e. Newton solves for fixed multipliers; then l <- t, until
nothing sinks in any more: the penalty decides how fast, not where to (Alart & Curnier, Comput.
Methods Appl. Mech. Eng. 92 (1991) 353). Coulomb friction likewise (Simo & Laursen, Comput. Struct.
42 (1992) 97): the trial traction q = P (m - e (y - y0)), with the projection P on the tangent plane
and y0 where the point was at the last reported load, is kept while |q| <= mu t, else cut to mu t.
Tangents are exact: symmetric without friction, unsymmetric with it (then SuperLU or PARDISO's
unsymmetric solver is used).

Surfaces are sampled at two Gauss points a direction (three points on triangles): that integrates a
uniform pressure on flat quadratic facets exactly, and constrains less than there are nodes. Forces
and pressures are per *undeformed* area.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import skfem
from numpy.typing import NDArray

from rig.mechanics.fe.control import Control
from rig.mechanics.fe.discretisation import Discretisation, Integers, Kinematics, node_dofs
from rig.mechanics.fe.linear import LinearSolver
from rig.mechanics.fe.model import Item, Model
from rig.mechanics.fe.newton import Options
from rig.mechanics.fe.obstacles import Obstacle
from rig.mechanics.fe.onset import rounded
from rig.mechanics.fe.path import Point, Result, follow
from rig.mechanics.fe.state import State

Array = NDArray[np.float64]

_ROUNDS = 30
"""Updates of the multipliers before a load counts as failed."""


@dataclass(frozen=True)
class Sampling:
    """Points whose places are linear in the displacements: y = place + matrix x[dofs]."""

    dofs: Integers
    """(parts, k)."""
    matrix: Array
    """(parts, points, dim, k)."""
    place: Array
    """Undeformed, in m, (parts, points, dim)."""
    weights: Array
    """Undeformed area of each point in m2 (1 where the traction is a force), (parts, points)."""

    @staticmethod
    def of_facets(discretisation: Discretisation, facets: Integers) -> Sampling:
        """Gauss points of some facets; in plane strain per metre of depth."""
        d = discretisation
        order = 2 if isinstance(d.mesh, skfem.MeshTet1) else 3
        basis = skfem.FacetBasis(d.mesh, d.element, facets=facets, intorder=order)
        weights = np.array(basis.dx)
        place = np.moveaxis(np.asarray(basis.global_coordinates()), 0, -1)
        if d.kinematics is Kinematics.AXISYMMETRIC:
            weights *= 2 * np.pi * place[..., 0]
        values = np.stack(
            [np.broadcast_to(np.asarray(b[0]), weights.shape) for b in basis.basis], axis=-1
        )
        nodes = basis.element_dofs.T.astype(np.int64)
        own = np.sort(np.argsort(-np.abs(values).max(axis=1), axis=1)[:, : d.facet_nodes], axis=1)
        values = np.take_along_axis(values, own[:, None, :], axis=2)
        nodes = np.take_along_axis(nodes, own, axis=1)
        matrix = np.einsum("fqa,ij->fqiaj", values, np.eye(d.dim))
        return Sampling(
            node_dofs(nodes, d.dim),
            matrix.reshape(*values.shape[:2], d.dim, -1),
            place,
            weights,
        )

    @staticmethod
    def of_nodes(discretisation: Discretisation, nodes: Integers) -> Sampling:
        """Nodes, such as those of a rigid body or of an edge; their multipliers are forces in N."""
        d = discretisation
        matrix = np.broadcast_to(np.eye(d.dim), (len(nodes), 1, d.dim, d.dim))
        return Sampling(
            node_dofs(nodes[:, None], d.dim),
            matrix,
            d.nodes[nodes][:, None],
            np.ones((len(nodes), 1)),
        )

    def places(self, x: Array) -> Array:
        """Where the points are, in m, (parts, points, dim)."""
        moved = np.einsum("fqik,fk->fqi", self.matrix, x[self.dofs])
        return np.asarray(self.place + moved)


class Augmented(Item, Protocol):
    """An item with multipliers, which are updated when Newton has converged."""

    def settle(self, x: Array, /) -> float:
        """How far the constraints are missed, 1 being just tolerable; multipliers are updated
        where that is more."""
        ...

    def accept(self, x: Array, /) -> None:
        """A reported load is reached: what has slid so far, has slid for good."""
        ...


@dataclass(frozen=True)
class Touch:
    """What an obstacle feels."""

    force: Array
    """Force on the model in N (plane strain: N/m; axisymmetric: of the full turn), (dim,)."""
    normal_force: float
    """Sum of the normal forces in N, whatever their directions."""
    area: float
    """Undeformed area in contact in m2; the number of points for samplings of nodes."""
    pressure: float
    """Largest normal traction in Pa of undeformed area (N for nodes)."""
    penetration: float
    """Largest depth below the obstacle's surface in m."""
    slipping: float
    """Share of the area in contact that slides; 1 without friction."""


class Contact:
    """Points of a surface against one obstacle: an `Item` of a model."""

    def __init__(
        self,
        sampling: Sampling,
        obstacle: Obstacle,
        *,
        penalty: float,
        friction: float = 0.0,
        tolerance: float,
        softness: float = 0.0,
    ) -> None:
        """`penalty` in Pa/m (N/m for nodes), about Young's modulus over an element's size.

        `friction` is Coulomb's coefficient. Points may sink in, and sticking ones creep, by
        `tolerance` in m: multipliers are updated until they do not. `softness` in m rounds off the
        onset of contact, for surfaces that touch all over at once.
        """
        self.sampling = sampling
        self.obstacle = obstacle
        self.penalty = penalty
        self.friction = friction
        self.tolerance = tolerance
        self.softness = softness
        self.dofs = sampling.dofs
        self.symmetric = friction == 0.0
        self.touches: list[Touch] = []
        """At every load that `settle` has reached."""
        self._pushed = np.zeros(sampling.weights.size)
        self._dragged = np.zeros((sampling.weights.size, sampling.place.shape[2]))
        self._before = sampling.place.reshape(-1, sampling.place.shape[2])

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Residual and its exact derivative; see `Item`."""
        s = self.sampling
        traction, slope, _ = self._tractions(x)
        weighted = s.weights[..., None] * traction.reshape(s.place.shape)
        residual = -np.einsum("fqik,fqi->fk", s.matrix, weighted)
        slope = s.weights[..., None, None] * slope.reshape(*s.place.shape, -1)
        tangent = -np.einsum("fqik,fqij,fqjl->fkl", s.matrix, slope, s.matrix, optimize=True)
        return residual, tangent

    def settle(self, x: Array, /) -> float:
        """Multipliers become the tractions, unless points miss by less than the tolerance."""
        places = self._places(x)
        gap, normal, _ = self.obstacle.distance(places)
        traction, _, sticks = self._tractions(x)
        pushed = np.einsum("ni,ni->n", traction, normal)
        touching = pushed > 0
        # of those that do not touch any more, none may have been pulled below the surface
        worst = float(np.abs(gap[touching | (gap < 0)]).max(initial=0.0))
        if self.friction:
            slid = places - self._before
            slid = slid - np.einsum("ni,ni->n", slid, normal)[:, None] * normal
            creep = np.linalg.norm(slid[sticks & touching], axis=1)
            worst = max(worst, float(creep.max(initial=0.0)))
        if worst > self.tolerance:
            self._pushed = pushed
            self._dragged = traction - pushed[:, None] * normal
        return worst / self.tolerance

    def accept(self, x: Array, /) -> None:
        """Note what the obstacle feels; what slides next, slides from here."""
        self.touches.append(self.touch(x))
        if self.friction:
            places = self._places(x)
            _, normal, _ = self.obstacle.distance(places)
            traction, _, _ = self._tractions(x)
            self._pushed = np.einsum("ni,ni->n", traction, normal)
            self._dragged = traction - self._pushed[:, None] * normal
            self._before = places

    def touch(self, x: Array) -> Touch:
        """Force, area, pressure and penetration at some displacements."""
        weights = self.sampling.weights.reshape(-1)
        gap, normal, _ = self.obstacle.distance(self._places(x))
        traction, _, _ = self._tractions(x)
        pushed = np.einsum("ni,ni->n", traction, normal)
        touching = pushed > 0
        dragged = np.linalg.norm(traction - pushed[:, None] * normal, axis=1)
        area = float(weights[touching].sum())
        # at the limit but for round-off
        slips = float(weights[touching & (dragged >= (1 - 1e-9) * self.friction * pushed)].sum())
        return Touch(
            force=weights @ traction,
            normal_force=float(weights[touching] @ pushed[touching]),
            area=area,
            pressure=float(pushed.max(initial=0.0)),
            penetration=float(np.maximum(-gap, 0.0).max(initial=0.0)),
            slipping=slips / area if area else 0.0,
        )

    def _places(self, x: Array) -> Array:
        return self.sampling.places(x).reshape(self._before.shape)

    def _tractions(self, x: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Tractions on the model (n, dim) in Pa, their derivatives by place; where it sticks."""
        places = self._places(x)
        gap, n, curvature = self.obstacle.distance(places)
        depth, inside = rounded(self._pushed / self.penalty - gap, self.softness)
        pushed, on = self.penalty * depth, inside > 0
        outer = n[:, :, None] * n[:, None, :]
        traction = pushed[:, None] * n
        slope = pushed[:, None, None] * curvature - self.penalty * inside[:, None, None] * outer
        if not self.friction:
            return traction, slope, np.zeros(len(gap), dtype=bool)
        wanted = self._dragged - self.penalty * (places - self._before)
        along = np.einsum("ni,ni->n", wanted, n)
        trial = wanted - along[:, None] * n
        turned = np.einsum("ni,nij->nj", wanted, curvature)
        trial_slope = (
            -self.penalty * (np.eye(places.shape[1]) - outer)
            - along[:, None, None] * curvature
            - n[:, :, None] * turned[:, None, :]
        )
        size = np.linalg.norm(trial, axis=1)
        limit = self.friction * pushed
        sticks = size <= limit
        way = trial / np.where(size > 0, size, 1.0)[:, None]
        share = np.where(sticks, 1.0, limit / np.where(size > 0, size, 1.0))
        across = np.eye(places.shape[1]) - way[:, :, None] * way[:, None, :]
        cut = share[:, None, None] * np.einsum("nij,njk->nik", across, trial_slope)
        cut += (-self.friction * self.penalty * inside)[:, None, None] * (
            way[:, :, None] * n[:, None, :]
        )
        traction = traction + np.where(on, share, 0.0)[:, None] * trial
        tangential = np.where(sticks[:, None, None], trial_slope, cut)
        slope = slope + np.where(on[:, None, None], tangential, 0.0)
        return traction, slope, sticks


def settle(
    model: Model,
    points: Sequence[Point],
    augmented: Sequence[Augmented],
    control: Control | None = None,
    *,
    options: Options | None = None,
    solver: LinearSolver | None = None,
    start: State | None = None,
) -> Result:
    """`follow` with the multipliers of `augmented`, which are items of the model, updated.

    Every reported load is solved until no constraint is missed by more than its tolerance.
    Friction remembers what has slid between reported loads, not between the steps to one.
    """
    reached = Result(solutions=(), history=(), failure=None, seconds=0.0)
    state = start
    for point in points:
        for _ in range(_ROUNDS):
            part = follow(model, [point], control, options=options, solver=solver, start=state)
            reached = replace(
                reached,
                history=reached.history + part.history,
                failure=part.failure,
                seconds=reached.seconds + part.seconds,
                solver=part.solver,
            )
            if part.failure is not None:
                return reached
            found = part.solutions[0]
            state = found.state
            if max((item.settle(state.x) for item in augmented), default=0.0) <= 1.0:
                break
        else:
            return replace(
                reached,
                failure=f"contact or ties did not settle in {_ROUNDS} updates of multipliers at "
                f"{found.pressure / 1e3:.4g} kPa; a larger penalty settles faster.",
            )
        for item in augmented:
            item.accept(state.x)
        reached = replace(reached, solutions=(*reached.solutions, found))
    return reached
