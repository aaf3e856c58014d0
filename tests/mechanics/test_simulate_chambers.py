"""Rows of chambers by finite elements: layers, symmetry, bends past half a turn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.mechanics.chambers import ChamberRow
from rig.mechanics.fe import Point, Pose, RigidBody, follow
from rig.mechanics.fe.extremes import summarise
from rig.mechanics.fe.rotation import rotation_vector
from rig.mechanics.job import Job
from rig.mechanics.mesh.chamber_row import RowResolution, mesh_chamber_row
from rig.mechanics.simulate.bending import FREE_OPTIONS, bending_model_on
from rig.mechanics.simulate.chambers import (
    multi_chamber_bending_model,
    multi_chamber_linear_model,
    rectangular_bellow_model,
)
from rig.mechanics.simulate.energies import mixed_energies
from rig.mechanics.simulate.families import FAMILIES
from rig.mechanics.simulate.inflation import Inflation
from rig.mechanics.simulate.solids import Layer
from rig.spec.chambers import (
    BellowRectangularGeometry,
    MultiChamberBendingGeometry,
    MultiChamberLinearGeometry,
)
from rig.spec.loading import load_actuator
from rig.spec.workspace import Workspace

COARSE = RowResolution(0.01, 0.01)
BLOCK = MultiChamberBendingGeometry(family="multi-chamber-bending", chamber_number=2)


@pytest.fixture(scope="module")
def ecoflex():
    return Workspace.find().material("ecoflex-00-30")


def solved(actuator, *pressures):
    result = follow(actuator.model, [Point(p) for p in pressures], options=FREE_OPTIONS)
    assert result.failure is None
    return result.solutions


def test_a_linear_row_is_the_same_as_a_quarter_and_as_a_half(ecoflex):
    """The bending model of a row that is symmetric about its axis only lengthens."""
    linear = MultiChamberLinearGeometry(family="multi-chamber-linear", chamber_number=2)
    quarter = multi_chamber_linear_model(linear, ecoflex, resolution=COARSE)
    (one,) = solved(quarter, 10e3)
    body = mesh_chamber_row(ChamberRow.of(linear), COARSE)
    half = bending_model_on(body, ecoflex, acceleration=(0.0, 0.0, 0.0))
    (other,) = solved(half, 10e3)
    assert half.angle(other.state) == pytest.approx(0.0, abs=1e-9)
    # a cell that reaches across the axis is one element of the half, and half of one here
    assert half.volume(other) == pytest.approx(quarter.measures(one)["volume"], rel=2e-3)
    assert other.state.poses[0].shift[0] == pytest.approx(
        quarter.measures(one)["displacement"], rel=2e-3
    )
    assert quarter.measures(one)["displacement"] > 1e-4


def test_the_layer_keeps_its_length_and_so_the_row_bends(ecoflex):
    actuator = multi_chamber_bending_model(BLOCK, ecoflex, resolution=COARSE)
    (bent,) = solved(actuator, 20e3)
    d = actuator.model.discretisation
    line = d.nodes_at(y=0.0, z=0.0)
    line = line[np.argsort(d.nodes[line, 0])]
    moved = d.nodes[line] + bent.state.x[3 * line[:, None] + np.arange(3)]
    length = np.linalg.norm(np.diff(moved, axis=0), axis=1).sum()
    row = actuator.shape
    assert length == pytest.approx(row.end, rel=5e-3)
    assert np.degrees(actuator.angle(bent.state)) > 1.0


def test_strength_is_asked_of_the_actuator_s_material_not_of_its_layer(ecoflex):
    """The layer is a hundred times stiffer and carries the largest stress."""
    question = Inflation(
        "tip free",
        lambda: multi_chamber_bending_model(BLOCK, ecoflex, resolution=COARSE),
        "a row",
        limit=120e3,
        options=FREE_OPTIONS,
    )
    model, solutions = question.solutions(10e3, Job())
    every = summarise(model.model, solutions[-1])
    assert every.nominal_stress.solid == 1
    found = question.curves(10e3, Job()).extremes[-1]
    assert found.nominal_stress.solid == 0
    assert found.nominal_stress.value < 0.6 * every.nominal_stress.value


def test_a_layer_of_the_same_material_changes_nothing(ecoflex):
    body = mesh_chamber_row(ChamberRow.of(BLOCK), COARSE)
    soft = ecoflex.model_copy(update={"hyperelastic": None})
    distortion, volume = mixed_energies(soft)
    (one,) = solved(bending_model_on(body, soft), 5e3)
    layer = Layer(body.layer, distortion, volume)
    (other,) = solved(bending_model_on(body, soft, layer=layer), 5e3)
    np.testing.assert_allclose(one.state.x, other.state.x, atol=1e-9)


def test_bellows_bend_about_their_strain_limiting_layer():
    """Two bellows bend by a quarter of what the paper's nine do at 200 kPa, and take in volume."""
    geometry = BellowRectangularGeometry(family="bellow-rectangular", bellow_number=2)
    material = Workspace.find().material("ninjaflex-85a")
    actuator = rectangular_bellow_model(geometry, material, resolution=COARSE)
    solutions = solved(actuator, 0.0, 50e3, 100e3)
    angles = np.degrees([actuator.angle(s.state) for s in solutions])
    assert angles[0] == pytest.approx(0.0, abs=1e-6)
    # twice one bellow's on a fine mesh, 10.59 deg: docs/validation/chambers.md
    assert angles[1] == pytest.approx(21.2, rel=0.07)
    assert angles[2] - angles[1] < 0.7 * (angles[1] - angles[0])
    volumes = [actuator.volume(s) for s in solutions]
    assert np.all(np.diff(volumes) > 0)


class Tip:
    nodes = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.05, 0.0, 0.01]])
    displacement_size = 9
    dim = 3


def test_a_body_that_turns_about_one_axis_counts_past_half_a_turn():
    body = RigidBody(
        Tip,  # type: ignore[arg-type]
        np.array([1, 2]),
        free=("x", "z", "about_y"),
        centre=np.array([0.05, 0.0, 0.0]),
    )
    pose = Pose()
    for _ in range(8):
        pose = body.moved(pose, np.array([0.0, 0.0, 0.5]))
    assert pose.angles[1] == pytest.approx(4.0)
    assert rotation_vector(pose.rotation)[1] == pytest.approx(4.0 - 2 * np.pi)


@pytest.mark.slow
def test_the_longest_bellows_bend_past_half_a_turn():
    """Yin et al., Section III-B: r1 = 27.6 mm at 200 kPa, which is 242 deg over 116.6 mm."""
    actuator = load_actuator(Path("models/actuators/bellow-rectangular.yaml"))
    model = FAMILIES["bellow-rectangular"].model.free(
        actuator.geometry, Workspace.find().material(actuator.material)
    )
    solutions = solved(model, *np.linspace(0.0, 200e3, 13))
    angles = np.degrees([model.angle(s.state) for s in solutions])
    assert angles[-1] == pytest.approx(242, rel=0.1)
    growth = np.diff(angles)
    assert np.all(growth > 0)
    assert np.all(np.diff(growth) < 0)
