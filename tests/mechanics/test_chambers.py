"""Rows of chambers: printed lengths, volumes, meshes, solids, outlines."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from rig.mechanics.cad.facets import triangulate
from rig.mechanics.cad.parts import parts_of
from rig.mechanics.cad.stl import volume
from rig.mechanics.chambers import ChamberRow
from rig.mechanics.fe import PressureSurface, discretise
from rig.mechanics.mesh.chamber_row import RowResolution, mesh_chamber_row
from rig.mechanics.mesh.measure import solid_volume
from rig.mechanics.outline import PLATE_THICKNESS, body_of, side_profile
from rig.spec.chambers import (
    BellowRectangularGeometry,
    MultiChamberBendingGeometry,
    MultiChamberLinearGeometry,
)

BELLOWS = BellowRectangularGeometry(family="bellow-rectangular", bellow_number=2)
BLOCK = MultiChamberBendingGeometry(family="multi-chamber-bending")
LINEAR = MultiChamberLinearGeometry(family="multi-chamber-linear")
HYBRID = BellowRectangularGeometry.model_validate(
    {
        "family": "bellow-rectangular",
        "bellow_number": 1,
        "further_groups": [{"bellow_number": 2, "bellow_length": 2, "spacer_length": 1}],
    }
)
COARSE = RowResolution(0.01, 0.01)
EVERY = [BELLOWS, BLOCK, LINEAR, HYBRID]


@pytest.mark.parametrize(
    ("number", "length_mm", "total_mm"), [(9, 5, 134.6), (26, 1, 133.4), (9, 2, 77.6)]
)
def test_total_lengths_are_those_printed(number, length_mm, total_mm):
    """Yin et al., Section III-B, and 225 mm over 2.90 of III-C for the original."""
    geometry = BellowRectangularGeometry.model_validate(
        {
            "family": "bellow-rectangular",
            "bellow_number": number,
            "bellow_length": length_mm,
            "spacer_length": length_mm,
        }
    )
    connector = geometry.end_length - geometry.wall_thickness
    assert 1e3 * (ChamberRow.of(geometry).tip + connector) == pytest.approx(total_mm, abs=0.05)


def test_the_volume_of_a_bellow_is_counted_by_hand():
    """One bellow: chamber 14 x 15 x 5, channel 5 x 6 through two faces and two spacers, in mm."""
    one = BELLOWS.model_copy(update={"bellow_number": 1})
    by_hand = 14 * 15 * 5 + 5 * 6 * (2 * 1.2 + 2 * 5)
    assert 1e9 * ChamberRow.of(one).cavity_volume == pytest.approx(by_hand)


def test_walls_gaps_and_fibres_are_read_off_the_drawing():
    """In mm: the roof of chambers over the underside, the thinnest wall, between neighbours."""
    row, hybrid, block = (ChamberRow.of(g) for g in (BELLOWS, HYBRID, BLOCK))
    assert 1e3 * row.fibre_distance == pytest.approx(16)
    assert 1e3 * block.fibre_distance == pytest.approx(0.75 + 7 + 8)
    assert 1e3 * row.wall == pytest.approx(1.2)
    assert 1e3 * block.wall == pytest.approx(2)
    assert 1e3 * row.gap == pytest.approx(5)
    assert 1e3 * hybrid.gap == pytest.approx(1)
    assert block.gap == 0.0


@pytest.mark.parametrize("geometry", EVERY)
def test_meshes_fill_the_body_and_close_the_cavity(geometry):
    row = ChamberRow.of(geometry)
    quarter = geometry is LINEAR
    share = 4 if quarter else 2
    body = mesh_chamber_row(row, COARSE, quarter=quarter)
    assert share * solid_volume(body.mesh) == pytest.approx(row.soft_volume, rel=1e-12)
    d = discretise(body.mesh)
    wall = PressureSurface(d, d.facets_on("cavity")).evaluate(np.zeros(d.size))
    assert share * wall.volume == pytest.approx(row.cavity_volume, rel=1e-12)
    named = np.concatenate([np.asarray(f) for f in body.mesh.boundaries.values()])
    assert np.array_equal(np.sort(named), np.sort(body.mesh.boundary_facets()))


def test_the_layer_has_its_elements():
    row = ChamberRow.of(BLOCK)
    body = mesh_chamber_row(row, COARSE)
    boxes = np.ptp(body.mesh.p[:, body.mesh.t[:, body.layer]], axis=1).prod(axis=0)
    assert boxes.sum() == pytest.approx(row.half_width * row.layer * row.end, rel=1e-12)
    assert len(mesh_chamber_row(ChamberRow.of(BELLOWS), COARSE).layer) == 0


def test_finer_meshes_have_no_element_above_the_size():
    body = mesh_chamber_row(ChamberRow.of(BELLOWS), RowResolution(1e-3, 2e-3))
    sizes = np.ptp(body.mesh.p[:, body.mesh.t], axis=1)
    assert sizes[0].max() < 1e-3 + 1e-12
    assert sizes[1:].max() < 2e-3 + 1e-12


@pytest.mark.parametrize("geometry", EVERY)
def test_printed_parts_have_the_volumes_of_the_body(geometry):
    row = ChamberRow.of(geometry)
    solids = {p.name: volume(triangulate(p.solid, 1e-5)) for p in parts_of(geometry)}
    narrowest = min(s.cavity.area for s in row.segments if s.cavity is not None)
    inlet = narrowest * row.segments[0].length
    soft = solids["soft"] + solids.get("layer", 0.0)
    assert soft == pytest.approx(row.soft_volume - inlet, rel=1e-9)
    assert solids["cap"] == pytest.approx(row.cap_mass(1.0), rel=1e-9)


def shoelace(outline):
    x, z = outline.T
    return float(x @ np.roll(z, -1) - z @ np.roll(x, -1)) / 2


@given(angle=st.floats(-0.2, 2.6), which=st.sampled_from([BELLOWS, BLOCK, HYBRID]))
@settings(max_examples=25)
def test_the_cap_turns_by_the_angle_and_the_layer_keeps_its_length(angle, which):
    row = ChamberRow.of(which)
    shown = side_profile(which, angle)
    heading = shown.end_cap[1] - shown.end_cap[0]
    turned = np.arctan2(-heading[1], heading[0])
    assert np.cos(turned - angle) == pytest.approx(1.0, abs=1e-9)
    assert shoelace(shown.end_cap) == pytest.approx(
        min(row.cap_thickness, PLATE_THICKNESS) * row.height, rel=1e-9
    )
    below = shown.bottom_layer[: int(np.ceil(row.end / 2e-3)) + 1]
    length = np.linalg.norm(np.diff(below, axis=0), axis=1).sum()
    assert length == pytest.approx(row.end, rel=1e-2)


@pytest.mark.parametrize("geometry", [BELLOWS, BLOCK, HYBRID])
def test_the_straight_outline_has_the_area_of_the_side(geometry):
    row = ChamberRow.of(geometry)
    shown = side_profile(geometry, 0.0)
    side = sum(s.length * (s.outline.high - s.outline.low) for s in row.segments)
    assert shoelace(shown.bellow) + shoelace(shown.bottom_layer) == pytest.approx(side, rel=1e-9)
    floor = 0.75e-3 if geometry is BLOCK else 1e-3
    assert shoelace(shown.bottom_layer) == pytest.approx(floor * row.end, rel=1e-9)
    assert body_of(geometry) == row


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"spacer_height": 2.5}, "spacer_height = 2.5 mm must be above 3 mm"),
        ({"spacer_width": 4}, "spacer_width = 4 mm must be above 4 mm"),
        ({"bellow_width": 9}, "bellow_width = 9 mm must be above spacer_width = 9 mm"),
        ({"end_length": 1}, "end_length = 1 mm must be above wall_thickness = 2 mm"),
    ],
)
def test_impossible_bellows_are_explained(change, told):
    with pytest.raises(ValidationError, match=told):
        BellowRectangularGeometry.model_validate({"family": "bellow-rectangular"} | change)


def test_passages_wider_than_chambers_are_explained():
    with pytest.raises(ValidationError, match="passage_width = 8 mm must be below chamber_width"):
        MultiChamberLinearGeometry.model_validate(
            {"family": "multi-chamber-linear", "passage_width": 8}
        )
