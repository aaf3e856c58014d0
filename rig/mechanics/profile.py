"""Deformed shape of the bending bellow as a function of the bending angle alone.

Kinematics, after the assumptions of Section IV-A of the paper: constant curvature, the underside
of the bottom layer keeps its length L (eq. (9) measures the length difference from there), cross
sections stay plane, end walls, end cap and connector are rigid. Every half convolution unfolds in
its own wedge between two cross sections: the closure equations of `rig.mechanics.convolution`
keep its lengths. Unfolding makes it shallower; `TROUGH_RISE` says how the two ends share that.

Pure geometry: the beam model uses it, and so may a specimen whose angle comes from elsewhere.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.mechanics.bellow import BellowShape
from rig.mechanics.convolution import UNFOLDED, Unfolded, unfold
from rig.mechanics.response import SideProfile
from rig.mechanics.section import disc_union
from rig.spec.actuator import BellowBendingGeometry

Array = NDArray[np.float64]

TROUGH_RISE = 2 / 3
"""Share of the lost depth by which troughs rise; crests sink by the rest.

Not in the paper, whose theory neglects radial motion. Two thirds makes the work of pressure on
the straight default actuator that of a piston of the mean radius within 3 %, the usual effective
area of bellows; an even share would let the cavity of some bellows shrink before they are unfolded.
"""

_STRAIGHT = 1e-7
"""Angles in rad below this are evaluated here: wedge closure divides by the curvature."""

_ARC_POINTS = 10
_BOTTOM_POINTS = 49
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


class BentBar(Protocol):
    """What bends to an arc, metres."""

    @property
    def effective_length(self) -> float:
        """Length from x = 0 on that bends; what lies beyond stays straight."""
        ...

    @property
    def underside(self) -> float:
        """z of the fibre that keeps its length."""
        ...


def wrap(shape: BentBar, angle: ArrayLike, x: ArrayLike, height: ArrayLike) -> Array:
    """Place material points of the bent actuator in the plane of bending, (..., 2) as (x, z).

    `x` is the coordinate along the underside before bending, `height` the distance from the
    underside, metres; parts before x = 0 and after x = L stay straight. `angle` in rad.
    """
    angle, x, height = (np.asarray(value, dtype=float) for value in (angle, x, height))
    along = np.clip(x, 0.0, shape.effective_length)
    beyond = x - along
    turn = angle * along / shape.effective_length
    sine, cosine = np.sin(turn), np.cos(turn)
    chord = along * np.sinc(turn / (2 * np.pi))
    return np.stack(
        [
            chord * np.cos(turn / 2) + height * sine + beyond * cosine,
            shape.underside - chord * np.sin(turn / 2) + height * cosine - beyond * sine,
        ],
        axis=-1,
    )


def tip_position(geometry: BellowBendingGeometry, angle: ArrayLike) -> Array:
    """Workspace: far lower edge of the end cap at each angle in rad, (..., 2) as (x, z) in m."""
    shape = BellowShape.of(geometry)
    return wrap(shape, angle, shape.tip, 0.0)


def bent_convolution(geometry: BellowBendingGeometry, angle: ArrayLike) -> Unfolded:
    """Half convolution of the actuator bent by `angle` in rad, arrays of its shape."""
    return _unfolded(BellowShape.of(geometry), _curved(angle))[0]


@lru_cache(maxsize=64)
def unfolding_angle(geometry: BellowBendingGeometry) -> float:
    """Bending angle in rad at which the convolutions of `side_profile` are straight.

    Beyond it the profile stretches instead of unfolding.
    """
    from scipy.optimize import brentq

    def arcs_left(angle: float) -> float:
        bent = bent_convolution(geometry, angle)
        return float(bent.trough_angle) - UNFOLDED - (float(bent.stretch) - 1.0)

    high = min(2, geometry.bellow_number) * np.pi  # symmetry lines at a right angle at most
    return float(brentq(arcs_left, 0.0, high)) if arcs_left(high) < 0 else high


def side_profile(geometry: BellowBendingGeometry, angle: float) -> SideProfile:
    """Outlines in the plane of bending for a bending angle in rad, about -0.26 to 3.

    Each outline is closed without repeating its first point and runs counter-clockwise with x to
    the right and z up. The end cap is the undeformed one, turned by exactly `angle`. Where
    neighbouring outer flanks would touch (thick walls bent backwards) the outline is cut at the
    symmetry line of the trough. Near the ends the troughs stay as high as in the middle.
    """
    shape = BellowShape.of(geometry)
    wall, length, tip = shape.wall, shape.effective_length, shape.tip
    top = shape.end_wall_top - shape.underside
    along = np.concatenate([[-wall], np.linspace(0.0, length, _BOTTOM_POINTS), [length + wall]])
    surface_x, surface_height = _outer_surface(shape, angle)
    # material coordinates of all bent parts, placed together: one call costs less than four
    parts = [
        (along, np.zeros_like(along)),
        (along, np.full_like(along, shape.bottom_thickness)),
        (np.array([length + wall, length]), np.array([top, top])),
        (surface_x[::-1], surface_height[::-1]),
        (np.array([0.0, -wall]), np.array([top, top])),
        (np.array([length + wall, tip, tip, length + wall]), np.array([0.0, 0.0, top, top])),
    ]
    x, height = (np.concatenate(column) for column in zip(*parts, strict=True))
    placed = wrap(shape, angle, x, height)
    floor, cap = along.size, placed.shape[0] - 4
    return SideProfile(
        connector=_connector(shape),
        bellow=placed[floor:cap],
        bottom_layer=np.concatenate([placed[:floor], placed[2 * floor - 1 : floor - 1 : -1]]),
        end_cap=placed[cap:],
    )


def cavity_volume(geometry: BellowBendingGeometry, angle: ArrayLike) -> Array:
    """Volume of the cavity in m3 at each bending angle in rad, same shape.

    Cross sections stay plane and turn about the centre of curvature (Pappus); each is the union
    of the undeformed channel with a disc about the axis whose radius is the deformed height of
    the inner surface above the axis. Exact for the undeformed actuator.
    """
    shape = BellowShape.of(geometry)
    angle = _curved(angle)
    half, curvature, trough_height = _unfolded(shape, angle)
    axis = -shape.underside
    weight, height = _inner_surface(shape, half, curvature, trough_height)
    section = disc_union(height - axis, shape.channel_section)
    lever = curvature[..., np.newaxis]
    density = section.area * (1 + lever * axis) + lever * section.moment
    return np.asarray(2 * shape.bellow_number * np.sum(density * weight, axis=-1))


def _connector(shape: BellowShape) -> Array:
    near, far = -shape.wall - shape.connector_thickness, -shape.wall
    bottom, top = shape.underside, shape.end_wall_top + shape.wall
    return np.array([[near, bottom], [far, bottom], [far, top], [near, top]])


def _curved(angle: ArrayLike) -> Array:
    angle = np.asarray(angle, dtype=float)
    return np.where(np.abs(angle) < _STRAIGHT, _STRAIGHT, angle)


def _unfolded(shape: BellowShape, angle: Array) -> tuple[Unfolded, Array, Array]:
    """Half convolution, curvature of the underside and height of the trough's middle surface."""
    curvature = angle / shape.effective_length
    wedge = angle / (2 * shape.bellow_number)
    sine, cosine = np.sin(wedge), np.cos(wedge)
    # height of the middle surface that stays where it is, from trough (0) to crest (1)
    fixed = shape.inner_radius + TROUGH_RISE * (shape.outer_radius - shape.inner_radius)
    fixed_height = fixed + shape.wall / 2 - shape.underside
    share = (1 - TROUGH_RISE) * cosine + TROUGH_RISE
    half = unfold(
        shape.middle_surface,
        width=sine / share * (1 / curvature + fixed_height),
        wedge=wedge,
        slope=(1 - TROUGH_RISE) * sine / share,
    )
    # crest distance times cosine, less v and less the underside's distance 1 / curvature, written
    # so that it keeps its digits when nearly straight
    lost = 2 * np.sin(wedge / 2) ** 2 / curvature + half.v
    trough_height = (fixed_height * cosine - TROUGH_RISE * lost) / share
    return half, curvature, trough_height


def _outer_surface(shape: BellowShape, angle: float) -> tuple[Array, Array]:
    """Material coordinates (x, height) of the outer surface from x = 0 to L."""
    half, curvature, trough_height = _unfolded(shape, _curved(angle))
    share = np.linspace(0.0, 1.0, _ARC_POINTS)
    trough = max(float(half.trough_radius) - shape.wall / 2, 0.0)
    turn = share * half.trough_angle
    u_trough = trough * np.sin(turn)
    v_trough = half.trough_radius - trough * np.cos(turn)
    crest = half.crest_radius + shape.wall / 2
    heading = half.trough_angle - share * half.crest_angle
    wedge = half.crest_angle - half.trough_angle
    u_crest = half.u - half.crest_radius * np.sin(wedge) - crest * np.sin(heading)
    v_crest = half.v - half.crest_radius * np.cos(wedge) + crest * np.cos(heading)
    x, height = _unwrap(
        curvature,
        trough_height,
        np.concatenate([u_trough, u_crest]),
        np.concatenate([v_trough, v_crest]),
    )
    pitch = 2 * shape.half_pitch
    x = np.clip(x, 0.0, shape.half_pitch)
    x = np.concatenate([x, pitch - x[-2:0:-1]])
    height = np.concatenate([height, height[-2:0:-1]])
    starts = pitch * np.arange(shape.bellow_number)[:, np.newaxis]
    return (
        np.append((starts + x).ravel(), shape.effective_length),
        np.append(np.tile(height, shape.bellow_number), height[0]),
    )


def _inner_surface(
    shape: BellowShape, half: Unfolded, curvature: Array, trough_height: Array
) -> tuple[Array, Array]:
    """Quadrature over the inner surface of half a convolution: dx weights, heights; (..., n)."""
    share, share_weight = (_NODES + 1) / 2, _WEIGHTS / 2
    column = (Ellipsis, np.newaxis)
    trough_angle, crest_angle = half.trough_angle[column], half.crest_angle[column]
    wedge = crest_angle - trough_angle
    trough = half.trough_radius[column] + shape.wall / 2
    crest = half.crest_radius[column] - shape.wall / 2
    flank = half.flank[column]
    # heading of the surface along trough arc, flank, crest arc, and length per share
    rising = share * trough_angle
    falling = trough_angle - share * crest_angle
    u_flank = trough * np.sin(trough_angle) + share * flank * np.cos(trough_angle)
    v_flank = (
        half.trough_radius[column]
        - trough * np.cos(trough_angle)
        + share * flank * np.sin(trough_angle)
    )
    centre_u = half.u[column] - half.crest_radius[column] * np.sin(wedge)
    centre_v = half.v[column] - half.crest_radius[column] * np.cos(wedge)
    u = np.concatenate([trough * np.sin(rising), u_flank, centre_u - crest * np.sin(falling)], -1)
    v = np.concatenate(
        [
            half.trough_radius[column] - trough * np.cos(rising),
            v_flank,
            centre_v + crest * np.cos(falling),
        ],
        -1,
    )
    heading = np.concatenate([rising, np.broadcast_to(trough_angle, u_flank.shape), falling], -1)
    speed = np.concatenate(
        [
            np.broadcast_to(trough * trough_angle, u_flank.shape),
            np.broadcast_to(flank, u_flank.shape),
            np.broadcast_to(crest * crest_angle, u_flank.shape),
        ],
        -1,
    )
    x, height = _unwrap(curvature[column], trough_height[column], u, v)
    turn = curvature[column] * x
    radial = 1 + curvature[column] * height
    dx = speed * np.cos(heading + turn) / radial
    return dx * np.tile(share_weight, 3), height


def _unwrap(curvature: Array, trough_height: Array, u: Array, v: Array) -> tuple[Array, Array]:
    """Material coordinates (x, height) of points in the plane frame of a trough."""
    rise = trough_height + v
    across, along = curvature * u, 1 + curvature * rise
    x = np.arctan2(across, along) / curvature
    distance = np.hypot(across, along)
    height = (curvature * u**2 + 2 * rise + curvature * rise**2) / (distance + 1)
    return x, height
