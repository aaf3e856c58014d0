"""Input decks of bodies of revolution, read back, and run where CalculiX is installed."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine, RefQuad

from rig.mechanics.deck.elements import Program
from rig.mechanics.deck.material import Elastoplasticity, material_law
from rig.mechanics.deck.write import write_deck
from rig.mechanics.fe import Point, follow
from rig.mechanics.hyperelastic import HenckyVolume
from rig.mechanics.mesh.bellow_joint import JointResolution
from rig.mechanics.plasticity import J2Plasticity
from rig.mechanics.simulate.axisymmetric import axisymmetric_model
from rig.mechanics.simulate.joint import JointModel, joint_model
from rig.spec.actuator import BellowAxisymmetricGeometry, BellowJointGeometry
from rig.spec.workspace import Workspace, library_root
from tests.mechanics.deck_reader import DeckFile, read_deck, slopes_at, values_at

PRESSURE = 40e3
LIBRARY = Workspace(library_root(), is_library=True)
# Abaqus Analysis User's Guide, Section 28.1.3: corners anticlockwise, then the middles between them
_FACES = ((0, 4, 1), (1, 5, 2), (2, 6, 3), (3, 7, 0))


COARSE = JointResolution(wall=2, fifth=2, end=1, end_radius=3)


def _joint(resolution: JointResolution = COARSE) -> JointModel:
    geometry = BellowJointGeometry(family="bellow-joint", bellow_number=1)
    return joint_model(geometry, LIBRARY.material("eva-18"), resolution=resolution)


def _written(model, folder: Path, program: Program = Program.CALCULIX) -> DeckFile:
    write_deck(folder / "body.inp", model, pressure=PRESSURE, program=program, increments=2)
    return read_deck(folder / "body.inp")


def _volumes(deck: DeckFile) -> np.ndarray:
    """Of every element turned about the axis, in mm3; clockwise ones are negative."""
    points, weights = get_quadrature(RefQuad, 6)
    at, weights = 2 * points - 1, 4 * weights
    places = np.array([[deck.nodes[n] for n in nodes] for nodes in deck.elements.values()])
    slopes = np.einsum("end,niq->eqdi", places, slopes_at(8, at))
    radius = places[:, :, 0] @ values_at(8, at)
    return 2 * np.pi * (np.linalg.det(slopes) * radius) @ weights


def _enclosed(deck: DeckFile, faces: list[tuple[int, int]]) -> float:
    """Integral of pi r^2 dz along element edges, clockwise as seen from the solid, in mm3."""
    at, weights = get_quadrature(RefLine, 6)
    s = 2 * at[0] - 1
    values = np.array([s * (s - 1) / 2, 1 - s**2, s * (s + 1) / 2])
    slopes = np.array([s - 0.5, -2 * s, s + 0.5])
    total = 0.0
    for element, face in faces:
        nodes = [deck.elements[element][i] for i in _FACES[face - 1]]
        r, z = np.array([deck.nodes[n] for n in nodes]).T
        total -= float(np.pi * (r @ values) ** 2 * (z @ slopes) @ (2 * weights))
    return total


@pytest.mark.parametrize("make", ["axisymmetric", "joint"])
def test_a_meridians_deck_has_its_solid_its_supports_and_its_cavity(make, tmp_path) -> None:
    if make == "joint":
        model = _joint()
    else:
        geometry = BellowAxisymmetricGeometry(family="bellow-axisymmetric", bellow_number=2)
        model = axisymmetric_model(geometry, LIBRARY.material("dragon-skin-30"))
    deck = _written(model, tmp_path)
    assert deck.element_type == "CAX8R"
    volumes = _volumes(deck)
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(1e9 * model.shape.soft_volume, rel=5e-3)
    loads = deck.all("DLOAD")[-1].lines
    assert {float(line[2]) for line in loads} == {PRESSURE / 1e6}
    faces = [(e, int(label[1:])) for name, label, _ in loads for e in deck.element_sets[name]]
    rest = model.model.surface.rest_volume
    assert _enclosed(deck, faces) == pytest.approx(1e9 * rest, rel=1e-3)
    heights = {n: place[1] for n, place in deck.nodes.items()}
    low, high = min(heights.values()), max(heights.values())
    assert {heights[n] for n in deck.node_sets["CLAMPED"]} == {low}
    assert {heights[n] for n in deck.node_sets["TOP"]} == {high}
    on_axis = {n for n, place in deck.nodes.items() if place[0] == 0}
    assert set(deck.node_sets["AXIS"]) == on_axis
    held = [line for block in deck.all("BOUNDARY") for line in block.lines]
    assert held == [["CLAMPED", "1", "2"], ["AXIS", "1", "1"]]
    # no weight: no step for it, and no rigid cap
    assert len(deck.all("STEP")) == 1
    assert not deck.all("RIGID BODY")
    assert deck.all("NODE PRINT")[0].parameters["NSET"] == "TOP"


def test_abaqus_gets_hybrid_elements_of_revolution(tmp_path) -> None:
    assert _written(_joint(), tmp_path, Program.ABAQUS).element_type == "CAX8RH"


def test_elastic_plastic_solids_are_written_with_their_hardening() -> None:
    law = material_law(J2Plasticity(30e6, 10e6, 5e6), HenckyVolume(130e6))
    assert isinstance(law, Elastoplasticity)
    modulus = 9 * 130 * 30 / (3 * 130 + 30)
    (elastic, ((e, nu),)), (plastic, rows) = law.keywords
    assert (elastic, plastic) == ("ELASTIC", "PLASTIC")
    assert e == pytest.approx(modulus)
    assert e / (2 * (1 + nu)) == pytest.approx(30)
    (first, at_rest), (last, strain) = rows
    assert (first, at_rest) == (10.0, 0.0)
    assert (last - first) / strain == pytest.approx(5.0)
    perfect = material_law(J2Plasticity(30e6, 10e6), HenckyVolume(130e6))
    assert perfect.keywords[1] == ("PLASTIC", ((10.0, 0.0),))


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_calculix_raises_the_exported_joint_as_high(tmp_path) -> None:
    """Elastic-plastic, by half of its way to the limit pressure."""
    model = _joint(JointResolution())
    _written(model, tmp_path)
    result = follow(model.model, [Point(PRESSURE / 2), Point(PRESSURE)])
    assert result.failure is None
    subprocess.run(["ccx", "body"], cwd=tmp_path, capture_output=True, timeout=120, check=False)
    printed = (tmp_path / "body.dat").read_text(encoding="ascii")
    rises = re.findall(rf"^ +{model.top + 1} +\S+ +(\S+)", printed, re.MULTILINE)
    ours = [1e3 * model.measures(solution)["displacement"] for solution in result.solutions]
    assert [float(rise) for rise in rises] == pytest.approx(ours, rel=5e-3)
