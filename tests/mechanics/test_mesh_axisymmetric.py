"""Meridian mesh of the axisymmetric bellow against closed forms and the paper's description."""

from __future__ import annotations

import csv

import numpy as np
import pytest
import skfem
from bellow_strategies import axisymmetric_bellows
from conftest import SHARED_DATA
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.mechanics.fe import Kinematics, PressureSurface, discretise
from rig.mechanics.mesh.bellow_axisymmetric import (
    AxisymmetricBellow,
    AxisymmetricResolution,
    mesh_axisymmetric_bellow,
)
from rig.mechanics.mesh.measure import (
    enclosed_volume_of_revolution,
    scaled_jacobian,
    vector_area,
    volume_of_revolution,
)
from rig.spec.actuator import BellowAxisymmetricGeometry

TABLE_2 = SHARED_DATA / "auysakul2023" / "table2.csv"


def test_volumes_converge_to_the_closed_form():
    shape = AxisymmetricBellow(wall=0.0045, layers=6, divided_ratio=3.0)
    errors = []
    for level in (0, 1):
        mesh = mesh_axisymmetric_bellow(shape, AxisymmetricResolution.level(level)).mesh
        cavity = enclosed_volume_of_revolution(mesh, mesh.boundaries["cavity"])
        errors.append(
            [cavity / shape.cavity_volume - 1, volume_of_revolution(mesh) / shape.soft_volume - 1]
        )
    coarse, fine = np.abs(errors)
    assert np.all(coarse < 1e-4)
    assert np.all(fine < coarse / 12)  # fourth order, as quadratic elements should


def test_half_circles_enclose_what_half_circles_enclose():
    shape = AxisymmetricBellow(wall=0.003, layers=6, divided_ratio=2.0)
    radius = shape.pitch / 2
    assert shape.arc_radius == pytest.approx(radius)
    inner = shape.radius - shape.wall
    # half a torus outside its centre circle: pi^2 r^2 R + 4/3 pi r^3
    bulge = np.pi**2 * radius**2 * inner + 4 / 3 * np.pi * radius**3
    tube = np.pi * inner**2 * (shape.height - shape.wall)
    assert shape.cavity_volume == pytest.approx(tube + 6 * bulge)


def test_contours_are_arcs_between_cusps_at_the_outer_radius():
    shape = AxisymmetricBellow(wall=0.003, layers=3, divided_ratio=4.0)
    mesh = mesh_axisymmetric_bellow(shape).mesh
    for name, cusp in (("outside", shape.radius), ("cavity", shape.radius - shape.wall)):
        dofs = mesh.dofs.get_facet_dofs(mesh.boundaries[name]).all()
        r, z = mesh.doflocs[:, np.asarray(dofs)]
        wavy = (z > shape.collar) & (z < shape.height - shape.wall - 1e-9)
        r, z = r[wavy], z[wavy]
        height = (z - shape.collar) % shape.pitch
        centre = cusp + shape.sagitta - shape.arc_radius
        away = np.hypot(r - centre, height - shape.pitch / 2)
        assert away == pytest.approx(np.full(away.size, shape.arc_radius))
        assert r.max() == pytest.approx(cusp + shape.pitch / 4)


def test_boundary_sets_are_disjoint_complete_and_where_they_say():
    shape = AxisymmetricBellow()
    result = mesh_axisymmetric_bellow(shape)
    mesh = result.mesh
    together = np.concatenate([np.asarray(facets) for facets in mesh.boundaries.values()])
    assert np.array_equal(np.sort(together), np.sort(mesh.boundary_facets()))
    for name, axis, value in (("clamped", 1, 0.0), ("top", 1, shape.height), ("axis", 0, 0.0)):
        assert mesh.p[axis, mesh.facets[:, mesh.boundaries[name]]] == pytest.approx(value)
    assert mesh.doflocs[:, result.top_centre] == pytest.approx([0.0, shape.height])
    assert np.abs(vector_area(mesh, mesh.boundary_facets())).max() < 1e-15
    basis = skfem.FacetBasis(mesh, skfem.ElementQuad2(), facets=mesh.boundaries["cavity"])
    assert np.all(basis.dx > 0)


@pytest.mark.skipif(not TABLE_2.exists(), reason="published tables are not here")
def test_every_case_of_table_2_has_valid_elements():
    with TABLE_2.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for row in rows:
        shape = AxisymmetricBellow(float(row["A"]) * 1e-3, int(row["B"]), float(row["C"]))
        # half circles have corners of 0 and 180 degrees: lower, but well away from zero
        least = 0.2 if shape.divided_ratio == 2 else 0.7
        assert scaled_jacobian(mesh_axisymmetric_bellow(shape).mesh) > least


@settings(max_examples=40)
@given(geometry=axisymmetric_bellows(), through=st.integers(1, 4), along=st.integers(2, 5))
def test_no_element_is_inverted(geometry: BellowAxisymmetricGeometry, through: int, along: int):
    shape = AxisymmetricBellow.of(geometry)
    resolution = AxisymmetricResolution(wall=through, half_arc=along)
    mesh = mesh_axisymmetric_bellow(shape, resolution).mesh
    assert scaled_jacobian(mesh) > 0
    assert volume_of_revolution(mesh) == pytest.approx(shape.soft_volume, rel=1e-3)


@pytest.mark.parametrize("along", [3, 6])
def test_facets_are_integrated_where_they_meet_at_no_angle(along: int):
    """Newton's method finds further points outside the element with the same image there."""
    shape = AxisymmetricBellow(wall=0.0045, layers=3, divided_ratio=2.0)
    mesh = mesh_axisymmetric_bellow(shape, AxisymmetricResolution(half_arc=along)).mesh
    d = discretise(mesh, Kinematics.AXISYMMETRIC)
    surface = PressureSurface(d, d.facets_on("cavity"))
    assert surface.rest_volume == pytest.approx(shape.cavity_volume, rel=1e-4)
