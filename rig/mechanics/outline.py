"""What a bench sees of an actuator, whatever its family: outlines, and volume and mass at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.mechanics import profile
from rig.mechanics.bellow import BellowShape
from rig.mechanics.chambers import ChamberRow
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricBellow
from rig.mechanics.mesh.bellow_joint import JointBellow
from rig.mechanics.response import SideProfile
from rig.mechanics.shells import SlitShell
from rig.spec.actuator import (
    BellowAxisymmetricGeometry,
    BellowBendingGeometry,
    BellowGripperGeometry,
    BellowJointGeometry,
    Geometry,
)
from rig.spec.chambers import (
    BellowRectangularGeometry,
    MultiChamberBendingGeometry,
    MultiChamberLinearGeometry,
)
from rig.spec.shells import ShellReinforcedBendingGeometry, ShellReinforcedLinearGeometry

Array = NDArray[np.float64]

CONNECTOR_THICKNESS = 6e-3
"""Of the rigid plate that holds a row of chambers, metres, as the bellow's of Yao et al."""
PLATE_THICKNESS = 3e-3
"""Of the plate on the cap at most, metres: what the camera finds is a plate, as tall as the
actuator, not a plug."""
_CONNECTOR_MARGIN = 2e-3
"""By which that plate stands out over the chambers, metres."""
FLAG_SIDE = 10e-3
"""Black square of the markers on an actuator that lengthens, metres."""
FLAG_PAPER = 1.5 * FLAG_SIDE
"""Side of the white paper that they are printed on, metres."""
_FLAG_GAP = 1e-3
"""Between the cap's plate and the paper below it, metres."""
_PIECE = 2e-3
"""Longest straight piece of a bent outline, metres."""


def side_profile(geometry: Geometry, deformation: float) -> SideProfile:
    """Outlines seen from the side, for a bending angle in rad or an elongation in m."""
    match geometry:
        case BellowBendingGeometry():
            return profile.side_profile(geometry, deformation)
        case BellowRectangularGeometry() | MultiChamberBendingGeometry():
            row = ChamberRow.of(geometry)
            return _bent_profile(row, deformation, _floor_of(row), _roof_of(row))
        case ShellReinforcedBendingGeometry():
            tube = SlitShell.of(geometry)
            along = np.array([tube.start, tube.start, tube.end, tube.end])
            roof = np.column_stack((along, tube.height * np.array([0, 1, 1, 0])))
            return _bent_profile(tube, deformation, tube.radius - tube.chamber_radius, roof)
        case ShellReinforcedLinearGeometry():
            tube = SlitShell.of(geometry)
            straight = np.array([[tube.start, tube.radius], [tube.end, tube.radius]])
            return _lengthened_profile(tube.start, tube.end, straight, deformation)
        case MultiChamberLinearGeometry():
            row = ChamberRow.of(geometry)
            steps = _roof_of(row)[1:-1] - [0.0, row.height / 2]
            return _lengthened_profile(row.start, row.end, steps, deformation)
        case BellowAxisymmetricGeometry() | BellowJointGeometry() | BellowGripperGeometry():
            body = _body_of_revolution(geometry)
            return _lengthened_profile(body.start, body.end, body.contour(), deformation)


class Body(Protocol):
    """What benches and controllers need to know of an actuator at rest."""

    @property
    def effective_length(self) -> float:
        """Length that bends or lengthens in m."""
        ...

    @property
    def cavity_volume(self) -> float:
        """In m3."""
        ...

    def soft_mass(self, density: float) -> float:
        """Of what deforms in kg, `density` in kg/m3."""
        ...

    def cap_mass(self, density: float) -> float:
        """Of what is moved as a whole in kg, `density` in kg/m3."""
        ...


def body_of(geometry: Geometry) -> Body:
    """Dimensions, volumes and masses."""
    match geometry:
        case BellowBendingGeometry():
            return BellowShape.of(geometry)
        case (
            BellowRectangularGeometry()
            | MultiChamberBendingGeometry()
            | MultiChamberLinearGeometry()
        ):
            return ChamberRow.of(geometry)
        case ShellReinforcedBendingGeometry() | ShellReinforcedLinearGeometry():
            return SlitShell.of(geometry)
        case BellowGripperGeometry():
            return Pair(AxisymmetricBellow.of(geometry.finger))
        case BellowAxisymmetricGeometry() | BellowJointGeometry():
            return _body_of_revolution(geometry)


@dataclass(frozen=True)
class Pair:
    """Two equal bodies side by side, inflated together."""

    one: Body

    @property
    def effective_length(self) -> float:
        """Of either in m."""
        return self.one.effective_length

    @property
    def cavity_volume(self) -> float:
        """Of both in m3."""
        return 2 * self.one.cavity_volume

    def soft_mass(self, density: float) -> float:
        """Of both in kg."""
        return 2 * self.one.soft_mass(density)

    def cap_mass(self, density: float) -> float:
        """Of both in kg."""
        return 2 * self.one.cap_mass(density)


def _body_of_revolution(
    geometry: BellowAxisymmetricGeometry | BellowJointGeometry | BellowGripperGeometry,
) -> AxisymmetricBellow | JointBellow:
    """The one that the camera sees."""
    match geometry:
        case BellowGripperGeometry():
            return AxisymmetricBellow.of(geometry.finger)
        case BellowAxisymmetricGeometry():
            return AxisymmetricBellow.of(geometry)
        case BellowJointGeometry():
            return JointBellow.of(geometry)


def _floor_of(row: ChamberRow) -> float:
    """Height of what lies below the chambers, m."""
    return row.layer or min(s.cavity.low for s in row.segments if s.cavity) - row.underside


def _roof_of(row: ChamberRow) -> Array:
    """The upper outline as (x, height over the underside), from the floor and back to it, m."""
    steps = [np.array([row.start, 0.0])]
    for x, segment in zip(row.starts(), row.segments, strict=False):
        height = segment.outline.high - row.underside
        steps += [np.array([x, height]), np.array([x + segment.length, height])]
    steps.append(np.array([row.end, 0.0]))
    return np.stack(steps)


def _lengthened_profile(start: float, end: float, contour: Array, elongation: float) -> SideProfile:
    """An actuator stretched evenly, from its clamped face to its cap.

    `contour` is its upper outline at rest, (n, 2) as (x, distance from the axis).
    """
    x = contour[:, 0] + elongation * (contour[:, 0] - start) / (end - start)
    r, half = contour[:, 1], float(contour[:, 1].max())
    cap = end + elongation
    # one on the connector's front, one below the cap, both on the axis
    fixed = start - CONNECTOR_THICKNESS + FLAG_PAPER / 2
    moving = cap + PLATE_THICKNESS + _FLAG_GAP + FLAG_PAPER / 2
    return SideProfile(
        connector=_plate(start - CONNECTOR_THICKNESS, start, half + _CONNECTOR_MARGIN),
        bellow=np.concatenate((np.column_stack((x, -r)), np.column_stack((x, r))[::-1])),
        bottom_layer=None,
        end_cap=_plate(cap, cap + PLATE_THICKNESS, half),
        flags=np.array([[fixed, 0.0], [moving, 0.0]]),
    )


def _plate(near: float, far: float, half: float) -> Array:
    return np.array([[near, -half], [far, -half], [far, half], [near, half]])


def _bent_profile(
    row: ChamberRow | SlitShell, angle: float, floor: float, upper: Array
) -> SideProfile:
    """An actuator bent to an arc about its underside, sections plane."""
    near, top = row.start, row.height
    upper[[0, -1], 1] = floor
    return SideProfile(
        connector=np.array(
            [
                [near - CONNECTOR_THICKNESS, row.underside],
                [near, row.underside],
                [near, row.underside + top + _CONNECTOR_MARGIN],
                [near - CONNECTOR_THICKNESS, row.underside + top + _CONNECTOR_MARGIN],
            ]
        ),
        bellow=_bent(row, angle, upper[::-1]),
        bottom_layer=_bent(row, angle, _box(near, row.end, floor)),
        end_cap=_bent(row, angle, _box(row.end, min(row.tip, row.end + PLATE_THICKNESS), top)),
    )


def _box(start: float, end: float, height: float) -> Array:
    return np.array([[start, 0.0], [end, 0.0], [end, height], [start, height]])


def _bent(row: ChamberRow | SlitShell, angle: float, corners: Array) -> Array:
    """A closed outline of (x, height over the underside), its long sides bent with the row."""
    pieces = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, int(np.ceil(abs(end[0] - start[0]) / _PIECE)))
        share = np.arange(count)[:, None] / count
        pieces.append(start + share * (end - start))
    x, height = np.concatenate(pieces).T
    return profile.wrap(row, angle, x, height)
