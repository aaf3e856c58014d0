"""Hexahedral mesh of the bending bellow against the closed form and quadrature of its shape."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from bellow_strategies import bending_bellows
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.mechanics.bellow import INLET_RADIUS, BellowShape
from rig.mechanics.mesh.bellow_bending import (
    BendingBellowMesh,
    BendingResolution,
    mesh_bending_bellow,
    rib_volume,
)
from rig.mechanics.mesh.measure import (
    enclosed_volume,
    scaled_jacobian,
    solid_volume,
    vector_area,
)
from rig.spec.actuator import BellowBendingGeometry


def bellow(**changes: float) -> BellowBendingGeometry:
    """Lengths in mm; the rest as in the paper's default."""
    return BellowBendingGeometry.model_validate({"family": "bellow-bending", **changes})


@pytest.fixture(scope="module")
def levels() -> list[BendingBellowMesh]:
    # two convolutions keep every kind of block
    short = bellow(bellow_number=2, effective_length=22)
    return [mesh_bending_bellow(short, BendingResolution.level(level)) for level in (0, 1)]


def half_volumes(shape: BellowShape, geometry: BellowBendingGeometry) -> tuple[float, float]:
    """Exact volumes of half the cavity and half the solid, without inlet and ribs."""
    ribs = rib_volume(geometry)
    inlet = np.pi * INLET_RADIUS**2 * shape.wall
    return (shape.cavity_volume + ribs) / 2, (shape.soft_volume + inlet - ribs) / 2


def test_volumes_converge_to_those_of_the_shape(levels):
    geometry = bellow(bellow_number=2, effective_length=22)
    errors = []
    for level in levels:
        cavity, solid = half_volumes(level.shape, geometry)
        errors.append(
            (
                abs(enclosed_volume(level.mesh, level.mesh.boundaries["cavity"]) / cavity - 1),
                abs(solid_volume(level.mesh) / solid - 1),
            )
        )
    coarse, fine = np.array(errors)
    assert np.all(coarse < 5e-4)
    assert np.all(fine < coarse / 8)  # third order or better


def test_ribs_left_out_are_small():
    assert 0 < rib_volume(bellow()) < 0.002 * BellowShape.of(bellow()).soft_volume


def test_surfaces_are_closed(levels):
    mesh = levels[0].mesh
    shape = levels[0].shape
    whole = vector_area(mesh, mesh.boundary_facets())
    assert np.abs(whole).max() < 1e-12
    # the cavity is open in the plane of symmetry only, by the area of its meridian section
    meridian = shape.effective_length * (shape.average_radius + shape.outer_radius)
    normal = vector_area(mesh, mesh.boundaries["cavity"])
    assert normal == pytest.approx([0.0, -meridian, 0.0], abs=1e-12)


def test_boundary_sets_are_disjoint_and_complete(levels):
    mesh = levels[0].mesh
    sets = [np.asarray(facets) for facets in mesh.boundaries.values()]
    together = np.concatenate(sets)
    assert set(mesh.boundaries) == {"clamped", "cap", "symmetry", "cavity", "outside"}
    assert np.array_equal(np.sort(together), np.sort(mesh.boundary_facets()))


def test_ends_have_the_area_of_the_end_wall(levels):
    shape, mesh = levels[1].shape, levels[1].mesh
    area = shape.cap_volume / shape.cap_thickness / 2
    near = vector_area(mesh, mesh.boundaries["clamped"])
    far = vector_area(mesh, mesh.boundaries["cap"])
    assert near == pytest.approx([-area, 0, 0], abs=2e-5 * area)
    assert far == pytest.approx([area, 0, 0], abs=2e-5 * area)


def test_the_cap_s_centre_is_that_of_the_face_it_covers(levels):
    shape, mesh = levels[1].shape, levels[1].mesh
    face = skfem.FacetBasis(mesh, mesh.elem(), facets=mesh.boundaries["cap"])
    height = np.asarray(face.global_coordinates())[2]
    centre = float(np.sum(height * face.dx) / np.sum(face.dx))
    assert shape.cap_centre[2] == pytest.approx(centre, rel=1e-4)
    thickness = shape.effective_length + shape.wall, shape.tip
    assert shape.cap_centre[0] == pytest.approx(np.mean(thickness))


def test_inner_nodes_of_the_crest_lie_on_its_torus(levels):
    """Every node of the cavity above the axis is r1 or r2 from a centre circle, or on a plane."""
    level = levels[0]
    shape, mesh = level.shape, level.mesh
    facets = mesh.boundaries["cavity"]
    dofs = mesh.dofs.get_facet_dofs(facets).all()
    x, y, z = mesh.doflocs[:, np.asarray(dofs)]
    above = (z > 1e-6) & (x > 1e-9) & (x < shape.effective_length - 1e-9)
    x, radius = x[above], np.hypot(y, z)[above]
    pitch = 2 * shape.half_pitch
    x = np.abs((x + shape.half_pitch) % pitch - shape.half_pitch)  # distance from the trough
    trough = np.hypot(x, radius - shape.inner_radius - shape.trough_arc) - shape.trough_arc
    crest = (
        np.hypot(x - shape.half_pitch, radius - shape.outer_radius + shape.crest_arc)
        - shape.crest_arc
    )
    flank = x - shape.trough_arc
    assert np.abs([trough, crest, flank]).min(axis=0).max() < 1e-12


def test_facets_can_be_integrated_by_scikit_fem(levels):
    level = levels[0]
    basis = skfem.FacetBasis(
        level.mesh, skfem.ElementHex2(), facets=level.mesh.boundaries["outside"], intorder=4
    )
    assert np.all(basis.dx > 0)


def test_elements_grow_in_proportion_to_convolutions():
    few = mesh_bending_bellow(bellow(bellow_number=3, effective_length=33)).mesh.nelements
    many = mesh_bending_bellow(bellow(bellow_number=12, effective_length=132)).mesh.nelements
    assert many < 4 * few


def test_default_actuator_has_good_elements():
    level = mesh_bending_bellow(bellow())
    assert scaled_jacobian(level.mesh) > 0.35


@settings(max_examples=12)
@given(geometry=bending_bellows(), wall=st.integers(1, 2), crown=st.integers(3, 8))
def test_no_element_is_inverted_over_the_constraint_range(geometry, wall, crown):
    resolution = BendingResolution(wall=wall, crown=crown)
    level = mesh_bending_bellow(geometry, resolution)
    assert scaled_jacobian(level.mesh) > 0
    assert np.abs(vector_area(level.mesh, level.mesh.boundary_facets())).max() < 1e-9
    cavity, solid = half_volumes(level.shape, geometry)
    assert enclosed_volume(level.mesh, level.mesh.boundaries["cavity"]) == pytest.approx(
        cavity, rel=0.02
    )
    assert solid_volume(level.mesh) == pytest.approx(solid, rel=0.02)
