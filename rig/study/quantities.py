"""What may be asked of a point: quantities of models, in the units of people who ask.

Beside the columns of `rig predict` there are

- `angle_range` and `tip_travel`, the size of the workspace between rest and a pressure. The
  workspace is that of the toolbox (Yao, He and Maiolino, Section III): the places of the tip over
  the pressures, of a bellow that bends with constant curvature over a bottom that keeps its length.
  One pressure moves the tip along one curve, so two numbers tell its size: how far the end cap
  turns, and how far apart the ends of the curve are.
- `inner_radius`: of the bent inner side, which keeps its length (Yin et al., eqs. 4 and 5).
- `max_strain` and `safety_factor`: how near the material is to tearing, notches included, by
  `rig.mechanics.strength`. The factor is that of the governing criterion.
- `outer_diameter` and `groove_width`: what the shape at rest is, for limits of space and printers.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rig.mechanics.bellow import BellowShape, bending_geometry
from rig.mechanics.fe.extremes import Extremes
from rig.mechanics.job import Job
from rig.mechanics.model import predict
from rig.mechanics.outline import body_of
from rig.mechanics.response import Response, interpolated
from rig.mechanics.simulate.prediction import free_inflation
from rig.mechanics.strength import safety
from rig.mechanics.table import COLUMNS, rows
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec
from rig.spec.study import QuantityName
from rig.study.errors import StudyError
from rig.study.factors import Array

UNITS: dict[QuantityName, str] = {
    "angle": "deg",
    "displacement": "mm",
    "blocked_force": "g",
    "volume": "ml",
    "max_von_mises": "kpa",
    "angle_range": "deg",
    "inner_radius": "mm",
    "tip_travel": "mm",
    "max_strain": "percent",
    "safety_factor": "1",
    "outer_diameter": "mm",
    "groove_width": "mm",
}
"""Quantity to the unit of its responses; columns of `rig predict` are called QUANTITY_UNIT."""


class Asked:
    """One actuator and one model at some pressures in Pa; each calculation is done once."""

    def __init__(
        self,
        actuator: ActuatorSpec,
        material: MaterialSpec,
        model: str,
        pressures: list[float],
        job: Job,
        *,
        blocked: bool = True,
    ) -> None:
        """`blocked` tells whether the blocked force is among what will be asked for."""
        self.blocked = blocked
        self.actuator, self.material, self.model, self.job = actuator, material, model, job
        self.pressures = np.array(sorted({0.0, *pressures}))
        self._response: Response | None = None

    def value(self, quantity: QuantityName, pressure: float) -> float:
        """In the quantity's unit; raises RigError where there is none."""
        derived = _DERIVED.get(quantity)
        if derived is not None:
            return derived(self, pressure)
        at = COLUMNS.index(f"{quantity}_{UNITS[quantity]}")
        value = rows(self.response)[self._row(pressure)][at]
        if not isinstance(value, float):
            raise StudyError(
                f"model '{self.model}' gives no {quantity} of the family "
                f"'{self.actuator.geometry.family}'; ask for another response."
            )
        return value

    @property
    def response(self) -> Response:
        """At all pressures, rest included."""
        if self._response is None:
            self._response = predict(
                self.actuator,
                self.material,
                self.model,
                self.pressures,
                self.job,
                blocked=self.blocked,
            )
        return self._response

    def angles(self, pressure: float) -> tuple[float, float]:
        """Bending angles in rad at rest and at a pressure."""
        rest, bent = (self.value("angle", p) for p in (0.0, pressure))
        return float(np.radians(rest)), float(np.radians(bent))

    def extreme(self, pressure: float, of: Callable[[Extremes], float]) -> float:
        """A number of the largest stresses and strains, interpolated between rungs of pressure."""
        curves = free_inflation(self.actuator, self.material).curves(
            float(self.pressures[-1]), self.job
        )
        if not curves.pressure.size or curves.pressure[-1] < pressure * (1 - 1e-9):
            raise StudyError(f"no stresses at {pressure / 1e3:g} kPa: {curves.stopped}")
        values = np.array([of(extremes) for extremes in curves.extremes])
        return float(interpolated(curves.pressure, values, np.array([pressure]))[0])

    def _row(self, pressure: float) -> int:
        return int(np.searchsorted(self.pressures, pressure))


def _angle_range(asked: Asked, pressure: float) -> float:
    rest, bent = asked.angles(pressure)
    return float(np.degrees(bent - rest))


def _inner_radius(asked: Asked, pressure: float) -> float:
    length = body_of(asked.actuator.geometry).effective_length
    _, bent = asked.angles(pressure)
    return 1e3 * length / bent if bent > 0 else float("inf")


def _tip_travel(asked: Asked, pressure: float) -> float:
    shape = BellowShape.of(bending_geometry(asked.actuator, "The tip's travel"))
    beyond = shape.tip - shape.effective_length
    rest, bent = (tip(angle, shape.effective_length, beyond) for angle in asked.angles(pressure))
    return 1e3 * float(np.linalg.norm(bent - rest))


def tip(angle: float, length: float, beyond: float) -> Array:
    """Place of the tip in m, (2,), along the bellow at rest and to the side that it bends to.

    An arc of `length` that turns by `angle` in rad, and a straight piece `beyond` its end.
    """
    along = length * np.sinc(angle / np.pi)
    aside = length * np.sinc(angle / (2 * np.pi)) * np.sin(angle / 2)
    return np.array([along + beyond * np.cos(angle), aside + beyond * np.sin(angle)])


def _max_strain(asked: Asked, pressure: float) -> float:
    return 100 * asked.extreme(pressure, lambda extremes: extremes.principal_strain.value)


def _safety_factor(asked: Asked, pressure: float) -> float:
    """Interpolated is the share of the strength that is used, which is finite at rest."""

    def used(extremes: Extremes) -> float:
        governing = safety(extremes, asked.material).governing
        if governing is None:
            raise StudyError(
                f"the material '{asked.material.name}' tells neither tensile_strength nor "
                f"elongation_at_break, so there is no safety factor; add one of them."
            )
        return 1 / governing.factor

    share = asked.extreme(pressure, used)
    return 1 / share if share > 0 else float("inf")


def _outer_diameter(asked: Asked, _: float) -> float:
    shape = BellowShape.of(bending_geometry(asked.actuator, "The outer diameter"))
    return 2e3 * (shape.outer_radius + shape.wall)


def _groove_width(asked: Asked, _: float) -> float:
    """Between the walls of neighbouring convolutions, outside: what a printer must keep open."""
    shape = BellowShape.of(bending_geometry(asked.actuator, "The groove's width"))
    return 2e3 * (shape.trough_arc - shape.wall)


_DERIVED: dict[QuantityName, Callable[[Asked, float], float]] = {
    "angle_range": _angle_range,
    "inner_radius": _inner_radius,
    "tip_travel": _tip_travel,
    "max_strain": _max_strain,
    "safety_factor": _safety_factor,
    "outer_diameter": _outer_diameter,
    "groove_width": _groove_width,
}
