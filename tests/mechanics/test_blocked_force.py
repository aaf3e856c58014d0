"""Our extension of the theory: virtual work of pressure and a propped cantilever."""

from __future__ import annotations

import numpy as np
import pytest
from bellow_strategies import bending_bellows
from hypothesis import given

from rig.mechanics.bellow import BellowShape
from rig.mechanics.blocked import blocked_force, pressure_moment
from rig.mechanics.profile import cavity_volume
from rig.mechanics.section import disc_union
from rig.spec.actuator import BellowBendingGeometry


@given(geometry=bending_bellows())
def test_moment_and_stop_together_leave_the_tip_where_it_is(geometry):
    """Mohr's integral of M_p - F (c - x) times the arm (c - x) over the flexible length is 0."""
    shape = BellowShape.of(geometry)
    moment, force = (f(geometry, 5e3) for f in (pressure_moment, blocked_force))
    nodes, weights = np.polynomial.legendre.leggauss(8)
    x = shape.effective_length * (nodes + 1) / 2
    arm = shape.tip - x
    deflection = weights @ ((moment - force * arm) * arm)
    assert deflection == pytest.approx(0, abs=1e-12 * float(weights @ (moment * arm)))
    assert force > 0


def test_a_wall_without_thickness_gives_the_textbook_propped_cantilever():
    thin = BellowBendingGeometry(family="bellow-bending", wall_thickness="0.001 mm")
    expected = 3 * pressure_moment(thin, 1e3) / (2 * thin.effective_length)
    assert float(blocked_force(thin, 1e3)) == pytest.approx(float(expected), rel=1e-4)


def test_moment_does_the_work_of_pressure_on_a_small_bend(default_geometry):
    angle, pressure = 0.02, 10e3
    start, end = cavity_volume(default_geometry, [0.0, angle])
    work = float(pressure_moment(default_geometry, pressure)) * angle
    assert work == pytest.approx(pressure * (end - start), rel=0.01)


def test_moment_of_the_default_is_that_of_a_piston_of_the_mean_radius(default_geometry):
    """Statics as a cross-check: thrust on disc of radius rm and channel, about the underside."""
    shape = BellowShape.of(default_geometry)
    piston = disc_union(np.array(shape.average_radius), shape.channel_section)
    expected = 10e3 * (piston.moment - shape.underside * piston.area)
    assert float(pressure_moment(default_geometry, 10e3)) == pytest.approx(expected, rel=0.04)


def test_blocked_force_of_the_default_at_10_kpa(default_geometry):
    """Regression of the figure that docs/theory/beam.md reports."""
    grams = float(blocked_force(default_geometry, 10e3)) / 9.80665e-3
    assert grams == pytest.approx(36.894, abs=0.001)


def test_blocked_force_is_linear_in_pressure(default_geometry):
    once, thrice = blocked_force(default_geometry, [2e3, 6e3])
    assert thrice == pytest.approx(3 * once, rel=1e-12)
