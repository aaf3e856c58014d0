"""What a bench sees of an actuator that bends, whatever its family: outlines and volume at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig.mechanics import profile
from rig.mechanics.bellow import BellowShape
from rig.mechanics.chambers import ChamberRow
from rig.mechanics.errors import MechanicsError
from rig.mechanics.response import SideProfile
from rig.mechanics.shells import SlitShell
from rig.spec.actuator import BellowBendingGeometry, Geometry
from rig.spec.chambers import BellowRectangularGeometry, MultiChamberBendingGeometry
from rig.spec.shells import ShellReinforcedBendingGeometry

Array = NDArray[np.float64]

CONNECTOR_THICKNESS = 6e-3
"""Of the rigid plate that holds a row of chambers, metres, as the bellow's of Yao et al."""
PLATE_THICKNESS = 3e-3
"""Of the plate on the cap at most, metres: what the camera finds is a plate, as tall as the
actuator, not a plug."""
_CONNECTOR_MARGIN = 2e-3
"""By which that plate stands out over the chambers, metres."""
_PIECE = 2e-3
"""Longest straight piece of a bent outline, metres."""


def side_profile(geometry: Geometry, angle: float) -> SideProfile:
    """Outlines in the plane of bending for a bending angle in rad; see `SideProfile`.

    Raises MechanicsError for a family that does not bend.
    """
    match geometry:
        case BellowBendingGeometry():
            return profile.side_profile(geometry, angle)
        case BellowRectangularGeometry() | MultiChamberBendingGeometry():
            row = ChamberRow.of(geometry)
            return _profile(row, angle, _floor_of(row), _roof_of(row))
        case ShellReinforcedBendingGeometry():
            tube = SlitShell.of(geometry)
            along = np.array([tube.start, tube.start, tube.end, tube.end])
            roof = np.column_stack((along, tube.height * np.array([0, 1, 1, 0])))
            return _profile(tube, angle, tube.radius - tube.chamber_radius, roof)
        case _:
            raise _does_not_bend(geometry)


def bending_shape(geometry: Geometry) -> BellowShape | ChamberRow | SlitShell:
    """Dimensions, volumes and masses; raises MechanicsError for a family that does not bend."""
    match geometry:
        case BellowBendingGeometry():
            return BellowShape.of(geometry)
        case BellowRectangularGeometry() | MultiChamberBendingGeometry():
            return ChamberRow.of(geometry)
        case ShellReinforcedBendingGeometry():
            return SlitShell.of(geometry)
        case _:
            raise _does_not_bend(geometry)


def _does_not_bend(geometry: Geometry) -> MechanicsError:
    return MechanicsError(
        f"actuators of the family '{geometry.family}' do not bend, and the bench measures bending "
        "only: it can be predicted and exported, not characterised."
    )


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


def _profile(row: ChamberRow | SlitShell, angle: float, floor: float, upper: Array) -> SideProfile:
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
