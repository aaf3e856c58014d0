"""VTK files read back: node order, volumes, places, fields, the mirrored half, bad folders."""

from __future__ import annotations

import itertools
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import skfem
from numpy.polynomial.legendre import leggauss

from rig.mechanics.fe import (
    FiniteElementError,
    Model,
    Options,
    Point,
    Solid,
    Support,
    discretise,
    follow,
    nodal_fields,
)
from rig.mechanics.fe.vtu import grid_of, write_vtu
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume
from rig.mechanics.mesh.curved import CurvedHex
from tests.mechanics.fe_problems import BULK, SHEAR, bending_tube, driven, meshes

MESHES = meshes()

# shape functions by VTK's documented node order, written anew: 1D quadratics in the order 0, 1, 1/2
_LINE = (
    (lambda s: (1 - s) * (1 - 2 * s), lambda s: 4 * s - 3),
    (lambda s: s * (2 * s - 1), lambda s: 4 * s - 1),
    (lambda s: 4 * s * (1 - s), lambda s: 4 - 8 * s),
)
_HEX = [
    *[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
    *[(2, 0, 0), (1, 2, 0), (2, 1, 0), (0, 2, 0), (2, 0, 1), (1, 2, 1), (2, 1, 1), (0, 2, 1)],
    *[(0, 0, 2), (1, 0, 2), (1, 1, 2), (0, 1, 2)],
    *[(0, 2, 2), (1, 2, 2), (2, 0, 2), (2, 1, 2), (2, 2, 0), (2, 2, 1), (2, 2, 2)],
]


def _volume(corners: np.ndarray) -> np.ndarray:
    """Volumes of triquadratic hexahedra, (cells,), signed; places (cells, 27, 3) in VTK's order."""
    points, weights = leggauss(4)
    total = np.zeros(len(corners))
    for (i, s), (j, t), (k, r) in itertools.product(enumerate((points + 1) / 2), repeat=3):
        slopes = np.array(
            [
                [
                    _LINE[a][1](s) * _LINE[b][0](t) * _LINE[c][0](r),
                    _LINE[a][0](s) * _LINE[b][1](t) * _LINE[c][0](r),
                    _LINE[a][0](s) * _LINE[b][0](t) * _LINE[c][1](r),
                ]
                for a, b, c in _HEX
            ]
        )
        jacobian = np.einsum("eai,aj->eij", corners, slopes)
        total += weights[i] * weights[j] * weights[k] / 8 * np.linalg.det(jacobian)
    return total


def _bulged_box() -> CurvedHex:
    """A unit box with y >= 0 whose elements are curved inside and at the top and the end."""
    mesh = skfem.MeshHex().refined(1)
    curved = CurvedHex.from_mesh(mesh)
    x, y, z = curved.doflocs
    curved.doflocs[:] = np.stack((x + 0.1 * x * y**2, y, z + 0.2 * z * x * (1 - x)))
    return curved


def _sheared(mesh, amount: float = 0.5):
    """The mesh moved as u_x = amount z everywhere, and its only solution."""
    d = discretise(mesh)
    solid = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))
    slope = np.zeros((3, 3))
    slope[0, 2] = amount
    model = driven(d, [solid], slope)
    result = follow(model, [Point(0.0)], options=Options(tolerance=1e-9))
    assert result.failure is None
    return model, result.solutions


def test_hexahedra_are_written_in_vtks_order_with_their_curved_volume(tmp_path: Path) -> None:
    model, solutions = _sheared(_bulged_box())
    write_vtu(tmp_path, model, solutions)
    found = meshio.read(tmp_path / "solution_000.vtu")
    assert [block.type for block in found.cells] == ["hexahedron27"]
    volumes = _volume(found.points[found.cells[0].data])
    d = model.discretisation
    np.testing.assert_allclose(np.sort(volumes), np.sort(d.weights.sum(axis=1)), rtol=1e-12)
    assert volumes.min() > 0
    # the places of edge, face and body nodes, which no volume of a straight cell would miss
    middle = found.points[found.cells[0].data[:, 26]]
    corners = d.nodes[d.connectivity]
    centre = corners[:, np.all(d.element.doflocs == 0.5, axis=1)][:, 0]
    np.testing.assert_allclose(middle, centre, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "kind", "nodes"),
    [
        ("tetrahedra", "tetra10", 10),
        ("plane quads", "quad9", 9),
        ("plane triangles", "triangle6", 6),
        ("axisymmetric quads", "quad9", 9),
    ],
)
def test_middle_nodes_of_other_cells_sit_between_their_corners(
    name: str, kind: str, nodes: int
) -> None:
    mesh, kinematics = MESHES[name]
    d = discretise(mesh, kinematics)
    grid = grid_of(Model(d, [Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))]))
    assert grid.kind == kind
    (cells,) = grid.blocks
    assert cells.shape == (len(d.connectivity), nodes)
    places = grid.points[cells]
    # the edges whose middles follow the corners, from VTK's documentation
    edges = {
        "tetra10": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
        "quad9": [(0, 1), (1, 2), (2, 3), (3, 0)],
        "triangle6": [(0, 1), (1, 2), (2, 0)],
    }[kind]
    corners = {"tetra10": 4, "quad9": 4, "triangle6": 3}[kind]
    for number, (a, b) in enumerate(edges):
        between = (places[:, a] + places[:, b]) / 2
        np.testing.assert_allclose(places[:, corners + number], between, atol=1e-14)
    # right-handed: VTK's normals and volumes have the right sign
    sides = places[:, 1:corners] - places[:, :1]
    if kind == "tetra10":
        assert np.linalg.det(sides).min() > 0
    else:
        assert np.linalg.det(sides[:, [0, -1], :2]).min() > 0


def test_fields_read_back_are_those_of_the_solution(tmp_path: Path) -> None:
    model, solutions = _sheared(_bulged_box())
    write_vtu(tmp_path, model, solutions)
    found = meshio.read(tmp_path / "solution_000.vtu")
    expected = np.zeros_like(found.points)
    expected[:, 0] = 0.5 * found.points[:, 2]
    np.testing.assert_allclose(found.point_data["displacement"], expected, atol=1e-7)
    (fields,) = nodal_fields(model, solutions[0].state)
    np.testing.assert_allclose(found.point_data["von_mises"], fields.von_mises, rtol=1e-6)
    np.testing.assert_allclose(found.point_data["pressure"], fields.pressure, rtol=1e-4, atol=1)
    np.testing.assert_allclose(
        found.point_data["principal_stretch"], fields.principal_stretch.T, rtol=1e-6
    )
    # shear in the x-z plane: VTK puts xz last
    stress = found.point_data["cauchy_stress"]
    np.testing.assert_allclose(stress[:, 5], 0.5 * SHEAR, rtol=1e-4)
    np.testing.assert_allclose(stress[:, 3:5], 0.0, atol=1e-4 * SHEAR)


def test_a_half_model_is_mirrored_to_the_full_body(tmp_path: Path) -> None:
    tube = bending_tube()
    result = follow(tube.model, [Point(1e3), Point(2e3)])
    assert result.failure is None
    files = write_vtu(tmp_path, tube.model, result.solutions, mirror=1)
    found = meshio.read(files[-1])
    cells = np.concatenate([block.data for block in found.cells])
    volumes = _volume(found.points[cells])
    assert volumes.min() > 0
    half = tube.discretisation.weights.sum()
    assert volumes.sum() == pytest.approx(2 * half)
    # nodes of the plane of symmetry are shared: the halves hang together
    on_plane = np.abs(tube.discretisation.nodes[:, 1]) < 1e-12
    assert len(found.points) == 2 * len(on_plane) - on_plane.sum()
    assert len(np.unique(found.points.round(12), axis=0)) == len(found.points)
    # what the mirror does to a vector and to a tensor
    order = np.lexsort(found.points.round(12).T)
    image = np.lexsort((found.points * [1, -1, 1]).round(12).T)
    moved, stress = found.point_data["displacement"], found.point_data["cauchy_stress"]
    np.testing.assert_allclose(moved[order], moved[image] * [1, -1, 1], atol=1e-9)
    off = np.abs(found.points[order, 1]) > 1e-12
    turned = stress[image] * [1, 1, 1, -1, -1, 1]
    np.testing.assert_allclose(stress[order][off], turned[off], atol=1e-2)
    assert np.abs(moved[:, 1]).max() > 1e-5
    assert np.abs(stress[:, 3]).max() > 100
    # the deformed body holds the volume of an almost incompressible solid
    after = _volume((found.points + moved)[cells])
    assert after.sum() == pytest.approx(volumes.sum(), rel=2e-3)


def test_the_collection_names_every_file_with_its_pressure(tmp_path: Path) -> None:
    tube = bending_tube(along=2)
    result = follow(tube.model, [Point(500.0), Point(1e3)])
    files = write_vtu(tmp_path / "new" / "folder", tube.model, result.solutions)
    sets = ElementTree.parse(files[0]).getroot().findall("Collection/DataSet")
    assert [float(s.attrib["timestep"]) for s in sets] == [0.5, 1.0]
    assert [files[0].parent / s.attrib["file"] for s in sets] == list(files[1:])
    assert all(file.is_file() for file in files)


def test_materials_are_told_apart(tmp_path: Path) -> None:
    d = discretise(skfem.MeshHex().refined(1))
    upper = d.nodes[d.connectivity].mean(axis=1)[:, 2] > 0.5
    solids = [
        Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK), np.flatnonzero(~upper)),
        Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK), np.flatnonzero(upper)),
    ]
    edge = np.unique(d.basis.get_dofs().flatten())
    model = Model(d, solids, supports=[Support(3 * edge + i, 0.0 * edge) for i in range(3)])
    files = write_vtu(tmp_path, model, follow(model, [Point(0.0)]).solutions)
    found = meshio.read(files[1])
    material = np.concatenate(found.cell_data["material"])
    cells = np.concatenate([block.data for block in found.cells])
    height = found.points[cells].mean(axis=1)[:, 2]
    np.testing.assert_array_equal(material == 1, height > 0.5)
    assert len(found.points) == len(d.nodes) + 25


def test_bad_folders_and_nothing_to_write_are_refused(tmp_path: Path) -> None:
    tube = bending_tube(along=2)
    with pytest.raises(FiniteElementError, match="no solution to write"):
        write_vtu(tmp_path, tube.model, [])
    blocked = tmp_path / "file"
    blocked.write_text("")
    result = follow(tube.model, [Point(100.0)])
    with pytest.raises(FiniteElementError, match=r"cannot be written to .*file"):
        write_vtu(blocked, tube.model, result.solutions)
