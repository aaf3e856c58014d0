"""What a mechanical model answers: the quasi-static response of an actuator to pressure.

The interface is the same for beam theory and finite elements; the virtual specimen is one too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.mechanics.errors import MechanicsError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Response:
    """Quasi-static response; every array has the shape (n,) of `pressure`, SI units.

    A quantity that the model cannot give is None. From the pressure on at which a calculation got
    no further its values are not a number, and `shortfalls` says why.
    """

    model: str
    pressure: Array
    """Gauge pressure in Pa, ascending."""
    angle: Array | None
    """Bending angle between connector and end cap in rad, tip free; None of a linear actuator."""
    displacement: Array
    """Length difference between bellow and bottom layer (bending) or elongation (linear) in m."""
    blocked_force: Array | None
    """Tip force in N when the tip is held at zero angle."""
    volume: Array
    """Volume of the cavity in m3, tip free."""
    max_von_mises: Array | None = None
    """Largest von Mises stress in Pa, tip free."""
    shortfalls: tuple[str, ...] = ()
    """Why values are missing, where they are."""
    cautions: tuple[str, ...] = ()
    """What people must know before they trust it, sentences."""

    def at(self, pressure: ArrayLike) -> Response:
        """Response at other pressures in Pa, (m,), by monotone cubic interpolation (PCHIP).

        Raises MechanicsError outside the pressures that the model answered for.
        """
        wanted = np.atleast_1d(np.asarray(pressure, dtype=float))
        low, high = float(self.pressure[0]), float(self.pressure[-1])
        slack = 1e-12 * max(abs(low), abs(high))
        if not np.all((wanted >= low - slack) & (wanted <= high + slack)):  # also catches NaN
            raise MechanicsError(
                f"the response of model '{self.model}' covers {low / 1e3:.4g} to "
                f"{high / 1e3:.4g} kPa; {wanted.min() / 1e3:.4g} to {wanted.max() / 1e3:.4g} kPa "
                f"was asked for. Predict over a wider range of pressures."
            )
        inside = np.clip(wanted, low, high)

        def there(values: Array) -> Array:
            return interpolated(self.pressure, values, inside)

        return Response(
            model=self.model,
            pressure=wanted,
            angle=None if self.angle is None else there(self.angle),
            displacement=there(self.displacement),
            blocked_force=None if self.blocked_force is None else there(self.blocked_force),
            volume=there(self.volume),
            max_von_mises=None if self.max_von_mises is None else there(self.max_von_mises),
            shortfalls=self.shortfalls,
            cautions=self.cautions,
        )

    def pressure_for(self, quantity: Literal["angle", "volume"], values: ArrayLike) -> Array:
        """Pressures in Pa, (m,), at which `quantity` has `values` (rad or m3): the inverse of `at`.

        Raises MechanicsError where there is no such quantity, it does not grow with pressure, or
        it never gets there.
        """
        wanted = np.atleast_1d(np.asarray(values, dtype=float))
        values_known: Array | None = getattr(self, quantity)
        if values_known is None:
            raise MechanicsError(
                f"model '{self.model}' gives no {quantity} of this actuator, so it cannot be "
                f"controlled. Ask by pressure."
            )
        reached = np.isfinite(values_known)
        known, pressure = values_known[reached], self.pressure[reached]
        if known.size < 2 or np.any(np.diff(known) <= 0):
            raise MechanicsError(
                f"the {quantity} of model '{self.model}' does not grow all the way with pressure, "
                f"so it cannot be controlled. Ask by pressure."
            )
        outside = wanted[~((wanted >= known[0]) & (wanted <= known[-1]))]
        if outside.size:
            shown, unit = (np.degrees, "deg") if quantity == "angle" else (_millilitres, "mL")
            raise MechanicsError(
                f"model '{self.model}' reaches {shown(known[0]):.4g} to {shown(known[-1]):.4g} "
                f"{unit} between {pressure[0] / 1e3:.4g} and {pressure[-1] / 1e3:.4g} "
                f"kPa; {shown(outside[0]):.4g} {unit} is outside. Ask for less, or widen the "
                f"range of pressures."
            )
        from scipy.interpolate import PchipInterpolator

        curve = PchipInterpolator(pressure, known)
        roots = [curve.solve(value, extrapolate=False) for value in wanted]
        # an end value may miss its own polynomial by round-off: the end is the answer then
        return np.array(
            [
                found[0] if found.size else pressure[np.argmin(np.abs(known - value))]
                for found, value in zip(roots, wanted, strict=True)
            ]
        )


def interpolated(pressure: Array, values: Array, at: Array) -> Array:
    """Values (n,) over ascending pressures at other pressures, by monotone cubics (PCHIP).

    Not a number beyond the last pressure at which `values` is known.
    """
    known = np.isfinite(values)
    result = np.full(at.shape, np.nan)
    if not known.any():
        return result
    pressure, values = pressure[known], values[known]
    covered = (at >= pressure[0]) & (at <= pressure[-1] * (1 + 1e-12))
    if pressure.size == 1:
        result[covered] = values[0]
        return result
    from scipy.interpolate import PchipInterpolator

    inside = np.minimum(at[covered], pressure[-1])
    result[covered] = PchipInterpolator(pressure, values)(inside)
    return result


@dataclass(frozen=True)
class SideProfile:
    """Outlines in the plane of bending, each (n, 2) in metres, closed without a repeated point.

    Coordinates: x along the undeformed axis away from the connector's soft-side face (x = -t),
    z from the bottom layer towards the crests; origin on the revolving axis where the cavity
    begins. Positive bending curls the tip towards -z. Counter-clockwise with x right and z up.
    """

    connector: Array
    bellow: Array
    bottom_layer: Array | None
    """None of an actuator that lengthens."""
    end_cap: Array
    flags: Array | None = None
    """Centres (2, 2) of the markers on connector and end cap of an actuator that lengthens."""

    @property
    def soft(self) -> tuple[Array, ...]:
        """Outlines of what deforms, from front to back where one hides the other."""
        return (self.bellow,) if self.bottom_layer is None else (self.bottom_layer, self.bellow)


def _millilitres(volume: float) -> float:
    return volume * 1e6
