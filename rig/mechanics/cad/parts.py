"""Parts of every geometry family as constructive solids.

Bending bellow: the toolbox's solid exactly (Section II-A of Yao et al. and the toolbox's notes),
air inlet included. The inlet's place and the connector's outline are nowhere stated: here the
inlet lies on the revolving axis and goes on through the connector, which is a plate as wide as
the bottom layer and t more on each side, from the underside to t above the end wall.

Rows of chambers: their segments, with an inlet as wide as the narrowest passage.

Slit shells: the core with an inlet through its first solid end, and the shell between the grips.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.bellow import INLET_RADIUS, BellowShape
from rig.mechanics.cad.construct import Arc, Combined, Line, Part, Point, Prism, Revolved
from rig.mechanics.chambers import ChamberRow, Rectangle
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricBellow
from rig.mechanics.mesh.bellow_joint import JointBellow
from rig.mechanics.shells import SlitShell
from rig.spec.actuator import (
    BellowAxisymmetricGeometry,
    BellowBendingGeometry,
    BellowGripperGeometry,
    BellowJointGeometry,
    Geometry,
)
from rig.spec.shells import ShellReinforcedBendingGeometry, ShellReinforcedLinearGeometry

_NO_FLANK = 1e-9
"""Flanks shorter than this are left out, metres."""


def parts_of(geometry: Geometry) -> tuple[Part, ...]:
    """All parts of an actuator, the soft one first."""
    match geometry:
        case BellowBendingGeometry():
            return _bending_parts(BellowShape.of(geometry))
        case BellowAxisymmetricGeometry():
            body = axisymmetric_soft_body(AxisymmetricBellow.of(geometry))
            return (Part("soft", body, is_soft=True),)
        case BellowGripperGeometry():
            # its rigid frame is not described
            return parts_of(geometry.finger)
        case BellowJointGeometry():
            return (Part("soft", joint_soft_body(JointBellow.of(geometry)), is_soft=True),)
        case ShellReinforcedBendingGeometry() | ShellReinforcedLinearGeometry():
            return _shell_parts(SlitShell.of(geometry))
        case _:
            return _chamber_parts(ChamberRow.of(geometry))


def _bending_parts(shape: BellowShape) -> tuple[Part, ...]:
    return (
        Part("soft", bending_soft_body(shape), is_soft=True),
        Part("connector", _connector(shape), is_soft=False),
        Part("cap", _end_plate(shape, shape.effective_length + shape.wall), is_soft=False),
    )


def bending_soft_body(shape: BellowShape, *, inlet: bool = True) -> Combined:
    """Bellow, channel, bottom layer and end walls in one."""
    length, wall = shape.effective_length, shape.wall
    cavity = (
        Revolved(_bellow_profile(shape, 0.0)),
        Prism(_points(shape.channel_section), 0.0, length),
    )
    holes = (rod(-wall, 0.0, INLET_RADIUS),) if inlet else ()
    return Combined(
        added=(
            Revolved(_bellow_profile(shape, wall)),
            Prism(_points(shape.solid_section), -wall, length + wall),
            rod(-wall, 0.0, shape.end_wall_top),
            rod(length, length + wall, shape.end_wall_top),
        ),
        removed=(*cavity, *holes),
    )


def _chamber_parts(row: ChamberRow) -> tuple[Part, ...]:
    last = row.segments[-1].outline
    cap = Combined((box(last, row.end, row.tip),))
    parts = [Part("soft", chamber_soft_body(row), is_soft=True), Part("cap", cap, is_soft=False)]
    if row.layer:
        parts.append(Part("layer", Combined((_layer(row),)), is_soft=False))
    return tuple(parts)


def chamber_soft_body(row: ChamberRow) -> Combined:
    """All segments in one, with an inlet through the first wall, but for the layer below."""
    ends = pairwise(float(x) for x in row.starts())
    outside = tuple(box(s.outline, *along) for s, along in zip(row.segments, ends, strict=True))
    cavity = tuple(box(section, start, end) for section, start, end in cavities(row))
    return Combined(outside, (*cavity, _layer(row)) if row.layer else cavity)


def cavities(row: ChamberRow) -> tuple[tuple[Rectangle, float, float], ...]:
    """Sections of chambers, passages and inlet, with x where they begin and end in m.

    The inlet goes through the solid first segment, as wide as the narrowest cavity behind it.
    """
    ends = pairwise(float(x) for x in row.starts())
    inside = [
        (segment.cavity, *along)
        for segment, along in zip(row.segments, ends, strict=True)
        if segment.cavity is not None
    ]
    narrowest = min((section for section, *_ in inside), key=lambda section: section.area)
    return (*inside, (narrowest, row.start, float(row.starts()[1])))


def _layer(row: ChamberRow) -> Prism:
    below = Rectangle(row.half_width, row.underside, row.underside + row.layer)
    return box(below, row.start, row.end)


def box(section: Rectangle, start: float, end: float) -> Prism:
    """A section swept along x, from start to end in m."""
    y, low, high = section.half_width, section.low, section.high
    return Prism(((-y, low), (y, low), (y, high), (-y, high)), start, end)


def _shell_parts(shape: SlitShell) -> tuple[Part, ...]:
    low, high = shape.start - shape.end_length, shape.end + shape.end_length
    core = Combined(
        (rod(low, high, shape.core_radius),),
        (
            rod(shape.start, shape.end, shape.chamber_radius),
            rod(low, shape.start, inlet_radius(shape)),
        ),
    )
    grip = Combined(
        (rod(shape.end, shape.tip, shape.radius),),
        (rod(shape.end, high, shape.core_radius),),
    )
    return (
        Part("soft", core, is_soft=True),
        Part("cap", grip, is_soft=False),
        Part("shell", slit_shell(shape), is_soft=False),
    )


def inlet_radius(shape: SlitShell) -> float:
    """Of the air inlet through the core's first solid end in m."""
    return min(INLET_RADIUS, shape.chamber_radius / 2)


def slit_shell(shape: SlitShell) -> Combined:
    """The shell: a tube less what its slits cut out between their bridges."""
    cuts = []
    for span in shape.spans:
        # the other half mirrors this one: a cut that starts or ends in the plane crosses it
        edges = [0.0, *(v for bridge in span.bridges for v in bridge), math.pi]
        for low, high in zip(edges[::2], edges[1::2], strict=True):
            if high - low < _NO_FLANK:
                continue
            around = [(low, high), (2 * math.pi - high, 2 * math.pi - low)]
            if high == math.pi:
                around = [(low, 2 * math.pi - low)]
            elif low == 0.0:
                around = [(-high, high)]
            cuts += [_wedge(a, b, 2 * shape.radius, span.start, span.end) for a, b in around]
    inside = rod(shape.start, shape.end, shape.core_radius)
    return Combined((rod(shape.start, shape.end, shape.radius),), (inside, *cuts))


def _wedge(low: float, high: float, reach: float, start: float, end: float) -> Prism:
    """What lies between two angles from the lowest line, as far as `reach` from the axis at
    least."""
    count = max(2, math.ceil((high - low) / (math.pi / 6)) + 1)
    rim = [
        (reach * math.sin(a), -reach * math.cos(a)) for a in np.linspace(low, high, count).tolist()
    ]
    # clockwise from below through +y: counter-clockwise in (y, z)
    return Prism(((0.0, 0.0), *rim), start, end)


def axisymmetric_soft_body(shape: AxisymmetricBellow) -> Combined:
    """Collar, bellows and top, standing on z = 0 and open below."""
    inner, under = shape.radius - shape.wall, shape.height - shape.wall
    return Combined(
        added=(Revolved(scalloped(shape, shape.radius, shape.height), axis="z"),),
        removed=(Revolved(scalloped(shape, inner, under), axis="z"),),
    )


def joint_soft_body(shape: JointBellow) -> Combined:
    """Bellows between two discs, on z = 0 the lower one's inner face, open below by an inlet.

    The paper does not show its inlet: here it goes through the lower disc along the axis.
    """
    outer, inner = (_zigzag(shape, side * shape.wall / 2) for side in (1, -1))
    low, high = outer[0].start[1], shape.end
    ends = (Line((shape.start, low), (0.0, low)), Line((shape.length, low), (high, low)))
    inlet = (Line((shape.start, INLET_RADIUS), (0.0, INLET_RADIUS)),)
    return Combined(
        added=(Revolved((ends[0], *outer, ends[1]), axis="z"),),
        removed=(Revolved(inner, axis="z"), Revolved(inlet, axis="z")),
    )


def _zigzag(shape: JointBellow, offset: float) -> tuple[Line | Arc, ...]:
    """Profile of all bellows, `offset` outwards of the middle of the wall."""
    arc = shape.rounding * shape.flank_angle / shape.meridian
    fractions = np.array([0.0, arc / 2, arc, 1 - arc, 1 - arc / 2, 1.0])
    up = [(float(z), float(r)) for r, z in shape.half(fractions, offset)]
    down = [(shape.pitch - z, r) for z, r in reversed(up)]
    one = [kind for half in (up, down) for kind in _half_zigzag(half)]
    return tuple(
        _moved(piece, number * shape.pitch) for number in range(shape.bellows) for piece in one
    )


def _half_zigzag(points: list[Point]) -> tuple[Arc, Line, Arc]:
    return (
        Arc(points[0], points[1], points[2]),
        Line(points[2], points[3]),
        Arc(points[3], points[4], points[5]),
    )


def _moved(piece: Line | Arc, along: float) -> Line | Arc:
    """A piece of a profile further along its axis."""
    return type(piece)(**{name: (p[0] + along, p[1]) for name, p in vars(piece).items()})


def _connector(shape: BellowShape) -> Combined:
    near, far = -shape.wall - shape.connector_thickness, -shape.wall
    side = shape.average_radius + 2 * shape.wall
    low, high = shape.underside, shape.end_wall_top + shape.wall
    plate = Prism(((-side, low), (side, low), (side, high), (-side, high)), near, far)
    return Combined((plate,), (rod(near, far, INLET_RADIUS),))


def _end_plate(shape: BellowShape, start: float) -> Combined:
    """The rigid end cap: outline of the end wall."""
    end = start + shape.cap_thickness
    section = Prism(_points(shape.solid_section), start, end)
    return Combined((rod(start, end, shape.end_wall_top), section))


def rod(start: float, end: float, radius: float) -> Revolved:
    """Cylinder about the x axis, from start to end in m."""
    return Revolved((Line((start, radius), (end, radius)),))


def _points(section: NDArray[np.float64]) -> tuple[Point, ...]:
    return tuple((float(y), float(z)) for y, z in section)


def _bellow_profile(shape: BellowShape, offset: float) -> tuple[Line | Arc, ...]:
    """Inner (offset 0) or outer (offset t) profile of all convolutions from x = 0 to L."""
    half = shape.half_pitch
    trough, crest = shape.trough_arc - offset, shape.crest_arc + offset
    low, high = shape.inner_radius + shape.trough_arc, shape.outer_radius - shape.crest_arc
    slant = math.sqrt(0.5)
    pieces: list[Line | Arc] = []
    for number in range(shape.bellow_number):
        start, middle, end = 2 * half * number, half * (2 * number + 1), 2 * half * (number + 1)
        pieces.append(
            Arc(
                (start, low - trough),
                (start + trough * slant, low - trough * slant),
                (start + trough, low),
            )
        )
        if shape.flank > _NO_FLANK:
            pieces.append(Line((start + trough, low), (middle - crest, high)))
        pieces += [
            Arc(
                (middle - crest, high),
                (middle - crest * slant, high + crest * slant),
                (middle, high + crest),
            ),
            Arc(
                (middle, high + crest),
                (middle + crest * slant, high + crest * slant),
                (middle + crest, high),
            ),
        ]
        if shape.flank > _NO_FLANK:
            pieces.append(Line((middle + crest, high), (end - trough, low)))
        pieces.append(
            Arc(
                (end - trough, low),
                (end - trough * slant, low - trough * slant),
                (end, low - trough),
            )
        )
    return tuple(pieces)


def scalloped(shape: AxisymmetricBellow, radius: float, top: float) -> tuple[Line | Arc, ...]:
    """Profile from z = 0: collar, arcs over chords at `radius`, and on to `top`."""
    cusps = [shape.collar + number * shape.pitch for number in range(shape.layers + 1)]
    arcs = [
        Arc((low, radius), ((low + high) / 2, radius + shape.sagitta), (high, radius))
        for low, high in pairwise(cusps)
    ]
    last = [Line((cusps[-1], radius), (top, radius))] if top - cusps[-1] > 1e-9 else []
    return (Line((0.0, radius), (shape.collar, radius)), *arcs, *last)
