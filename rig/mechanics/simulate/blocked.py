"""Blocked force of an actuator that bends by finite elements: a rigid stop under the hanging tip.

The stop is the toolbox's (Yao, He and Maiolino): a rigid, frictionless plane facing up, where the
far lower edge of the *undeformed* end cap just touches it, so that the actuator is held straight
and its tip may slide and turn. Gravity acts on the hanging actuator: its weight hangs above the
stiff floor and bends it on to the stop before any pressure does.

Only the cap's far lower edge touches: the blocked actuator bows away from the stop, and its cap
turns with the bending, which lifts the soft underside behind the edge. `clearance` among the
measures tells by how much.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe import Discretisation, Model, Options, Solution
from rig.mechanics.simulate.bending import BendingModel
from rig.mechanics.simulate.shape import BendingShape
from rig.mechanics.simulate.solids import Items
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]

STOP_STIFFNESS = 1e6
"""N/m of half the stop: it yields 0.2 um to 32 g."""
BLOCKED_OPTIONS = Options(
    correction=2e-5, iterations=7, first_step=0.35, least_step=1 / 2, alternate=False
)
"""Steps of a whole rung take 2 to 4 iterations until a crease is near; where half of one fails,
smaller ones only come closer to it, and plain iterations no further."""


@dataclass(frozen=True)
class BlockedBendingModel:
    """Half of the actuator with its tip over the stop."""

    bending: BendingModel
    stop: TipStop

    @property
    def model(self) -> Model:
        """The model, stop included."""
        return self.bending.model

    @property
    def mirror(self) -> int:
        """The half is mirrored across y = 0."""
        return self.bending.mirror

    def measures(self, solution: Solution) -> dict[str, float]:
        """Force of the whole actuator on the stop in N, the hanging weight's included; what the
        cap turns in rad while its edge rests there; volume of the cavity in m3; the gap between
        flanks in m; and the least height of the soft underside over the stop's disc in m: where it
        is not positive, the force of an edge alone is too small."""
        state = solution.state
        return {
            "force": 2 * self.stop.force(state.x),
            "angle": self.bending.angle(state),
            "volume": self.bending.volume(solution),
            "flank_gap": self.bending.flanks.gap(state),
            "clearance": _clearance(self.bending, state.x),
        }


class BuildBending(Protocol):
    """What puts the model of a geometry and a material together, as `bending_model` does."""

    def __call__(
        self,
        geometry: Any,
        material: MaterialSpec,
        /,
        *,
        items: Items,
        arc: bool,
    ) -> BendingModel:
        """The model with `items`, whose steps follow the cap's rotation if `arc` says so."""
        ...


@dataclass(frozen=True)
class Blocked:
    """Puts the stop under the tip of what `build` makes; arguments and errors are the same."""

    build: BuildBending

    def __call__(self, geometry: Any, material: MaterialSpec, /) -> BlockedBendingModel:
        """The model with its stop."""
        stops: list[TipStop] = []

        def stop(discretisation: Discretisation, shape: BendingShape) -> tuple[TipStop]:
            stops.append(TipStop(discretisation, shape))
            return (stops[0],)

        return BlockedBendingModel(self.build(geometry, material, items=stop, arc=False), stops[0])


class TipStop:
    """Frictionless stop under the far lower edge of the rigid cap, half of it.

    It holds both ways: whether the tip leaves it is told by the sign of the force, which weight
    and pressure keep positive. One that lets go during the iterations makes them chatter: they
    then take six times as many, or fail.

    The edge lies beyond the soft body's nodes. A body that moves in the plane of symmetry carries
    it along: with nodes a and b on one vertical line of the cap, b above a by h, and the edge t
    beyond a, it sinks by w_a - t (u_b - u_a) / h, exactly and at any angle.
    """

    def __init__(
        self,
        discretisation: Discretisation,
        shape: BendingShape,
        stiffness: float = STOP_STIFFNESS,
    ) -> None:
        """Under the cap's undeformed edge; `stiffness` in N/m replaces rigidity."""
        d = discretisation
        cap = d.nodes_on("cap")
        middle = cap[np.abs(d.nodes[cap, 1]) < 1e-9]
        low = middle[np.argmin(d.nodes[middle, 2])]
        above = middle[np.abs(d.nodes[middle, 0] - d.nodes[low, 0]) < 1e-9]
        high = above[np.argmax(d.nodes[above, 2])]
        lever = (shape.tip - d.nodes[low, 0]) / (d.nodes[high, 2] - d.nodes[low, 2])
        self.symmetric = True
        self.dofs = np.array([[3 * low, 3 * low + 2, 3 * high]])
        self._weights = np.array([lever, 1.0, -lever])
        self._stiffness = stiffness

    def gap(self, x: Array) -> float:
        """Height of the edge over the plane in m."""
        return float(self._weights @ x[self.dofs[0]])

    def force(self, x: Array) -> float:
        """Force on half the tip in N, upwards; a negative one would have to hold the tip down."""
        return -self._stiffness * self.gap(x)

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Residual (1, 3) and its derivative (1, 3, 3)."""
        w = self._weights
        return -self.force(x) * w[None], self._stiffness * np.outer(w, w)[None]


def _clearance(bending: BendingModel, x: Array) -> float:
    d, shape = bending.model.discretisation, bending.shape
    below = d.nodes_at(z=shape.underside)
    here = d.nodes[below] + x[3 * below[:, None] + np.arange(3)]
    away = np.hypot(here[:, 0] - shape.tip, here[:, 1])
    on_disc = here[away < 2 * shape.half_width]
    return float(np.min(on_disc[:, 2], initial=np.inf) - shape.underside)
