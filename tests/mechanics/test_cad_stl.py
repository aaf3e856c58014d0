"""Triangulated parts: closed, turned outwards, of the right volume, and written as they are."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from bellow_strategies import axisymmetric_bellows, bending_bellows
from hypothesis import given, settings

from rig.mechanics.bellow import BellowShape
from rig.mechanics.cad.construct import Line, Part, Revolved
from rig.mechanics.cad.errors import CadError
from rig.mechanics.cad.facets import triangulate
from rig.mechanics.cad.parts import parts_of
from rig.mechanics.cad.stl import is_watertight, printable, read_stl, volume, write_stl
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricBellow
from rig.spec.actuator import BellowAxisymmetricGeometry

pytest.importorskip("manifold3d", reason="manifold3d is not installed")


def test_every_part_is_watertight_and_turned_outwards(default_geometry):
    parts = parts_of(default_geometry)
    assert [part.name for part in parts] == ["soft", "connector", "cap"]
    for part in parts:
        surface = triangulate(part.solid, 5e-5)
        assert is_watertight(printable(surface))
        assert volume(surface) > 0


def test_soft_volume_converges_to_the_closed_form_with_its_tolerance(default_geometry):
    soft = parts_of(default_geometry)[0].solid
    exact = BellowShape.of(default_geometry).soft_volume
    coarse, fine = (abs(volume(triangulate(soft, t)) / exact - 1) for t in (4e-5, 1e-5))
    assert fine < 2e-3
    assert fine < coarse / 3  # the volume cut off by chords is proportional to their sag


def test_rigid_parts_lie_where_the_soft_part_ends(default_geometry):
    shape = BellowShape.of(default_geometry)
    soft, connector, cap = (triangulate(part.solid) for part in parts_of(default_geometry))
    assert soft[..., 0].min() == pytest.approx(-shape.wall)
    assert connector[..., 0].max() == pytest.approx(-shape.wall)
    assert soft[..., 0].max() == pytest.approx(cap[..., 0].min())
    assert cap[..., 0].max() == pytest.approx(shape.tip)
    assert soft[..., 2].min() == pytest.approx(shape.underside)
    assert soft[..., 2].max() == pytest.approx(shape.outer_radius + shape.wall)
    assert volume(cap) == pytest.approx(shape.cap_volume, rel=1e-3)


def test_the_inlet_opens_the_cavity(default_geometry):
    """One closed surface without a separate cavity: the Euler number tells."""
    corners = printable(triangulate(parts_of(default_geometry)[0].solid, 5e-5))
    _, vertex = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = vertex.reshape(-1, 3)
    edges = np.unique(
        np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])), axis=0
    )
    assert vertex.max() + 1 - len(edges) + len(faces) == 2  # a sphere, folded inwards


@pytest.mark.parametrize("ratio", [2.0, 3.0])
def test_axisymmetric_bellows_stand_upright_and_keep_their_volume(ratio):
    geometry = BellowAxisymmetricGeometry(family="bellow-axisymmetric", divided_ratio=ratio)
    shape = AxisymmetricBellow.of(geometry)
    surface = triangulate(parts_of(geometry)[0].solid)
    assert is_watertight(printable(surface))
    assert volume(surface) == pytest.approx(shape.soft_volume, rel=2e-3)
    assert surface[..., 2].min() == pytest.approx(0.0)
    assert surface[..., 2].max() == pytest.approx(shape.height)


def test_files_hold_what_was_written(default_geometry, tmp_path):
    surface = triangulate(parts_of(default_geometry)[2].solid)
    path = tmp_path / "cap.stl"
    count = write_stl(path, surface)
    again = read_stl(path)
    assert len(again) == count
    assert path.stat().st_size == 84 + 50 * count
    assert volume(again) == pytest.approx(volume(surface), rel=1e-6)


def test_open_surfaces_are_not_written(default_geometry, tmp_path):
    surface = triangulate(parts_of(default_geometry)[2].solid)
    with pytest.raises(CadError, match="watertight"):
        write_stl(tmp_path / "open.stl", surface[1:])
    assert not is_watertight(np.concatenate([surface[1:], surface[:1, ::-1]]))
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_named(default_geometry, tmp_path):
    surface = triangulate(parts_of(default_geometry)[2].solid)
    with pytest.raises(CadError, match="cannot be written"):
        write_stl(tmp_path / "nowhere" / "cap.stl", surface)


def test_a_missing_library_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    rod = Part("rod", Revolved((Line((0.0, 0.01), (0.02, 0.01)),)), is_soft=False)
    with pytest.raises(CadError, match="pip install manifold3d"):
        triangulate(rod.solid)


@settings(max_examples=8)
@given(geometry=bending_bellows())
def test_soft_parts_are_watertight_over_the_constraint_range(geometry):
    soft = parts_of(geometry)[0].solid
    surface = triangulate(soft, 1e-2 * geometry.wall_thickness)
    assert is_watertight(printable(surface))
    assert volume(surface) == pytest.approx(BellowShape.of(geometry).soft_volume, rel=0.05)


@settings(max_examples=8)
@given(geometry=axisymmetric_bellows())
def test_axisymmetric_soft_parts_are_watertight_over_the_constraint_range(geometry):
    shape = AxisymmetricBellow.of(geometry)
    surface = triangulate(parts_of(geometry)[0].solid, 1e-2 * min(shape.wall, shape.sagitta))
    assert is_watertight(printable(surface))
    assert volume(surface) == pytest.approx(shape.soft_volume, rel=0.05)
