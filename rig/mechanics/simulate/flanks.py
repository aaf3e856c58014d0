"""Whether the flanks of a bellow would touch, where nothing resists that."""

from __future__ import annotations

from rig.mechanics.fe import Discretisation, State
from rig.mechanics.fe.selfcontact import FacingSurface


class Flanks:
    """The outside and the cavity of a modelled bellow, each watched for folds that close.

    What faces its own mirror image across a plane of symmetry is not looked at.
    """

    def __init__(self, discretisation: Discretisation, *, between: float, wall: float) -> None:
        """Gaps up to a quarter above `between`, that between the flanks at rest, are looked for,
        at least as far as the `wall` is thick; both in m."""
        reach = 1.25 * max(between, wall)
        self._surfaces = [
            FacingSurface(
                discretisation,
                discretisation.facets_on(side),
                reach=reach,
                depth=0.4 * wall,
            )
            for side in ("outside", "cavity")
        ]

    def gap(self, state: State) -> float:
        """Smallest gap in m; not positive where flanks touch, infinite where none is in reach."""
        found = (surface.smallest_gap(state.x) for surface in self._surfaces)
        return min((gap.distance for gap in found if gap is not None), default=float("inf"))
