"""Tetrahedra of the exact solid: the reference for what the hexahedra simplify."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.bellow import INLET_RADIUS
from rig.mechanics.mesh.bellow_bending import (
    BendingResolution,
    mesh_bending_bellow,
    rib_volume,
)
from rig.mechanics.mesh.bellow_tetrahedra import (
    TetrahedralBellowMesh,
    mesh_bending_bellow_tetrahedra,
)
from rig.mechanics.mesh.measure import (
    enclosed_volume,
    scaled_jacobian,
    solid_volume,
    vector_area,
)
from rig.spec.actuator import BellowBendingGeometry

pytest.importorskip("netgen.occ", reason="netgen is not installed")


@pytest.fixture(scope="module")
def geometry() -> BellowBendingGeometry:
    return BellowBendingGeometry.model_validate(
        {"family": "bellow-bending", "bellow_number": 1, "effective_length": 11}
    )


@pytest.fixture(scope="module")
def fine(geometry) -> TetrahedralBellowMesh:
    return mesh_bending_bellow_tetrahedra(geometry, 1.5e-3)


def test_volumes_are_those_of_the_exact_solid(fine):
    shape, mesh = fine.shape, fine.mesh
    inlet = np.pi * INLET_RADIUS**2 * shape.wall
    assert 2 * solid_volume(mesh) == pytest.approx(shape.soft_volume + inlet, rel=1e-3)
    cavity = enclosed_volume(mesh, mesh.boundaries["cavity"])
    assert 2 * cavity == pytest.approx(shape.cavity_volume, rel=1e-3)


def test_elements_are_valid_and_their_surface_is_closed(fine):
    assert scaled_jacobian(fine.mesh) > 0.05
    assert np.abs(vector_area(fine.mesh, fine.mesh.boundary_facets())).max() < 1e-12


def test_boundary_sets_are_those_of_the_hexahedra(fine, geometry):
    mesh = fine.mesh
    together = np.concatenate([np.asarray(facets) for facets in mesh.boundaries.values()])
    assert np.array_equal(np.sort(together), np.sort(mesh.boundary_facets()))
    hexahedra = mesh_bending_bellow(geometry, BendingResolution.level(1)).mesh
    assert set(mesh.boundaries) == set(hexahedra.boundaries)
    for name in ("clamped", "cap"):
        assert vector_area(mesh, mesh.boundaries[name]) == pytest.approx(
            vector_area(hexahedra, hexahedra.boundaries[name]), rel=1e-3, abs=1e-12
        )


def test_hexahedra_lack_the_ribs_and_nothing_else(fine, geometry):
    hexahedra = mesh_bending_bellow(geometry, BendingResolution.level(1)).mesh
    missing = 2 * (solid_volume(fine.mesh) - solid_volume(hexahedra))
    ribs = rib_volume(geometry)
    assert missing == pytest.approx(ribs, abs=3e-4 * 2 * solid_volume(fine.mesh))
