"""Slit shells on soft cores: constraints, slits, volumes, meshes, solids, outlines."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from rig.mechanics.cad.facets import triangulate
from rig.mechanics.cad.parts import parts_of
from rig.mechanics.cad.stl import volume
from rig.mechanics.fe import PressureSurface, discretise
from rig.mechanics.mesh.slit_shell import CLEARANCE, ShellResolution, mesh_slit_shell
from rig.mechanics.outline import body_of, side_profile
from rig.mechanics.shells import SlitShell
from rig.spec.shells import ShellReinforcedBendingGeometry, ShellReinforcedLinearGeometry

BENDING = ShellReinforcedBendingGeometry(family="shell-reinforced-bending")
LINEAR = ShellReinforcedLinearGeometry(family="shell-reinforced-linear")
COARSE = ShellResolution(ring=1, slit=1, around=6, wall=1)


def of(family, **fields):
    kind = ShellReinforcedBendingGeometry if family == "bending" else ShellReinforcedLinearGeometry
    return kind.model_validate({"family": f"shell-reinforced-{family}", **fields})


@pytest.mark.parametrize("geometry", [BENDING, LINEAR])
def test_slits_and_rings_fill_the_chamber_with_half_slits_at_the_ends(geometry):
    spans = SlitShell.of(geometry).spans
    lengths = np.array([s.end - s.start for s in spans])
    assert len(spans) == 2 * geometry.slit_number + 3
    assert lengths.sum() == pytest.approx(0.036)
    assert lengths[[0, -1]] == pytest.approx(geometry.slit_width / 2)
    assert lengths[2:-2:2] == pytest.approx(geometry.slit_width)
    assert lengths[1::2] == pytest.approx(geometry.ring_width)
    assert all(a.end == b.start for a, b in pairwise(spans))


def test_bridges_of_neighbouring_slits_are_a_quarter_turn_apart():
    slits = SlitShell.of(LINEAR).spans[::2]
    middles = [{round(np.degrees(np.mean(b))) for b in slit.bridges} for slit in slits[:2]]
    assert middles == [{4, 176}, {90}]
    assert [s.bridges for s in slits[2:4]] == [s.bridges for s in slits[:2]]
    widths = [2 * np.ptp(slits[0].bridges[0]), np.ptp(slits[1].bridges[0])]
    assert 4e-3 * np.array(widths) == pytest.approx(LINEAR.bridge_width)


def test_volumes_are_counted_by_hand():
    shape = SlitShell.of(BENDING)
    assert 1e9 * shape.cavity_volume == pytest.approx(np.pi * 4 * 36)
    assert 1e9 * shape.core_volume == pytest.approx(np.pi * (16 * 40 - 4 * 36))
    rings = np.pi * (4.1**2 - 16) * 28
    strip = (4.1**2 - 16) * 0.25 * 8  # 2 mm of 4 mm radius are half a rad, 8 mm of slits
    assert 1e9 * shape.shell_volume == pytest.approx(rings + strip)


@pytest.mark.parametrize(
    ("family", "fields", "message"),
    [
        ("bending", {"end_length": "20 mm"}, "leave no chamber"),
        ("linear", {"slit_number": 71}, "leave no rings"),
        ("bending", {"strip_width": "13 mm"}, "leaves no slits"),
        ("linear", {"bridge_width": "6.3 mm"}, "leave no slits"),
        ("bending", {"slit_number": 0}, "slit_number"),
        ("bending", {"shell_poisson_ratio": 0.5}, "shell_poisson_ratio"),
    ],
)
def test_what_cannot_be_built_is_refused(family, fields, message):
    with pytest.raises(ValidationError, match=message):
        of(family, **fields)


def test_the_widest_strip_and_bridges_still_leave_slits():
    assert of("bending", strip_width="12.5 mm").strip_width < np.pi * 4e-3
    assert of("linear", bridge_width="6.2 mm").bridge_width < np.pi * 2e-3


@st.composite
def geometries(draw):
    family = draw(st.sampled_from(["bending", "linear"]))
    radius = draw(st.floats(1.0, 4.0))
    slits = draw(st.integers(1, 3))
    fields = {
        "total_length": f"{draw(st.floats(15.0, 60.0))} mm",
        "chamber_diameter": f"{2 * radius} mm",
        "wall_thickness": f"{draw(st.floats(0.8, 3.0))} mm",
        "slit_number": slits,
        "slit_width": f"{draw(st.floats(0.3, 1.0))} mm",
        "shell_thickness": f"{draw(st.floats(0.05, 0.3))} mm",
        "strip_width" if family == "bending" else "bridge_width": f"{draw(st.floats(0.5, 2.0))} mm",
    }
    return of(family, **fields)


@given(geometry=geometries(), around=st.integers(4, 10))
@settings(max_examples=12, deadline=None)
def test_every_mesh_fills_core_and_shell_and_closes_its_cavity(geometry, around):
    shape = SlitShell.of(geometry)
    quarter = geometry.family == "shell-reinforced-linear"
    share = 4 if quarter else 2
    resolution = ShellResolution(ring=1, slit=1, around=around, wall=1)
    body = mesh_slit_shell(shape, resolution, quarter=quarter)
    d = discretise(body.mesh)  # refuses elements that are inverted or flat
    core = np.setdiff1d(np.arange(len(d.connectivity)), body.shell)
    # arcs are parabolas
    assert share * d.weights[core].sum() == pytest.approx(shape.core_volume, rel=2e-3)
    slack = 1e-2 + 2 * CLEARANCE / shape.shell_thickness
    assert share * d.weights[body.shell].sum() == pytest.approx(shape.shell_volume, rel=slack)
    wall = PressureSurface(d, d.facets_on("cavity")).evaluate(np.zeros(d.size))
    assert share * wall.volume == pytest.approx(shape.cavity_volume, rel=2e-3)
    named = np.concatenate(list(body.mesh.boundaries.values()))
    assert np.array_equal(np.sort(named), np.sort(body.mesh.boundary_facets()))
    # what slides lies on each other; bonded nodes are shared, no others
    radius = np.hypot(*d.nodes[:, 1:].T)
    inside, outside = d.nodes_on("core"), d.nodes_on("lining")
    assert radius[inside] == pytest.approx(shape.core_radius, rel=1e-6)
    assert radius[outside] == pytest.approx(shape.core_radius, abs=2 * CLEARANCE)
    shared = np.intersect1d(inside, outside)
    angle = np.arctan2(d.nodes[shared, 1], -d.nodes[shared, 2])
    assert angle == pytest.approx(np.full(len(shared), shape.bonded), abs=1e-6)
    assert len(shared) > 0 or not shape.bonded


@pytest.mark.parametrize("geometry", [BENDING, LINEAR, of("linear", slit_number=2)])
def test_solids_have_the_volumes_of_the_parts(geometry):
    shape = SlitShell.of(geometry)
    parts = {p.name: p for p in parts_of(geometry)}
    assert set(parts) == {"soft", "cap", "shell"}
    assert [p.name for p in parts.values() if p.is_soft] == ["soft"]
    found = {name: volume(triangulate(p.solid, 2e-6)) for name, p in parts.items()}
    inlet = np.pi * 1e-3**2 * shape.end_length
    assert found["soft"] == pytest.approx(shape.core_volume - inlet, rel=5e-3)
    assert found["shell"] == pytest.approx(shape.shell_volume, rel=2e-2)


def test_the_one_that_bends_has_outlines():
    straight = side_profile(BENDING, 0.0)
    shape = SlitShell.of(BENDING)
    assert np.ptp(straight.bellow[:, 0]) == pytest.approx(shape.chamber_length)
    assert straight.bellow[:, 1].max() == pytest.approx(shape.radius)
    assert straight.bottom_layer[:, 1].min() == pytest.approx(shape.underside)
    bent = side_profile(BENDING, np.pi / 2)
    assert bent.end_cap[:, 1].min() < shape.underside - 0.01
    assert body_of(BENDING) == shape
