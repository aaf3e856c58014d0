"""The surface of a model as triangles on its nodes, for pictures: outside, cavity and section.

Every second-order facet is cut at its own nodes, a quadrilateral into eight triangles and a
triangle into four, which turn counter-clockwise as seen from outside the solid.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Integers, Kinematics
from rig.mechanics.fe.errors import FiniteElementError
from rig.mechanics.fe.fields import numbering
from rig.mechanics.fe.model import Model

Array = NDArray[np.float64]

CAVITY = "cavity"
"""Name of the boundary inside the actuator."""
_ON_PLANE = 1e-9
"""Facets this near a plane of symmetry are the section there, relative to the mesh's size."""


@dataclass(frozen=True)
class Surface:
    """Triangles of the surface; one vertex a node and named boundary, so that edges stay sharp."""

    node: Integers
    """Displacement node of each vertex, (n,)."""
    entry: Integers
    """Each vertex's place in the nodal fields of all solids, one after another, (n,)."""
    outside: Integers
    """Vertices of the triangles that are seen from outside the whole body, (m, 3)."""
    inside: Integers
    """Those of the cavity and of the section in the plane of symmetry, (k, 3)."""


def surface_of(model: Model, mirror: int | None = None) -> Surface:
    """The surface of a model in space, half of a body across the plane normal to axis `mirror`.

    Raises FiniteElementError for models in the plane, which have no such surface.
    """
    d = model.discretisation
    if d.kinematics is not Kinematics.SOLID:
        raise FiniteElementError(
            f"a model in {d.kinematics.value} has no surface in space; write its fields with "
            "`write_vtu` instead."
        )
    facets = np.asarray(d.mesh.boundary_facets())
    owners = d.mesh.f2t[0, facets]
    local = np.argmax(d.mesh.t2f[:, owners] == facets, axis=0)
    node, elements = numbering(model)
    places = np.empty_like(d.connectivity)
    for solid, element in zip(model.solids, elements, strict=True):
        places[solid.elements] = element
    left_handed = _left_handed(d.nodes[d.connectivity[owners]], np.asarray(d.element.doflocs))
    part, hidden = _parts(d.mesh, facets)
    if mirror is not None:
        corners = d.mesh.p[mirror][d.mesh.facets[:, facets]]
        hidden |= np.abs(corners).max(axis=0) < _ON_PLANE * np.ptp(d.nodes, axis=0).max()
    found, unseen = [], []
    for number in range(len(d.mesh.elem.refdom.facets)):
        chosen = np.flatnonzero(local == number)
        cut = _cut(d.element, d.mesh.elem.refdom, number)
        own = places[owners[chosen]][:, cut]  # (facets, triangles, 3)
        own[left_handed[chosen]] = own[left_handed[chosen]][..., ::-1]
        found.append((part[chosen, None, None] * len(node) + own).reshape(-1, 3))
        unseen.append(np.repeat(hidden[chosen], len(cut)))
    keys, triangles = np.unique(np.concatenate(found), return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    inside = np.concatenate(unseen)
    entry = keys % len(node)
    return Surface(node[entry], entry, triangles[~inside], triangles[inside])


def _parts(mesh: Any, facets: Integers) -> tuple[Integers, NDArray[np.bool_]]:
    """Number of the named boundary each facet is on, and whether that is the cavity."""
    part = np.zeros(len(facets), dtype=np.int64)
    hidden = np.zeros(len(facets), dtype=bool)
    for number, (name, members) in enumerate(sorted((mesh.boundaries or {}).items()), start=1):
        on = np.isin(facets, members)
        part[on] = number
        if name == CAVITY:
            hidden |= on
    return part, hidden


def _left_handed(nodes: Array, places: Array) -> NDArray[np.bool_]:
    """Whether local axes are left-handed in elements with some nodes (elements, a, dim)."""
    slope = np.einsum("eai,aj->eij", nodes, places - places.mean(axis=0))
    return np.asarray(np.linalg.det(slope) < 0)


def _cut(element: Any, cell: Any, number: int) -> Integers:
    """Local nodes of the triangles that a facet of the reference cell is cut into, (t, 3)."""
    corners = cell.p[:, list(cell.facets[number])].T
    origin, first, second = corners[0], corners[1] - corners[0], corners[-1] - corners[0]
    if np.cross(first, second) @ (corners.mean(axis=0) - cell.p.mean(axis=1)) < 0:
        first, second = second, first
    doflocs = np.asarray(element.doflocs)

    def at(s: float, t: float) -> int:
        place = origin + s * first + t * second
        return int(np.argmin(np.linalg.norm(doflocs - place, axis=1)))

    steps = (0.0, 0.5, 1.0)
    triangles = []
    for s, s_next in pairwise(steps):
        for t, t_next in pairwise(steps):
            low, high = at(s, t), at(s_next, t_next)
            if len(corners) == 4 or s + t < 1 - 1e-9:
                triangles.append((low, at(s_next, t), at(s, t_next)))
            if len(corners) == 4 or s_next + t_next <= 1 + 1e-9:
                triangles.append((high, at(s, t_next), at(s_next, t)))
    return np.array(triangles, dtype=np.int64)
