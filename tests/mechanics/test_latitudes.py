"""The joint bellow's strokes: what is even in time, what is symmetric, what the paper found."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import Options
from rig.mechanics.mesh.bellow_joint import JointResolution
from rig.mechanics.simulate import latitudes
from rig.mechanics.simulate.latitudes import AMBIENT, Drive, LatitudeRun, Stroke, drive
from rig.spec.actuator import BellowJointGeometry
from rig.spec.workspace import Workspace, library_root

EVA = Workspace(library_root(), is_library=True).material("eva-18")
BELLOWS = 3
GEOMETRY = BellowJointGeometry(family="bellow-joint", bellow_number=BELLOWS)
COARSE = JointResolution(wall=2, fifth=2, end=1, end_radius=2)
INFLATION = Stroke(13e-3 * BELLOWS / 14, 0.5)
COMPRESSION = Stroke(-25e-3 * BELLOWS / 14, 0.4)
A, F = 0, 5


@cache
def run(stroke: Stroke, how: Drive) -> LatitudeRun:
    return drive(GEOMETRY, EVA, stroke, how, steps=6, resolution=COARSE)


@pytest.mark.parametrize("stroke", [INFLATION, COMPRESSION])
def test_the_disc_moves_evenly_where_it_is_moved_and_not_where_gas_is_pumped(
    stroke: Stroke,
) -> None:
    moved, pumped = run(stroke, Drive.DEFORMED), run(stroke, Drive.PUMPED)
    np.testing.assert_allclose(np.diff(moved.time), stroke.duration / 6, rtol=1e-12)
    assert np.all(moved.pressure == 0)
    assert pumped.time[-1] == pytest.approx(stroke.duration)
    assert np.ptp(np.diff(pumped.time)) > 0.1 * stroke.duration / 6
    assert np.all(np.diff(pumped.pressure) * stroke.elongation > 0)


def test_a_constant_rate_of_gas_is_what_the_gas_law_says() -> None:
    """Against the volume that a frustum of the mean radius gains: pistons, within a few %."""
    found = run(INFLATION, Drive.PUMPED)
    area = np.pi * (4.35e-3 - 0.15e-3) ** 2
    volume = BELLOWS * 3e-3 * area + area * found.elongation
    gas = (found.pressure + AMBIENT) * volume
    np.testing.assert_allclose(
        (gas - gas[0]) / (gas[-1] - gas[0]), found.time / INFLATION.duration, atol=0.03
    )


@pytest.mark.parametrize("stroke", [INFLATION, COMPRESSION])
@pytest.mark.parametrize("how", list(Drive))
def test_flanks_of_the_middle_bellow_are_stressed_alike(stroke: Stroke, how: Drive) -> None:
    middle = run(stroke, how).greatest[:, BELLOWS // 2]
    np.testing.assert_allclose(middle[:, 1:F], middle[:, :F:-1], rtol=0.02)


def test_inflated_the_trough_is_stressed_most_on_the_outside_as_published() -> None:
    for how in Drive:
        outside = run(INFLATION, how).greatest[0, 1:-1].mean(axis=0)
        assert outside.argmax() == A


def test_compressed_no_point_beside_the_crest_is_stressed_most_against_the_paper() -> None:
    for how in Drive:
        greatest = run(COMPRESSION, how).greatest[:, 1:-1].mean(axis=1)
        assert set(greatest.argmax(axis=1)) <= {A, F}


def test_stress_grows_as_it_says() -> None:
    found = run(COMPRESSION, Drive.DEFORMED)
    step = (found.stress[1] - found.stress[0]) / (found.time[1] - found.time[0])
    np.testing.assert_allclose(found.rate[0], step, rtol=1e-9)
    assert found.rate.shape == found.stress.shape == (7, 2, BELLOWS, 10)


def test_a_stroke_that_cannot_be_finished_is_refused_with_where_it_ended(monkeypatch) -> None:
    monkeypatch.setattr(latitudes, "_OPTIONS", Options(iterations=2, least_step=1.0))
    with pytest.raises(MechanicsError, match="does not get to -9 mm, deformed: the path stopped"):
        drive(GEOMETRY, EVA, Stroke(-9e-3, 1.0), Drive.DEFORMED, steps=1, resolution=COARSE)


def test_gas_that_turns_back_on_the_way_is_refused(monkeypatch) -> None:
    found = run(INFLATION, Drive.PUMPED)
    area = np.pi * (4.35e-3 - 0.15e-3) ** 2
    volume = BELLOWS * 3e-3 * area + area * found.elongation
    # so far below the pressure inside that gas first falls with the growing volume, then grows
    growth = np.gradient(found.pressure * volume, volume)
    monkeypatch.setattr(latitudes, "AMBIENT", -float(growth[3]))
    with pytest.raises(MechanicsError, match="the gas in the cavity turns back"):
        drive(GEOMETRY, EVA, INFLATION, Drive.PUMPED, steps=6, resolution=COARSE)


def test_flanks_are_watched_from_rest_on_until_they_pass_through_each_other() -> None:
    drawn, pressed = (run(s, Drive.DEFORMED).gap for s in (INFLATION, COMPRESSION))
    assert 0.0 < pressed[0] < GEOMETRY.pitch - GEOMETRY.wall_thickness
    assert np.all(np.diff(pressed) < 0)
    assert pressed[-1] < 0.0
    assert np.all(drawn[1:] > drawn[0])
