"""Blocked force of the bending bellow by finite elements: a rigid stop under the hanging tip.

The stop is the toolbox's (Yao, He and Maiolino): a rigid, frictionless plane facing up, where the
far lower edge of the *undeformed* end cap just touches it, so that the actuator is held straight
and its tip may slide and turn. Gravity acts on the hanging actuator: its weight hangs above the
stiff floor and bends it on to the stop before any pressure does. That preload is the weight's, not
the actuator's; like the bench, which reads zero at zero pressure, forces are reported less it.

Only the cap's far lower edge touches: the blocked actuator bows away from the stop, and its cap
turns with the bending, which lifts the soft underside behind the edge. `Blocked.clearance` tells.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.bellow import BellowShape
from rig.mechanics.fe import (
    Discretisation,
    Options,
    Point,
    PressureControl,
    Progress,
    Result,
    follow,
)
from rig.mechanics.mesh.bellow_bending import BendingResolution
from rig.mechanics.simulate.bending import HANGING, BendingModel, bending_model
from rig.spec.actuator import BellowBendingGeometry
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]

STOP_STIFFNESS = 1e4
"""N/m of half the stop: it yields 16 um to 32 g, 4e-4 of the way that it holds back."""
BLOCKED_OPTIONS = Options(mixed_points=False)
"""Compression and the stop's constraint suit plain Newton: independent strains diverge here."""


@dataclass(frozen=True)
class Blocked:
    """The blocked actuator at the pressures that were reached, in the order asked for."""

    pressure: Array
    """Gauge pressure in Pa, (n,); shorter than asked for where `failure` says why."""
    force: Array
    """Force of the whole actuator on the stop in N, less `preload`, (n,)."""
    preload: float
    """Force on the stop at zero pressure in N: the hanging weight's."""
    angle: Array
    """What the cap turns while its edge rests on the stop, in rad, (n,)."""
    volume: Array
    """Volume of the whole cavity in m3, (n,)."""
    clearance: Array
    """Least height of the soft underside over the stop's disc in m, (n,): positive, or the force
    of an edge alone is too small."""
    failure: str | None
    """Where and why the pressures ended early; None where all were reached."""
    bending: BendingModel
    """The half model behind the numbers."""
    result: Result
    """Its solutions, the first at zero pressure, and how they were found."""


def blocked(
    geometry: BellowBendingGeometry,
    material: MaterialSpec,
    pressures: Sequence[float],
    *,
    resolution: BendingResolution | None = None,
    acceleration: tuple[float, float, float] = HANGING,
    cap_density: float | None = None,
    options: Options = BLOCKED_OPTIONS,
    progress: Callable[[Progress], bool] | None = None,
) -> Blocked:
    """Force on the stop at gauge pressures in Pa; arguments as for `bending_model` and `follow`.

    A pressure that cannot be reached is no exception: `failure` says where and why, and the
    pressures before it are kept. Raises MechanicsError as `bending_model` does.
    """
    stops: list[TipStop] = []

    def stop(discretisation: Discretisation, shape: BellowShape) -> tuple[TipStop]:
        stops.append(TipStop(discretisation, shape))
        return (stops[0],)

    bending = bending_model(
        geometry,
        material,
        resolution=resolution,
        acceleration=acceleration,
        cap_density=cap_density,
        items=stop,
    )
    points = [Point(0.0), *(Point(float(p)) for p in pressures)]
    result = follow(bending.model, points, PressureControl(), options=options, progress=progress)
    # at least the point of zero pressure, or nothing at all
    forces = np.array([2 * stops[0].force(s.state.x) for s in result.solutions])
    reached = result.solutions[1:]
    preload = float(forces[0]) if len(forces) else 0.0
    return Blocked(
        pressure=np.array([s.pressure for s in reached]),
        force=forces[1:] - preload,
        preload=preload,
        angle=np.array([bending.angle(s.state) for s in reached]),
        volume=np.array([bending.volume(s.volume) for s in reached]),
        clearance=np.array([_clearance(bending, s.state.x) for s in reached]),
        failure=result.failure,
        bending=bending,
        result=result,
    )


class TipStop:
    """Unilateral, frictionless stop under the far lower edge of the rigid cap, half of it.

    The edge lies beyond the soft body's nodes. A body that moves in the plane of symmetry carries
    it along: with nodes a and b on one vertical line of the cap, b above a by h, and the edge t
    beyond a, it sinks by w_a - t (u_b - u_a) / h, exactly and at any angle.
    """

    def __init__(
        self,
        discretisation: Discretisation,
        shape: BellowShape,
        stiffness: float = STOP_STIFFNESS,
    ) -> None:
        """Under the cap's undeformed edge; `stiffness` in N/m replaces rigidity."""
        d = discretisation
        cap = d.nodes_on("cap")
        middle = cap[np.abs(d.nodes[cap, 1]) < 1e-9]
        low = middle[np.argmin(d.nodes[middle, 2])]
        high = middle[np.argmax(d.nodes[middle, 2])]
        lever = (shape.tip - d.nodes[low, 0]) / (d.nodes[high, 2] - d.nodes[low, 2])
        self.symmetric = True
        self.dofs = np.array([[3 * low, 3 * low + 2, 3 * high]])
        self._weights = np.array([lever, 1.0, -lever])
        self._stiffness = stiffness

    def gap(self, x: Array) -> float:
        """Height of the edge over the plane in m."""
        return float(self._weights @ x[self.dofs[0]])

    def force(self, x: Array) -> float:
        """Force on half the tip in N, upwards."""
        return self._stiffness * max(0.0, -self.gap(x))

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Residual (1, 3) and its derivative (1, 3, 3)."""
        w = self._weights
        # touching counts as contact, so that the first step already feels the stop
        stiffness = self._stiffness if self.gap(x) <= 0 else 0.0
        return -self.force(x) * w[None], stiffness * np.outer(w, w)[None]


def _clearance(bending: BendingModel, x: Array) -> float:
    d, shape = bending.model.discretisation, bending.shape
    below = d.nodes_at(z=shape.underside)
    here = d.nodes[below] + x[3 * below[:, None] + np.arange(3)]
    away = np.hypot(here[:, 0] - shape.tip, here[:, 1])
    on_disc = here[away < 2.5 * shape.average_radius]
    return float(np.min(on_disc[:, 2], initial=np.inf) - shape.underside)
