"""Two markers whose true turn is known: in-plane, both ways, and refused where one is hidden."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rig.plant.markers import marker_surfaces
from rig.plant.optics import aim
from rig.plant.target import flat_light
from rig.vision.marker_angle import MarkerAngleMeter
from tests.vision.test_displacement import (
    CAMERA,
    LENS,
    NOISE,
    RULER,
    SIDE,
    WHOLE,
    developed,
    still_outlines,
)

FIXED_TURN = np.radians(3.0)
"""Of the whole bench in the picture."""
METER = MarkerAngleMeter(CAMERA, RULER, mounting_u_deg=0.0)


def turned(surfaces, turn, middle):
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    return [replace(s, outline=(s.outline - middle) @ rotation + middle) for s in surfaces]


def picture(bend_deg, tilt=(0.1, -0.12), hidden=False):
    """Marker 1 turned clockwise to the eye by `bend_deg` from marker 0, seen from the side."""
    projection = aim(LENS, 0.35, *tilt, 0.02)
    ruler = still_outlines(projection=projection)[: -len(marker_surfaces(0, SIDE, np.zeros(2)))]
    above, below = np.array([-0.06, -0.03]), np.array([-0.055, 0.01])
    things = turned(marker_surfaces(0, SIDE, above), FIXED_TURN, above)
    if not hidden:
        bend = FIXED_TURN + np.radians(bend_deg)
        things += turned(marker_surfaces(1, SIDE, below), bend, below)
    outlines = [(projection.project(thing.outline), thing) for thing in things]
    light = flat_light([*ruler, *outlines], WHOLE)
    return NOISE.added(developed(light, 0.7), 0.0)


@pytest.mark.parametrize("bend_deg", [-20.0, 0.0, 37.0, 90.0, 135.0, 180.0])
def test_the_turn_between_markers_is_the_angle_however_the_camera_stands(bend_deg):
    found = METER.measure(picture(bend_deg))
    assert found.accepted, found.reason
    assert abs(found.angle_deg - bend_deg) < 2.0 * found.u_deg
    assert found.u_deg < 0.3


def test_bending_to_the_other_side_changes_the_sign():
    found = replace(METER, bends="right").measure(picture(-60.0))
    assert found.angle_deg == pytest.approx(60.0, abs=0.5)


def test_how_the_markers_were_glued_is_in_the_uncertainty():
    image = picture(40.0)
    exact, glued = (replace(METER, mounting_u_deg=u).measure(image).u_deg for u in (0.0, 0.5))
    assert glued == pytest.approx(np.hypot(exact, 0.5))


def test_without_a_ruler_the_plane_is_uncertain():
    found = replace(METER, ruler=None).measure(picture(40.0, tilt=(0.02, 0.02)))
    assert found.angle_deg == pytest.approx(40.0, abs=1.0)
    assert found.u_deg > 1.0


def test_a_hidden_marker_is_named():
    found = METER.measure(picture(40.0, hidden=True))
    assert not found.accepted
    assert "marker 1 not found" in found.reason


def test_an_angle_that_no_actuator_has_is_refused():
    assert "not plausible" in METER.measure(picture(-100.0)).reason
