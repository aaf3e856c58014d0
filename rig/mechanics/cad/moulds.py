"""Moulds for actuators that are cast, in the actuator's own place: mould and casting fill a block.

Rows of chambers are cast in two blocks which are bonded at the middle of the chambers (Agarwal et
al., Multi-Chamber SPA Fabrication, steps 1 to 4): each mould is a tray whose floor, at the joint,
carries half of the chambers, passages and inlet. A layer is cast in a tray of its own.

Axisymmetric bellows are cast in one piece (Auysakul et al., Section 4.1, whose mould has five
pieces): two jaws about the outside, a base with the core, poured from the top. Arcs bulge over the
core's end: the casting is pulled off it.

Cores of slit shells are cast in one piece, too (Agarwal et al., "Single step molding"): two jaws, a
base that carries the chamber on a pin as thick as the inlet, poured where the tip will be. The
casting stretches over the chamber's rod, twice the pin's width, when it is pulled off.
"""

from __future__ import annotations

from rig.mechanics.cad.construct import Combined, Line, Part, Revolved
from rig.mechanics.cad.errors import CadError
from rig.mechanics.cad.parts import box, cavities, inlet_radius, rod, scalloped
from rig.mechanics.chambers import ChamberRow, Rectangle
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricBellow
from rig.mechanics.shells import SlitShell
from rig.spec.actuator import (
    BellowAxisymmetricGeometry,
    BellowGripperGeometry,
    Geometry,
)
from rig.spec.chambers import MultiChamberBendingGeometry, MultiChamberLinearGeometry
from rig.spec.shells import ShellReinforcedBendingGeometry, ShellReinforcedLinearGeometry

WALL = 0.004
"""Thickness of every mould's walls and floors in m; a print's choice, no paper's."""


def moulds_of(geometry: Geometry) -> tuple[Part, ...]:
    """The pieces of an actuator's mould; raises CadError for families that are not cast."""
    match geometry:
        case MultiChamberBendingGeometry() | MultiChamberLinearGeometry():
            return _trays(ChamberRow.of(geometry))
        case BellowAxisymmetricGeometry():
            return _jaws(AxisymmetricBellow.of(geometry))
        case BellowGripperGeometry():
            return moulds_of(geometry.finger)
        case ShellReinforcedBendingGeometry() | ShellReinforcedLinearGeometry():
            return _jaws_along_x(SlitShell.of(geometry))
        case _:
            raise CadError(
                f"There is no mould for a {geometry.family}: it is printed, blown, or cast in a "
                f"mould that is not drawn yet. `rig export --stl` writes what a printer takes."
            )


def _trays(row: ChamberRow) -> tuple[Part, ...]:
    middle = next(s.cavity for s in row.segments if s.cavity is not None)
    joint = (middle.low + middle.high) / 2
    bottom, top = row.underside + row.layer, row.underside + row.height
    pieces = [
        Part("upper-tray", _tray(row, joint, top, cores=True), is_soft=False),
        Part("lower-tray", _tray(row, joint, bottom, cores=True), is_soft=False),
    ]
    if row.layer:
        tray = _tray(row, row.underside, bottom, cores=False)
        pieces.append(Part("layer-tray", tray, is_soft=False))
    return tuple(pieces)


def _tray(row: ChamberRow, floor: float, rim: float, *, cores: bool) -> Combined:
    """Around what lies between two heights z in m, open at the rim's."""
    up = rim > floor
    low, high = min(floor, rim), max(floor, rim)
    outside = Rectangle(
        row.half_width + WALL, low - WALL if up else low, high if up else high + WALL
    )
    # beyond the rim, so that no film is left there
    inside = Rectangle(row.half_width, low if up else low - WALL, high + WALL if up else high)
    tray = Combined(
        (box(outside, row.start - WALL, row.end + WALL),), (box(inside, row.start, row.end),)
    )
    sunk = floor - WALL / 2 if up else floor + WALL / 2
    halves = (
        box(Rectangle(c.half_width, *((sunk, c.high) if up else (c.low, sunk))), start, end)
        for c, start, end in (cavities(row) if cores else ())
    )
    return Combined((tray, *halves))


def _jaws(shape: AxisymmetricBellow) -> tuple[Part, ...]:
    # beyond both ends, so that no film is left there
    body = Revolved(
        (
            Line((-WALL, shape.radius), (0.0, shape.radius)),
            *scalloped(shape, shape.radius, shape.height),
            Line((shape.height, shape.radius), (shape.height + WALL, shape.radius)),
        ),
        axis="z",
    )
    inner = shape.radius - shape.wall
    core = Revolved(
        (
            Line((-WALL / 2, inner), (0.0, inner)),
            *scalloped(shape, inner, shape.height - shape.wall),
        ),
        axis="z",
    )
    reach = shape.radius + shape.sagitta + WALL
    side = Rectangle(reach, 0.0, shape.height)
    plate = Rectangle(reach, -WALL, 0.0)
    return (
        Part("left-jaw", Combined((box(side, -reach, 0.0),), (body,)), is_soft=False),
        Part("right-jaw", Combined((box(side, 0.0, reach),), (body,)), is_soft=False),
        Part("base", Combined((box(plate, -reach, reach), core)), is_soft=False),
    )


def _jaws_along_x(shape: SlitShell) -> tuple[Part, ...]:
    low, high = shape.start - shape.end_length, shape.end + shape.end_length
    # beyond both ends, so that no film is left there
    body = rod(low - WALL, high + WALL, shape.core_radius)
    pin = rod(low - WALL / 2, shape.start, inlet_radius(shape))
    chamber = rod(shape.start, shape.end, shape.chamber_radius)
    reach = shape.core_radius + WALL
    plate = box(Rectangle(reach, -reach, reach), low - WALL, low)
    halves = {"lower-jaw": (-reach, 0.0), "upper-jaw": (0.0, reach)}
    return (
        *(
            Part(name, Combined((box(Rectangle(reach, *z), low, high),), (body,)), is_soft=False)
            for name, z in halves.items()
        ),
        Part("base", Combined((plate, pin, chamber)), is_soft=False),
    )
