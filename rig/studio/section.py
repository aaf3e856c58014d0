"""The cut through the middle of an actuator at rest, of every family: painted, not computed.

The parts are unions of solids less others (`rig.mechanics.cad.parts`); in the plane of symmetry
each of those is a polygon. Painted one over the other, the hollow ones last, they are the section.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.cad.construct import Arc, Combined, Line, Prism, Revolved, Solid
from rig.mechanics.cad.facets import circle_centre
from rig.mechanics.cad.parts import parts_of
from rig.spec.actuator import Geometry

Array = NDArray[np.float64]
Paint = Literal["soft", "rigid", "hollow"]

_ARC_CHORDS = 12


@dataclass(frozen=True)
class Outline:
    """A closed polygon, (n, 2) as (x, z) in m without a repeated point, and its paint."""

    points: Array
    paint: Paint


def section_of(geometry: Geometry) -> tuple[Outline, ...]:
    """Outlines in the order of painting; soft parts first, for what is rigid covers them."""
    return tuple(
        outline
        for part in parts_of(geometry)
        for outline in _painted(part.solid, "soft" if part.is_soft else "rigid")
    )


def _painted(solid: Solid, paint: Paint) -> Iterator[Outline]:
    match solid:
        case Combined():
            for added in solid.added:
                yield from _painted(added, paint)
            for removed in solid.removed:
                yield from _painted(removed, "hollow")
        case Prism():
            if (across := _rectangle(solid)) is not None:
                yield Outline(across, paint)
        case Revolved():
            yield Outline(_mirrored(solid), paint)


def _rectangle(solid: Prism) -> Array | None:
    """A prism across y = 0, between its lowest and highest point there; None if it stays off."""
    section = np.array(solid.section)
    y, z = section.T
    following = np.roll(section, -1, axis=0)
    heights = [float(h) for h, across in zip(z, y, strict=True) if across == 0.0]
    for (y0, z0), (y1, z1) in zip(section, following, strict=True):
        if y0 * y1 < 0:
            heights.append(float(z0 + (z1 - z0) * y0 / (y0 - y1)))
    if not heights:
        return None
    low, high = min(heights), max(heights)
    return np.array([[solid.start, low], [solid.end, low], [solid.end, high], [solid.start, high]])


def _mirrored(solid: Revolved) -> Array:
    axial, radial = _sampled(solid.profile).T
    upper = np.column_stack([axial, radial])
    lower = np.column_stack([axial, -radial])[::-1]
    both = np.concatenate([upper, lower])
    return both if solid.axis == "x" else both[:, ::-1]


def _sampled(profile: tuple[Line | Arc, ...]) -> Array:
    pieces = [
        np.array([piece.end]) if isinstance(piece, Line) else _sampled_arc(piece)[1:]
        for piece in profile
    ]
    return np.concatenate([np.array([profile[0].start]), *pieces])


def _sampled_arc(arc: Arc) -> Array:
    """By the circle through three points, from the first over the second to the third."""
    start, middle, end = (np.array(p) for p in (arc.start, arc.middle, arc.end))
    centre = circle_centre(start, middle, end)
    angles = [float(np.arctan2(*(p - centre)[::-1])) for p in (start, middle, end)]
    way = (angles[2] - angles[0]) % (2 * np.pi)
    if (angles[1] - angles[0]) % (2 * np.pi) > way:
        way -= 2 * np.pi
    turn = angles[0] + way * np.linspace(0.0, 1.0, _ARC_CHORDS + 1)
    radius = np.hypot(*(start - centre))
    return np.asarray(centre + radius * np.column_stack([np.cos(turn), np.sin(turn)]))
