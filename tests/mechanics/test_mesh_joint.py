"""Meridian mesh of the joint bellow against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.spatial import cKDTree

from rig.mechanics.cad.parts import parts_of
from rig.mechanics.fe import Kinematics, PressureSurface, discretise
from rig.mechanics.mesh.bellow_joint import JointBellow, JointResolution, mesh_joint_bellow
from rig.mechanics.mesh.measure import scaled_jacobian, volume_of_revolution
from rig.spec.actuator import BellowJointGeometry

DEFAULT = BellowJointGeometry(family="bellow-joint")


@st.composite
def joint_bellows(draw: st.DrawFn) -> BellowJointGeometry:
    """Geometries within the constraints, in mm."""
    pitch, depth = draw(st.floats(1.0, 6.0)), draw(st.floats(1.0, 6.0))
    rounding = draw(st.floats(0.1, 0.95)) * min(depth, pitch / 2) / 2
    wall = draw(st.floats(0.1, 0.9)) * 2 * rounding
    trough = wall / 2 + draw(st.floats(0.5, 6.0))
    return BellowJointGeometry.model_validate(
        {
            "family": "bellow-joint",
            "bellow_number": draw(st.integers(1, 4)),
            "pitch": pitch,
            "trough_radius": trough,
            "crest_radius": trough + depth,
            "rounding": rounding,
            "wall_thickness": wall,
            "end_thickness": draw(st.floats(0.2, 3.0)),
        }
    )


@given(geometry=joint_bellows())
@settings(max_examples=6)
def test_every_admitted_bellow_has_a_sound_mesh_with_a_closed_cavity(
    geometry: BellowJointGeometry,
) -> None:
    shape = JointBellow.of(geometry)
    mesh = mesh_joint_bellow(shape).mesh
    assert scaled_jacobian(mesh) > 0.02
    assert volume_of_revolution(mesh) == pytest.approx(shape.soft_volume, rel=2e-3)
    d = discretise(mesh, Kinematics.AXISYMMETRIC)
    wall = PressureSurface(d, d.facets_on("cavity"))
    assert wall.rest_area[1] == pytest.approx(0.0, abs=1e-12)
    together = np.concatenate([np.asarray(facets) for facets in mesh.boundaries.values()])
    assert np.array_equal(np.sort(together), np.sort(mesh.boundary_facets()))


def test_the_volume_converges_to_the_closed_form() -> None:
    shape = JointBellow.of(DEFAULT)
    coarse, fine = (
        abs(volume_of_revolution(mesh_joint_bellow(shape, n).mesh) / shape.soft_volume - 1)
        for n in (JointResolution(fifth=2), JointResolution(fifth=4))
    )
    assert fine < 1e-3
    assert fine < coarse / 3


def test_the_wall_is_equally_thick_from_trough_to_crest() -> None:
    shape = JointBellow.of(DEFAULT)
    along = np.linspace(0, 1, 41)
    apart = shape.half(along, shape.wall / 2) - shape.half(along, -shape.wall / 2)
    np.testing.assert_allclose(np.linalg.norm(apart, axis=1), shape.wall, rtol=1e-12)
    ends = shape.half([0.0, 1.0], 0.0)
    np.testing.assert_allclose(ends[:, 0], [shape.trough_radius, shape.crest_radius], rtol=1e-12)
    np.testing.assert_allclose(ends[:, 1], [0.0, shape.pitch / 2], atol=1e-15)


@pytest.mark.parametrize("side", ["outside", "cavity"])
def test_latitudes_are_nodes_equally_far_apart_from_trough_to_trough(side) -> None:
    shape = JointBellow.of(DEFAULT)
    mesh = mesh_joint_bellow(shape).mesh
    places = shape.latitudes(side)
    assert places.shape == (14, 10, 2)
    away, _ = cKDTree(mesh.doflocs.T).query(places.reshape(-1, 2))
    assert away.max() < 1e-9
    radius = places[3, :, 0]
    assert radius.argmin() == 0, "A is at the trough"
    assert radius.argmax() == 5, "F is at the crest"
    np.testing.assert_allclose(radius[1:5], radius[:5:-1], rtol=1e-12)
    np.testing.assert_allclose(np.diff(places[:, 0, 1]), shape.pitch, rtol=1e-12)


def test_the_solid_for_cad_has_the_mesh_s_volume_but_for_its_inlet() -> None:
    pytest.importorskip("manifold3d", reason="manifold3d is not installed")
    from rig.mechanics.bellow import INLET_RADIUS
    from rig.mechanics.cad.facets import triangulate
    from rig.mechanics.cad.stl import is_watertight, printable, volume

    geometry = BellowJointGeometry(family="bellow-joint", bellow_number=2)
    shape = JointBellow.of(geometry)
    (part,) = parts_of(geometry)
    surface = triangulate(part.solid, 5e-6)
    assert is_watertight(printable(surface))
    inlet = np.pi * INLET_RADIUS**2 * shape.end_thickness
    assert volume(surface) == pytest.approx(shape.soft_volume - inlet, rel=1e-2)
    assert surface[..., 2].max() == pytest.approx(shape.end)


@pytest.mark.parametrize(
    ("key", "value", "what"),
    [
        ("wall_thickness", "1 mm", "reduce wall_thickness"),
        ("trough_radius", "0.1 mm", "leave no cavity"),
        ("rounding", "0.8 mm", "the flanks have no room"),
        ("crest_radius", "2.5 mm", "the flanks have no room"),
    ],
)
def test_a_bellow_that_is_no_solid_is_refused_with_what_to_change(key, value, what) -> None:
    with pytest.raises(ValidationError, match=what):
        BellowJointGeometry.model_validate({"family": "bellow-joint", key: value})
