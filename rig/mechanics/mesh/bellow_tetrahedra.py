"""Half of the bending bellow (y >= 0) as curved quadratic tetrahedra, by netgen.

The toolbox's solid exactly, ribs under the channel's roof included, but for the air inlet: the
check of what `bellow_bending` simplifies, and the mesh for programs without 27-node hexahedra.
Netgen (LGPL) is an optional dependency.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skfem import ElementTetP2, MeshTet
from skfem.quadrature import get_quadrature

from rig.mechanics.bellow import BellowShape
from rig.mechanics.cad import brep
from rig.mechanics.cad.parts import bending_soft_body
from rig.mechanics.errors import MechanicsError
from rig.mechanics.mesh.curved import CurvedTet
from rig.mechanics.mesh.measure import jacobians
from rig.spec.actuator import BellowBendingGeometry

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_PLANE = 1e-9
_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
"""Vertices of netgen's nodes 4 to 9."""


@dataclass(frozen=True)
class TetrahedralBellowMesh:
    """Half of the soft body, metres; x along the axis, y >= 0, z up to the crests."""

    mesh: CurvedTet
    """10-node tetrahedra with the boundaries `clamped`, `cap`, `symmetry`, `cavity` and `outside`
    as in `bellow_bending`."""
    shape: BellowShape
    straightened: int
    """Elements whose curved edges were made straight because they would have been inverted."""


def mesh_bending_bellow_tetrahedra(
    geometry: BellowBendingGeometry, size: float | None = None
) -> TetrahedralBellowMesh:
    """Mesh the soft body with elements of at most `size` metres (default: twice the wall).

    Raises CadError where netgen is missing or the solid cannot be built, MechanicsError where
    its mesh is invalid.
    """
    shape = BellowShape.of(geometry)
    size = 2 * shape.wall if size is None else size
    points, elements = _netgen(geometry, size)
    mesh = _quadratic(points, elements)
    straightened = _straighten(mesh)
    boundary = mesh.boundary_facets()
    corner = mesh.p[:, mesh.facets[:, boundary]]
    length, wall = shape.effective_length, shape.wall

    def on(axis: int, value: float) -> Indices:
        return np.asarray(boundary[np.all(np.abs(corner[axis] - value) < _PLANE, axis=0)])

    sets = {"clamped": on(0, -wall), "cap": on(0, length + wall), "symmetry": on(1, 0.0)}
    rest = np.setdiff1d(boundary, np.concatenate(list(sets.values())))
    sets["cavity"], sets["outside"] = _inside_and_outside(mesh, rest)
    return TetrahedralBellowMesh(
        mesh=mesh.with_boundaries(sets, boundaries_only=False),
        shape=shape,
        straightened=straightened,
    )


@lru_cache(maxsize=4)
def _half_solid(geometry: BellowBendingGeometry) -> Any:
    """Exact half of the soft body; seconds of work, so kept for further sizes."""
    occ = brep.kernel()
    shape = BellowShape.of(geometry)
    reach = 2e3 * (shape.effective_length + shape.outer_radius)
    room = occ.Box(occ.Pnt(-reach, 0, -reach), occ.Pnt(reach, reach, reach))
    return (brep.build(bending_soft_body(shape, inlet=False)) * room).solids[0]


def _netgen(geometry: BellowBendingGeometry, size: float) -> tuple[Array, Indices]:
    """Nodes (n, 3) in metres and 10-node elements (m, 10) in netgen's order, from 0."""
    occ = brep.kernel()
    meshing = importlib.import_module("netgen.meshing")
    mesh = occ.OCCGeometry(_half_solid(geometry)).GenerateMesh(
        mp=meshing.MeshingParameters(
            maxh=size * brep.MILLIMETRE, curvaturesafety=1.5, segmentsperedge=1.0, grading=0.4
        )
    )
    mesh.SecondOrder()
    elements = mesh.Elements3D().NumPy()["nodes"][:, :10].astype(np.int64) - 1
    return np.asarray(mesh.Coordinates()) / brep.MILLIMETRE, elements


def _quadratic(points: Array, elements: Indices) -> CurvedTet:
    used, corners = np.unique(elements[:, :4], return_inverse=True)
    # netgen's elements are left-handed in scikit-fem's eyes
    corners = corners.reshape(-1, 4)[:, [1, 0, 2, 3]]
    linear = MeshTet(np.ascontiguousarray(points[used].T), np.ascontiguousarray(corners.T))
    mesh: CurvedTet = CurvedTet.from_mesh(linear)
    # scikit-fem has its own order of edges
    sorted_corners = used[mesh.t]
    place = np.argmax(elements[:, None, :4] == sorted_corners.T[:, :, None], axis=2)
    between = np.zeros((4, 4), dtype=int)
    for number, (a, b) in enumerate(_EDGES):
        between[a, b] = between[b, a] = 4 + number
    for local, at in enumerate(np.asarray(ElementTetP2().doflocs)[4:], start=4):
        ends = _ends(at)
        column = between[place[:, ends[0]], place[:, ends[1]]]
        nodes = np.take_along_axis(elements, column[:, None], axis=1)[:, 0]
        mesh.doflocs[:, mesh.dofs.element_dofs[local]] = points[nodes].T
    for axis in (0, 1, 2):  # planes that netgen meets to a micrometre's millionth only
        mesh.doflocs[axis, np.abs(mesh.doflocs[axis]) < _PLANE / 10] = 0.0
    return mesh


def _ends(middle: Array) -> tuple[int, int]:
    """Local vertices of scikit-fem's tetrahedron whose middle this is."""
    vertex = np.asarray(ElementTetP2().doflocs)[:4]
    return next((a, b) for a, b in _EDGES if np.allclose((vertex[a] + vertex[b]) / 2, middle))


def _straighten(mesh: CurvedTet) -> int:
    """Straighten, in place, elements that curved edges turn inside out; returns how many."""
    quadrature, _ = get_quadrature(mesh.elem.refdom, 4)
    nodes = np.asarray(ElementTetP2().doflocs)
    points = np.hstack([quadrature, nodes.T])
    done: set[int] = set()
    while True:
        bad = np.flatnonzero(jacobians(mesh, points).min(axis=1) <= 0)
        if bad.size == 0:
            return len(done)
        if done.issuperset(bad):
            raise MechanicsError(
                f"Netgen's mesh has {bad.size} inverted elements even with straight edges. Choose "
                f"another element size."
            )
        done.update(bad.tolist())
        # straight edges may invert a neighbour: look again
        for local, at in enumerate(nodes[4:], start=4):
            a, b = (mesh.dofs.element_dofs[end, bad] for end in _ends(at))
            middle = (mesh.doflocs[:, a] + mesh.doflocs[:, b]) / 2
            mesh.doflocs[:, mesh.dofs.element_dofs[local, bad]] = middle


def _inside_and_outside(mesh: CurvedTet, facets: Indices) -> tuple[Indices, Indices]:
    """Split the surface between the planes into the cavity's and the outer one, which it parts.

    The two are not connected; the outer one reaches further up.
    """
    vertices = mesh.facets[:, facets]
    number = np.arange(facets.size)
    rows, columns = np.tile(number, 3), vertices.ravel()
    meets = coo_array((np.ones(rows.size), (rows, columns)), shape=(facets.size, mesh.nvertices))
    _, label = connected_components((meets @ meets.T).tocsr(), directed=False)
    top = mesh.p[2, vertices].max(axis=0)
    outer = label == label[np.argmax(top)]
    return facets[~outer], facets[outer]
