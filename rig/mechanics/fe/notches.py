"""Edges at which the stress of an elastic solid has no limit: it grows with every finer mesh.

Where two faces of the surface meet at more than a straight angle inside the solid, and where a
clamp or a rigid body ends on a free face, stress grows like a negative power of the distance
(Williams, J. Appl. Mech. 19 (1952) 526). A maximum next to such an edge tells how fine the mesh
is, not how strong the body.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Discretisation, Integers
from rig.mechanics.fe.model import Model

Array = NDArray[np.float64]

_REENTRANT = np.radians(190.0)
"""Angle inside the solid that counts as a notch. Facets of a smooth wall meet at a straight angle
to within the accuracy of their second-order geometry."""
_CLAMP_END = np.radians(75.0)
"""Angle between a clamped and a free face that counts: a right angle is singular."""


class _Hold(IntEnum):
    FREE = 0
    SLIDING = 1
    """One component of every corner is held: a plane of symmetry, with the same solid beyond."""
    CLAMPED = 2


def near_notches(model: Model) -> NDArray[np.bool_]:
    """Whether each displacement node belongs to an element with a notch, (n,)."""
    d = model.discretisation
    is_notch = np.zeros(len(d.nodes), dtype=bool)
    is_notch[notch_nodes(model)] = True
    near = np.zeros(len(d.nodes), dtype=bool)
    near[d.connectivity[is_notch[d.connectivity].any(axis=1)]] = True
    return near


def notch_nodes(model: Model) -> Integers:
    """Middle nodes of the singular edges (corners of meshes in the plane), ascending."""
    edge, normal, inward, hold = _facet_edges(model)
    order = np.argsort(edge, kind="stable")
    found, start, count = np.unique(edge[order], return_index=True, return_counts=True)
    # edges where more than two facets of the surface meet have no one angle
    pair = count == 2
    one, other = order[start[pair]], order[start[pair] + 1]
    opening = np.arccos(np.clip(np.einsum("ei,ei->e", inward[one], inward[other]), -1.0, 1.0))
    outward = np.einsum("ei,ei->e", normal[one], inward[other])
    angle = np.where(outward > 0, 2 * np.pi - opening, opening)
    least, most = np.minimum(hold[one], hold[other]), np.maximum(hold[one], hold[other])
    whole = np.where((least == _Hold.FREE) & (most == _Hold.SLIDING), 2 * angle, angle)
    singular = (least == _Hold.FREE) & (whole > _REENTRANT)
    singular |= (least == _Hold.FREE) & (most == _Hold.CLAMPED) & (angle > _CLAMP_END)
    return np.asarray(found[pair][singular])


def _facet_edges(model: Model) -> tuple[Integers, Array, Array, Integers]:
    """For every edge of every facet of the surface its middle node, the facet's outward normal
    there, the direction into the facet across the edge, both (edges, dim), and how it is held."""
    d = model.discretisation
    mesh, cell = d.mesh, d.mesh.elem.refdom
    facets = np.asarray(mesh.boundary_facets())
    owners = mesh.f2t[0, facets]
    local = np.argmax(mesh.t2f[:, owners] == facets, axis=0)
    held = _held(model)
    places = np.asarray(d.element.doflocs, dtype=float)
    nodes, normals, inwards, holds = [], [], [], []
    for number, members in enumerate(cell.facets):
        own = owners[local == number]
        corners = cell.p[:, list(members)].T
        away = _outward(corners, cell.p.mean(axis=1))
        at = d.connectivity[own]
        hold = _hold(held[at[:, [_nearest(places, corner) for corner in corners]]])
        for middle, along in _edges(corners):
            slope = np.einsum("eai,aj->eij", d.nodes[at], _gradients(d, middle))
            inward = slope @ (corners.mean(axis=0) - middle)
            if along is not None:
                edge = _unit(slope @ along)
                inward -= np.einsum("ei,ei->e", inward, edge)[:, None] * edge
            nodes.append(at[:, _nearest(places, middle)])
            # covectors go over by the inverse: outward stays outward in left-handed elements
            normals.append(_unit(np.linalg.solve(slope.swapaxes(1, 2), away[:, None])[..., 0]))
            inwards.append(_unit(inward))
            holds.append(hold)
    return (
        np.concatenate(nodes),
        np.concatenate(normals),
        np.concatenate(inwards),
        np.concatenate(holds),
    )


def _edges(corners: Array) -> list[tuple[Array, Array | None]]:
    """Middles and directions of a reference facet's edges; of a line its ends, without one."""
    if len(corners) == 2:
        return [(corner, None) for corner in corners]
    after = np.roll(corners, -1, axis=0)
    return [((a + b) / 2, b - a) for a, b in zip(corners, after, strict=True)]


def _outward(corners: Array, centre: Array) -> Array:
    """Normal of a reference facet with these corners, away from the centre of the cell."""
    side = corners[1] - corners[0]
    if len(side) == 2:
        normal = np.array([side[1], -side[0]])
    else:
        normal = np.cross(side, corners[-1] - corners[0])
    return np.asarray(normal * np.sign(normal @ (corners.mean(axis=0) - centre)))


def _gradients(d: Discretisation, place: Array) -> Array:
    """Gradients of the shape functions by the local coordinates at one place, (a, dim)."""
    count = d.connectivity.shape[1]
    return np.stack([d.element.lbasis(place[:, None], i)[1][:, 0] for i in range(count)])


def _nearest(places: Array, place: Array) -> int:
    return int(np.argmin(np.linalg.norm(places - place, axis=1)))


def _held(model: Model) -> NDArray[np.bool_]:
    """Whether each displacement component is held or tied to a rigid body, (n, dim)."""
    d: Discretisation = model.discretisation
    held = np.zeros(d.size, dtype=bool)
    held[model.held] = True
    for body in model.bodies:
        held[body.dofs] = True
    return held[: d.displacement_size].reshape(-1, d.dim)


def _hold(held: NDArray[np.bool_]) -> Integers:
    """How facets are held whose corners are, (facets, corners, dim)."""
    components = np.all(held, axis=1).sum(axis=1)
    kinds = np.where(components > 0, int(_Hold.SLIDING), int(_Hold.FREE))
    return np.where(components == held.shape[2], int(_Hold.CLAMPED), kinds)


def _unit(vectors: Array) -> Array:
    """Vectors (n, dim) of length one; not a number where an element's corner has no angle."""
    with np.errstate(invalid="ignore"):
        return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
