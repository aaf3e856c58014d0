"""Yin's kinematic model against arcs drawn by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.mechanics.errors import MechanicsError
from rig.mechanics.kinematics import (
    BellowRow,
    VolumeLaw,
    pressure_for_radius,
    volume_for_radius,
)
from rig.mechanics.response import Response
from rig.spec.chambers import BellowGroup, BellowRectangularGeometry

LONGEST = BellowRectangularGeometry(family="bellow-rectangular")
ROW = BellowRow.of(LONGEST)


def test_a_row_has_the_dimensions_of_its_actuator():
    """5 mm bellow, two faces of 1.2 mm and 5 mm spacer; h is half of 18 mm."""
    assert ROW.number == 9
    assert 1e3 * ROW.pitch == pytest.approx(12.4)
    assert 1e3 * ROW.height == pytest.approx(9)


@given(st.floats(1e-5, 1e-2))
def test_both_arcs_have_one_centre(extension):
    """Eqs. (1) to (3): arcs of N x and N (x + x_e) over one angle, h apart."""
    angle, inner = ROW.angle(extension), ROW.inner_radius(extension)
    assert inner * angle == pytest.approx(ROW.number * ROW.pitch)
    assert (inner + ROW.height) * angle == pytest.approx(ROW.number * (ROW.pitch + extension))
    assert ROW.extension(angle) == pytest.approx(extension)
    assert ROW.extension_for(inner) == pytest.approx(extension)


def test_nothing_bends_without_extension():
    assert ROW.inner_radius(0.0) == np.inf
    assert ROW.angle(0.0) == 0.0


def made(slope: float) -> Response:
    """Extension proportional to volume, volume to the root of the pressure."""
    pressure = np.linspace(0.0, 200e3, 9)
    taken = 1e-6 * np.sqrt(pressure / 200e3)
    return Response(
        model="fe",
        pressure=pressure,
        angle=0.02 + ROW.angle(slope * taken),
        displacement=np.zeros(9),
        blocked_force=None,
        volume=11e-6 + ROW.number * taken,
    )


def test_the_volume_law_is_found_and_inverted():
    law = VolumeLaw.fitted(ROW, made(2000.0))
    assert law.slope == pytest.approx(2000.0)
    assert law.r_squared == pytest.approx(1.0)
    radius = ROW.inner_radius(law.extension(0.4e-6))
    assert volume_for_radius(ROW, law, radius) == pytest.approx(ROW.number * 0.4e-6)
    assert law.volume(law.extension(0.4e-6)) == pytest.approx(0.4e-6)


def test_a_law_that_is_not_linear_is_told():
    bent = made(2000.0)
    assert bent.angle is not None
    straight = Response(
        "fe", bent.pressure, bent.angle, bent.displacement, None, 11e-6 + 1e-11 * bent.pressure
    )
    assert VolumeLaw.fitted(ROW, straight).r_squared < 0.9


def test_pressure_for_a_radius_comes_from_the_response():
    response = made(2000.0)
    assert response.angle is not None
    radius = ROW.inner_radius(ROW.extension(response.angle[4]))
    assert pressure_for_radius(ROW, response, radius) == pytest.approx(response.pressure[4])
    with pytest.raises(MechanicsError, match="is outside"):
        pressure_for_radius(ROW, response, 1e-3)


def test_what_the_model_is_not_for_is_told():
    group = BellowGroup.model_validate({"bellow_number": 1, "bellow_length": 2, "spacer_length": 2})
    with pytest.raises(MechanicsError, match="uniform"):
        BellowRow.of(LONGEST.model_copy(update={"further_groups": (group,)}))
    with pytest.raises(MechanicsError, match="-1 mm is impossible"):
        ROW.extension_for(-1e-3)
    linear = Response("fe", np.zeros(2), None, np.zeros(2), None, np.ones(2))
    with pytest.raises(MechanicsError, match="nothing bends"):
        VolumeLaw.fitted(ROW, linear)
