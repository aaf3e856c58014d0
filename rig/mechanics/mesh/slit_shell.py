"""A slit shell on its core as second-order hexahedra: half (y >= 0), or a quarter (z >= 0, too).

Core and shell have the same lines round and along, so that points of the one lie on facets of the
other at rest. Where the shell is bonded they share nodes; elsewhere their nodes are apart, by a
clearance far below anything that matters.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import pi

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.mesh.curved import CurvedHex
from rig.mechanics.mesh.lattice import Block, Side, between, join, line, transfinite
from rig.mechanics.shells import SlitShell, Span

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CLEARANCE = 1e-8
"""Between core and shell at rest where they slide, metres: their nodes are not one."""
_SAME = 1e-9
_PLUG = 0.55
"""Half side of the square in the middle of a solid end, of the chamber's radius."""
_CORNER = 1.3
"""Distance of its corners from the axis, of its half side."""


@dataclass(frozen=True)
class ShellResolution:
    """How many elements; those of core and shell match."""

    ring: int = 2
    """Along a ring between two slits."""
    slit: int = 2
    """Along a slit, and along the half slits at the ends."""
    around: int = 8
    """Round the half y >= 0, between the edges of slits and planes of symmetry at least one."""
    wall: int = 2
    """Through the core's wall."""


@dataclass(frozen=True)
class SlitShellMesh:
    """Core and shell, metres."""

    mesh: CurvedHex
    """27-node hexahedra with the facet sets `clamped` and `cap` (both gripped ends, and the
    shell's and core's faces there), `symmetry` (y = 0), `floor` (z = 0 of a quarter), `cavity`,
    `core` (outside of the core, where the shell may slide), `lining` (inside of the shell, where
    it may), `outside` (of the shell) and `edges` (of its slits); together the whole boundary."""
    shell: Indices
    """Elements of the shell."""
    shape: SlitShell


def mesh_slit_shell(
    shape: SlitShell, resolution: ShellResolution, *, quarter: bool = False
) -> SlitShellMesh:
    """Mesh core and shell; `quarter` leaves out what is below z = 0, a plane of symmetry."""
    blocks = [*_core(shape, resolution, quarter), *_plugs(shape, resolution, quarter)]
    mesh, named = join([*blocks, *_shell(shape, resolution, quarter)])
    boundary = mesh.boundary_facets()
    corner = mesh.p[:, mesh.facets[:, boundary]]

    def on(axis: int, value: float) -> Indices:
        return np.asarray(boundary[np.all(np.abs(corner[axis] - value) < _SAME, axis=0)])

    named = {name: np.intersect1d(facets, boundary) for name, facets in named.items()}
    # faces of the shell's own ends, which the grips hold
    mine = named["edges"]
    at_start, at_end = (np.intersect1d(mine, on(0, x)) for x in (shape.start, shape.end))
    sets = {
        **named,
        "clamped": np.union1d(named["clamped"], at_start),
        "cap": np.union1d(named["cap"], at_end),
        "symmetry": on(1, 0.0),
        **({"floor": on(2, 0.0)} if quarter else {}),
    }
    planes = np.concatenate([sets[name] for name in ("symmetry", "floor") if name in sets])
    sets["edges"] = np.setdiff1d(mine, np.concatenate([planes, at_start, at_end]))
    mesh = mesh.with_boundaries(sets, boundaries_only=False)
    nearest = np.hypot(mesh.p[1, mesh.t], mesh.p[2, mesh.t]).min(axis=0)
    return SlitShellMesh(
        mesh=mesh,
        shell=np.flatnonzero(nearest > shape.core_radius - _SAME),
        shape=shape,
    )


def _core(shape: SlitShell, resolution: ShellResolution, quarter: bool) -> Iterator[Block]:
    radii = _lattice(shape.chamber_radius, shape.core_radius, resolution.wall)
    for span in shape.spans:
        x = _along(span, resolution)
        for low, high, count in _segments(shape, resolution, quarter):
            bonded = high <= shape.bonded + _SAME and _is_there(span, low, high)
            names: dict[Side, str] = {"i-": "cavity"}
            if not bonded:
                names["i+"] = "core"
            yield Block(_sector(radii, _lattice(low, high, count), x), names)


def _shell(shape: SlitShell, resolution: ShellResolution, quarter: bool) -> Iterator[Block]:
    for span in shape.spans:
        x = _along(span, resolution)
        for low, high, count in _segments(shape, resolution, quarter):
            if not _is_there(span, low, high):
                continue
            bonded = high <= shape.bonded + _SAME
            angle = _lattice(low, high, count)
            names: dict[Side, str] = {"i+": "outside"}
            names |= {"k-": "edges", "k+": "edges", "j-": "edges", "j+": "edges"}
            if not bonded:
                names["i-"] = "lining"
            block = _sector(np.linspace(shape.core_radius, shape.radius, 3), angle, x)
            free = (angle > shape.bonded + _SAME) | (shape.bonded == 0)
            outwards = _directions(angle)[None, :, None] * free[None, :, None, None]
            yield Block(block + CLEARANCE * outwards, names)


def _plugs(shape: SlitShell, resolution: ShellResolution, quarter: bool) -> Iterator[Block]:
    """Solid ends: round the chamber as its wall, inside a square and what is left round it."""
    ends = (
        (shape.start - shape.end_length, shape.start, "clamped", "k-", "k+"),
        (shape.end, shape.end + shape.end_length, "cap", "k+", "k-"),
    )
    radii = _lattice(shape.chamber_radius, shape.core_radius, resolution.wall)
    segments = list(_segments(shape, resolution, quarter))
    angle = np.concatenate([_lattice(*s)[: None if s is segments[-1] else -1] for s in segments])
    for low, high, name, outer, inner in ends:
        x = _lattice(low, high, 1)
        yield Block(_sector(radii, angle, x), {"i+": name, outer: name})  # type: ignore[dict-item]
        for patch in _disc(shape.chamber_radius, angle, quarter):
            nodes = np.empty((*patch.shape[:2], x.size, 3))
            nodes[..., 0] = x
            nodes[..., 1:] = patch[:, :, None]
            yield Block(nodes, {outer: name, inner: "cavity"})  # type: ignore[dict-item]


def _disc(radius: float, angle: Array, quarter: bool) -> list[Array]:
    """Patches (m, n, 2) of (y, z) that fill the half or quarter of a disc up to its rim."""
    rim = radius * _directions(angle)[:, 1:]
    elements = (angle.size - 1) // 2
    side = _PLUG * radius

    def corner(element: int) -> Array:
        return np.asarray(_CORNER * side / radius * rim[2 * element])

    if quarter:
        first = elements // 2
        corners = [np.array([side, 0.0]), corner(first), np.array([0.0, side])]
        counts = [first, elements - first]
    else:
        first = max(1, int(np.argmin(np.abs(angle[::2] - pi / 4))))
        first = min(first, (elements - 1) // 2)
        ends = np.array([[0.0, -side], [0.0, side]])
        corners = [ends[0], corner(first), corner(elements - first), ends[1]]
        counts = [first, elements - 2 * first, first]
    sides = [line(a, b, n) for (a, b), n in zip(pairwise(corners), counts, strict=True)]
    square = np.concatenate([s[: None if s is sides[-1] else -1] for s in sides])
    ring = between(square, rim, 1)
    if quarter:
        right, top = sides
        axis_y = line(np.zeros(2), np.array([side, 0.0]), counts[1])
        axis_z = line(np.zeros(2), np.array([0.0, side]), counts[0])
        # first index up, second across
        core = transfinite(axis_z, right, axis_y, top[::-1])
    else:
        low, right, high = sides
        axis = line(np.array([0.0, -side]), np.array([0.0, side]), counts[1])
        core = transfinite(axis, right, low, high[::-1])
    return [ring, core]


def _segments(
    shape: SlitShell, resolution: ShellResolution, quarter: bool
) -> Iterator[tuple[float, float, int]]:
    """Pieces round the core between the ends of all bridges: from, to, elements."""
    start = pi / 2 if quarter else 0.0
    lines = np.array([start, pi, *(v for s in shape.spans for b in s.bridges for v in b)])
    lines = np.unique(np.round(lines[lines >= start - _SAME], 12))
    kept = lines[np.append(True, np.diff(lines) > 1e-6)]
    size = pi / resolution.around
    for low, high in pairwise(kept):
        yield float(low), float(high), max(1, round((high - low) / size))


def _is_there(span: Span, low: float, high: float) -> bool:
    middle = (low + high) / 2
    return any(a < middle < b for a, b in span.bridges)


def _along(span: Span, resolution: ShellResolution) -> Array:
    count = resolution.ring if span.bridges == ((0.0, pi),) else resolution.slit
    return _lattice(span.start, span.end, count)


def _lattice(low: float, high: float, count: int) -> Array:
    """Lattice points of so many elements."""
    return np.linspace(low, high, 2 * count + 1)


def _directions(angle: Array) -> Array:
    """Outward unit vectors (n, 3) at angles from the lowest line."""
    sine, cosine = np.sin(angle), -np.cos(angle)
    for exact in (0.0, pi):
        sine[np.abs(angle - exact) < 1e-12] = 0.0
    cosine[np.abs(angle - pi / 2) < 1e-12] = 0.0
    return np.stack((np.zeros_like(angle), sine, cosine), axis=-1)


def _sector(radii: Array, angle: Array, x: Array) -> Array:
    """Lattice (r, angle, x, 3) of a piece of a tube."""
    nodes = radii[:, None, None, None] * _directions(angle)[None, :, None]
    nodes = np.repeat(nodes, x.size, axis=2)
    nodes[..., 0] = x
    return nodes
