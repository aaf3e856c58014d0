"""Whether the flanks of a bending bellow would touch, which the engine does not resist."""

from __future__ import annotations

from rig.mechanics.bellow import BellowShape
from rig.mechanics.fe import Discretisation, State
from rig.mechanics.fe.selfcontact import FacingSurface


class Flanks:
    """The outside and the cavity of the modelled half, each watched for folds that close.

    What faces its own mirror image across the plane of symmetry is not looked at.
    """

    def __init__(self, discretisation: Discretisation, shape: BellowShape) -> None:
        """Gaps up to a quarter above that between the flanks at rest are looked for."""
        between = 2 * (shape.trough_arc - shape.wall)
        reach = 1.25 * max(between, shape.wall)
        self._surfaces = [
            FacingSurface(
                discretisation,
                discretisation.facets_on(side),
                reach=reach,
                depth=0.4 * shape.wall,
            )
            for side in ("outside", "cavity")
        ]

    def gap(self, state: State) -> float:
        """Smallest gap in m; not positive where flanks touch, infinite where none is in reach."""
        found = (surface.smallest_gap(state.x) for surface in self._surfaces)
        return min((gap.distance for gap in found if gap is not None), default=float("inf"))
