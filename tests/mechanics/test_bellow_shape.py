"""Dimensions, volumes and masses of the undeformed bending bellow."""

from __future__ import annotations

import numpy as np
import pytest
from bellow_strategies import bending_bellows
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from rig.mechanics.bellow import INLET_RADIUS, BellowShape
from rig.mechanics.section import disc_union, polygon_integrals
from rig.spec.actuator import BellowBendingGeometry


def test_default_is_table_1(default_geometry):
    shape = BellowShape.of(default_geometry)
    millimetres = {
        "effective_length": 66,
        "average_radius": 6,
        "inner_radius": 2,
        "outer_radius": 10,
        "crest_arc": 2.75,
        "trough_arc": 2.75,
        "flank": 2.5,
        "wall": 1.5,
        "bottom_thickness": 3,
        "cap_thickness": 1.5,
        "connector_thickness": 6,
    }
    assert shape.bellow_number == 6
    for name, value in millimetres.items():
        assert getattr(shape, name) * 1e3 == pytest.approx(value, rel=1e-12), name


def test_walls_may_almost_fill_the_arcs_but_not_quite():
    BellowBendingGeometry(family="bellow-bending", wall_thickness="2.7499 mm")
    with pytest.raises(ValidationError, match="wall_thickness"):
        BellowBendingGeometry(family="bellow-bending", wall_thickness="2.75 mm")


def test_flanks_may_vanish_but_not_become_negative():
    geometry = BellowBendingGeometry(family="bellow-bending", average_radius="4.125 mm")
    assert BellowShape.of(geometry).flank == pytest.approx(0, abs=1e-15)
    with pytest.raises(ValidationError, match="average_radius"):
        BellowBendingGeometry(family="bellow-bending", average_radius="4.12 mm")


def test_convolutions_are_a_positive_whole_number():
    for number in (0, -1, 2.5):
        with pytest.raises(ValidationError, match="bellow_number"):
            BellowBendingGeometry(family="bellow-bending", bellow_number=number)


@given(geometry=bending_bellows())
def test_profiles_run_from_trough_to_trough_with_a_wall_of_t_between(geometry):
    shape = BellowShape.of(geometry)
    inner, outer = shape.cavity_profile(), shape.outer_profile()
    count = geometry.bellow_number
    for profile, offset in ((inner, 0.0), (outer, shape.wall)):
        assert profile[0] == pytest.approx([0.0, shape.inner_radius + offset])
        assert profile[-1] == pytest.approx([shape.effective_length, shape.inner_radius + offset])
        assert profile[:, 1].max() == pytest.approx(shape.outer_radius + offset)
        crests = np.isclose(profile[:, 1], shape.outer_radius + offset, rtol=0, atol=1e-12).sum()
        assert crests == count
    np.testing.assert_allclose(np.linalg.norm(outer - inner, axis=1), shape.wall, rtol=1e-9)


def _radius_at(x, shape, offset):
    """Revolved profile by the circle equations, an independent statement of the toolbox's."""
    pitch = shape.effective_length / shape.bellow_number
    x = np.abs((x + pitch / 2) % pitch - pitch / 2)  # distance to the nearest trough
    trough, crest = shape.trough_arc - offset, shape.crest_arc + offset
    on_trough = shape.inner_radius + shape.trough_arc - np.sqrt(np.maximum(trough**2 - x**2, 0))
    on_crest = shape.outer_radius - shape.crest_arc
    on_crest = on_crest + np.sqrt(np.maximum(crest**2 - (pitch / 2 - x) ** 2, 0))
    return np.where(x < trough, on_trough, on_crest)


def _in_cavity(points, shape):
    x, y, z = points.T
    y = np.abs(y)
    length, t = shape.effective_length, shape.wall
    revolve = np.hypot(y, z) < _radius_at(x, shape, 0.0)
    # distance t from the line (ri + t, 0) -> (rm + t, -drop)
    run = shape.average_radius - shape.inner_radius
    drop = np.sqrt((shape.outer_radius + t) ** 2 - (shape.average_radius + t) ** 2)
    distance = (drop * (shape.inner_radius + t - y) - run * z) / np.hypot(run, drop)
    channel = (z < -t) & (z > -shape.outer_radius) & (y < shape.average_radius) & (distance > t)
    return (x > 0) & (x < length) & (revolve | channel)


def _in_solid(points, shape):
    x, y, z = points.T
    y = np.abs(y)
    length, t = shape.effective_length, shape.wall
    radius = np.where((x > 0) & (x < length), _radius_at(x, shape, t), shape.inner_radius + t)
    revolve = np.hypot(y, z) < radius
    drop = np.sqrt((shape.outer_radius + t) ** 2 - (shape.average_radius + t) ** 2)
    slope = (shape.average_radius - shape.inner_radius) / drop
    half_width = np.minimum(shape.inner_radius + t - z * slope, shape.average_radius + t)
    below = (z < 0) & (z > -shape.outer_radius - 2 * t) & (y < half_width)
    inlet = (x < 0) & (np.hypot(y, z) < INLET_RADIUS)
    within = (x > -t) & (x < length + t)
    return within & (revolve | below) & ~_in_cavity(points, shape) & ~inlet


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"bellow_number": 9, "wall_thickness": "0.8 mm"},
        {"radius_ratio": 0.6, "average_radius": "12 mm", "wall_thickness": "2.5 mm"},
        {"average_radius": "4.125 mm", "wall_thickness": "2 mm"},
    ],
)
def test_volumes_are_those_of_random_points(changes):
    shape = BellowShape.of(BellowBendingGeometry(family="bellow-bending", **changes))
    rng = np.random.default_rng(1)
    reach = shape.outer_radius + 2 * shape.wall
    low = np.array([-shape.wall, -reach, -reach])
    high = np.array([shape.effective_length + shape.wall, reach, reach])
    points = rng.uniform(low, high, (1_000_000, 3))
    box = np.prod(high - low)
    for inside, stated in (
        (_in_cavity(points, shape), shape.cavity_volume),
        (_in_solid(points, shape), shape.soft_volume),
    ):
        share = inside.mean()
        uncertainty = box * np.sqrt(share * (1 - share) / len(points))
        assert stated == pytest.approx(box * share, abs=3.5 * uncertainty)


def test_masses_follow_from_the_densities(default_geometry):
    shape = BellowShape.of(default_geometry)
    assert shape.soft_mass(1160.0) == pytest.approx(1160 * shape.soft_volume)
    assert shape.soft_mass(1160.0) * 1e3 == pytest.approx(12.9, abs=0.1)  # grams
    assert shape.cap_mass(1180.0) == pytest.approx(1180 * shape.cap_volume)


@given(geometry=bending_bellows())
def test_volumes_are_positive_and_the_cavity_holds_at_least_its_narrowest_tube(geometry):
    shape = BellowShape.of(geometry)
    tube = np.pi * shape.inner_radius**2 * shape.effective_length
    assert shape.cavity_volume > tube
    assert shape.soft_volume > 0
    assert shape.cap_volume > 0


@given(
    radius=st.floats(1e-3, 12e-3),
    geometry=bending_bellows(),
)
def test_section_of_disc_and_channel_is_the_sum_of_thin_strips(radius, geometry):
    polygon = BellowShape.of(geometry).channel_section
    assert polygon_integrals(polygon)[0] > 0
    reach = max(radius, -polygon[:, 1].min())
    edges = np.linspace(-reach, reach, 40001)
    z = (edges[1:] + edges[:-1]) / 2
    side = polygon[polygon[:, 0] > 0][::-1]
    width = np.interp(z, *side[::-1].T[::-1], left=0, right=0)
    width = np.maximum(width, np.sqrt(np.maximum(radius**2 - z**2, 0)))
    section = disc_union(np.array(radius), polygon)
    strip = 2 * width * (edges[1] - edges[0])
    assert float(section.area) == pytest.approx(strip.sum(), rel=2e-4)
    scale = strip.sum() * reach
    assert float(section.moment) == pytest.approx(strip @ z, abs=2e-4 * scale)
