"""Solutions as VTK files for ParaView: curved second-order cells with their fields, SI units.

Points are where the solid is at rest; `displacement` warps it. Nodes between two materials are
written for each, since stress jumps there. Symmetric tensors have VTK's order of components,
xx, yy, zz, xy, yz, xz. The end cap and other rigid bodies have no cells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np
import skfem
from numpy.typing import NDArray

from rig.mechanics.fe.discretisation import Integers
from rig.mechanics.fe.errors import FiniteElementError
from rig.mechanics.fe.fields import displacements, nodal_fields, numbering
from rig.mechanics.fe.model import Model
from rig.mechanics.fe.path import Solution

Array = NDArray[np.float64]

COLLECTION = "solutions.pvd"

_ON_PLANE = 1e-9
"""Nodes this near a plane of symmetry lie on it, relative to the size of the mesh."""
_CELLS = {
    skfem.ElementHex2: "hexahedron27",
    skfem.ElementTetP2: "tetra10",
    skfem.ElementQuad2: "quad9",
    skfem.ElementTriP2: "triangle6",
}
# local coordinates of VTK's nodes, from the documentation of vtkTriQuadraticHexahedron,
# vtkQuadraticTetra, vtkBiQuadraticQuad and vtkQuadraticTriangle; halves
VTK_PLACES = {
    "hexahedron27": (
        "000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 221 021 "
        "011 211 101 121 110 112 111"
    ),
    "tetra10": "000 200 020 002 100 110 010 001 101 011",
    "quad9": "00 20 22 02 10 21 12 01 11",
    "triangle6": "00 20 02 10 11 01",
}


@dataclass(frozen=True)
class Grid:
    """Points and cells of a file, and which fields belong to them."""

    points: Array
    """At rest in m, (n, 3)."""
    node: Integers
    """Displacement node of each point, (n,)."""
    entry: Integers
    """Each point's place in the nodal fields of all solids, one after another, (n,)."""
    sign: Array
    """Factors on the components of vectors, (n, 3): -1 for what a mirror turns round."""
    kind: str
    """Name of the cells in meshio."""
    blocks: tuple[Integers, ...]
    """Points of the cells in VTK's order, (cells, a); per solid, then per mirrored solid."""
    material: tuple[int, ...]
    """Number of the solid of each block."""


def write_vtu(
    folder: Path, model: Model, solutions: Sequence[Solution], *, mirror: int | None = None
) -> tuple[Path, ...]:
    """One file a solution and a collection of all, whose time is the pressure in kPa.

    `mirror` is the axis (0, 1, 2) across whose plane through the origin a half model is completed
    to the full body. Returns the files, the collection first. Raises FiniteElementError where
    there is nothing to write or the folder cannot be written to.
    """
    if not solutions:
        raise FiniteElementError(
            "there is no solution to write; solve for at least one pressure first."
        )
    grid = grid_of(model, mirror)
    names = [f"solution_{i:03d}.vtu" for i in range(len(solutions))]
    collection = folder / COLLECTION
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, solution in zip(names, solutions, strict=True):
            with_fields(grid, model, solution).write(folder / name)
        collection.write_text(_collection(names, solutions), encoding="utf-8", newline="\n")
    except OSError as error:
        raise FiniteElementError(
            f"the fields cannot be written to {folder}: {error.strerror}. Name a folder that you "
            "may write to."
        ) from error
    return (collection, *(folder / name for name in names))


def grid_of(model: Model, mirror: int | None = None) -> Grid:
    """Points and cells of a model, completed across the plane through the origin normal to
    axis `mirror`."""
    d = model.discretisation
    kind = _CELLS[type(d.element)]
    order = _matching(_places(kind), np.asarray(d.element.doflocs))
    node, elements = numbering(model)
    blocks = [element[:, order] for element in elements]
    entry = np.arange(len(node))
    points = np.zeros((len(node), 3))
    points[:, : d.dim] = d.nodes[node]
    sign = np.ones_like(points)
    material = tuple(range(len(blocks)))
    if mirror is not None:
        off = np.abs(points[:, mirror]) > _ON_PLANE * float(np.ptp(d.nodes, axis=0).max())
        twin = np.where(off, len(node) + np.cumsum(off) - 1, entry)
        turned = np.ones(3)
        turned[mirror] = -1.0
        blocks += [twin[block] for block in blocks]
        points = np.concatenate((points, points[off] * turned))
        sign = np.concatenate((sign, sign[off] * turned))
        node, entry = np.append(node, node[off]), np.append(entry, entry[off])
        material *= 2
    right_handed = tuple(_right_handed(points, block, kind) for block in blocks)
    return Grid(points, node, entry, sign, kind, right_handed, material)


def with_fields(grid: Grid, model: Model, solution: Solution) -> meshio.Mesh:
    """The grid with the fields of one solution."""
    d = model.discretisation
    found = nodal_fields(model, solution.state)
    displacement = np.zeros((len(d.nodes), 3))
    displacement[:, : d.dim] = displacements(d, solution.state)

    def gathered(values: Sequence[Array]) -> Array:
        """Per solid (..., nodes) to (points, ...)."""
        return np.asarray(np.moveaxis(np.concatenate(values, axis=-1), -1, 0)[grid.entry])

    def tensor(values: Sequence[Array]) -> Array:
        turned = gathered(values) * grid.sign[:, :, None] * grid.sign[:, None, :]
        return np.asarray(turned[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]])

    data = {
        "displacement": grid.sign * displacement[grid.node],
        "von_mises": gathered([fields.von_mises for fields in found]),
        "pressure": gathered([fields.pressure for fields in found]),
        "principal_stress": gathered([fields.principal_stress for fields in found]),
        "principal_stretch": gathered([fields.principal_stretch for fields in found]),
        "cauchy_stress": tensor([fields.stress for fields in found]),
        "log_strain": tensor([fields.log_strain for fields in found]),
    }
    return meshio.Mesh(
        grid.points,
        [(grid.kind, block) for block in grid.blocks],
        point_data={name: values.astype(np.float32) for name, values in data.items()},
        cell_data={
            "material": [
                np.full(len(block), number, dtype=np.int32)
                for block, number in zip(grid.blocks, grid.material, strict=True)
            ]
        },
    )


def _collection(names: Sequence[str], solutions: Sequence[Solution]) -> str:
    lines = [
        f'    <DataSet timestep="{solution.pressure / 1e3:.9g}" file="{name}"/>'
        for name, solution in zip(names, solutions, strict=True)
    ]
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            "<!-- timestep is the pressure of the cavity in kPa; all else is in SI units -->",
            '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">',
            "  <Collection>",
            *lines,
            "  </Collection>",
            "</VTKFile>",
            "",
        ]
    )


def _places(kind: str) -> Array:
    """Local coordinates of VTK's nodes, (a, dim)."""
    return np.array([[int(c) / 2 for c in word] for word in VTK_PLACES[kind].split()])


def _matching(wanted: Array, given: Array) -> Integers:
    """For every place wanted its row among those given."""
    same = np.all(np.abs(wanted[:, None] - given[None]) < 1e-12, axis=2)
    return np.asarray(np.argmax(same, axis=1), dtype=np.int64)


def _right_handed(points: Array, block: Integers, kind: str) -> Integers:
    """Cells whose local axes are left-handed renumbered, as VTK wants; (cells, a)."""
    places = _places(kind)
    dim = places.shape[1]
    centred = places - places.mean(axis=0)
    # the affine part of the map from local coordinates, but for a positive definite factor
    slope = np.einsum("eai,aj->eij", points[block][..., :dim], centred)
    left_handed = np.linalg.det(slope) < 0
    swapped = _matching(places[:, [1, 0, *range(2, dim)]], places)
    return np.where(left_handed[:, None], block[:, swapped], block)
