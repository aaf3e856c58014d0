"""Input decks, read back: do they say what the model is?"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import skfem

from rig.mechanics.chambers import ChamberRow
from rig.mechanics.deck.build import deck_model
from rig.mechanics.deck.elements import Program, elements_of
from rig.mechanics.deck.errors import DeckError
from rig.mechanics.deck.material import hyperelasticity
from rig.mechanics.deck.write import write_deck
from rig.mechanics.fe import Kinematics, discretise
from rig.mechanics.hyperelastic import (
    ArrudaBoyce,
    LogarithmicVolume,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    OgdenTerm,
    QuadraticVolume,
    SaintVenantKirchhoff,
    Yeoh,
)
from rig.mechanics.mesh.bellow_bending import mesh_bending_bellow
from rig.mechanics.mesh.bellow_tetrahedra import mesh_bending_bellow_tetrahedra
from rig.mechanics.mesh.measure import solid_volume
from rig.mechanics.simulate.bending import BendingModel, bending_model_on
from rig.mechanics.simulate.families import FAMILIES, Family, Meshing
from rig.spec.actuator import BellowBendingGeometry
from rig.spec.loading import load_actuator
from rig.spec.workspace import Workspace
from tests.mechanics.deck_reader import DeckFile, read_deck

PRESSURE = 2e3
SHORT = {"family": "bellow-bending", "bellow_number": 1, "effective_length": 11}


@pytest.fixture(scope="module", params=["hexahedra", "tetrahedra"])
def exported(request, agilus30, tmp_path_factory) -> tuple[BendingModel, DeckFile]:
    geometry = BellowBendingGeometry.model_validate(SHORT)
    if request.param == "tetrahedra":
        pytest.importorskip("netgen.occ", reason="netgen is not installed")
        body = mesh_bending_bellow_tetrahedra(geometry, 3e-3)
    else:
        body = mesh_bending_bellow(geometry)
    model = bending_model_on(body, agilus30)
    path = tmp_path_factory.mktemp("deck") / "bellow.inp"
    write_deck(path, model, pressure=PRESSURE, program=Program.CALCULIX)
    return model, read_deck(path)


def test_every_element_has_its_nodes_and_every_node_an_element(exported) -> None:
    _, deck = exported
    used = {node for nodes in deck.elements.values() for node in nodes}
    references = {*deck.node_sets["CAP_REFERENCE"], *deck.node_sets["CAP_ROTATION"]}
    assert used | references == set(deck.nodes)
    assert not used & references
    for name in ("CLAMPED", "SYMMETRY", "CAP"):
        assert set(deck.node_sets[name]) <= used


def test_elements_are_right_handed_and_fill_the_solid(exported) -> None:
    model, deck = exported
    assert min(determinant.min() for determinant, _ in deck.jacobians()) > 0
    # twenty nodes bend the faces between the edges a little less than twenty-seven
    solid = 1e9 * solid_volume(model.model.discretisation.mesh)
    assert deck.volume() == pytest.approx(solid, rel=1e-9 if deck.element_type == "C3D10" else 1e-3)


def test_the_boundary_is_closed_and_encloses_what_the_elements_fill(exported) -> None:
    _, deck = exported
    area, volume = deck.surface(deck.boundary())
    assert np.abs(area).max() < 1e-8
    assert volume == pytest.approx(deck.volume(), rel=1e-9)


def test_pressure_acts_on_the_whole_wall_of_the_cavity(exported) -> None:
    model, deck = exported
    loads = {line[0]: line for line in deck.all("DLOAD")[-1].lines}
    faces = [
        (element, int(label[1:]))
        for name, label, _ in loads.values()
        for element in deck.element_sets[name]
    ]
    assert set(faces) <= set(deck.boundary())
    assert {float(line[2]) for line in loads.values()} == {PRESSURE / 1e6}
    area, volume = deck.surface(faces)
    assert -volume == pytest.approx(1e9 * model.model.surface.rest_volume, rel=1e-3)
    # the cavity is open at the plane of symmetry only
    assert np.abs(area[[0, 2]]).max() < 1e-8
    assert area[1] < 0
    surface = deck.all("SURFACE")[0]
    assert [(a, b.replace("S", "P")) for a, b in surface.lines] == [
        (name, label) for name, label, _ in loads.values()
    ]


def test_supports_lie_where_they_say(exported) -> None:
    model, deck = exported
    shape = model.shape

    def places(name: str) -> np.ndarray:
        return np.array([deck.nodes[n] for n in deck.node_sets[name]])

    assert np.allclose(places("CLAMPED")[:, 0], -1e3 * shape.wall)
    assert np.allclose(places("SYMMETRY")[:, 1], 0.0, atol=1e-9)
    far = 1e3 * (shape.effective_length + shape.wall)
    assert np.allclose(places("CAP")[:, 0], far)
    on_cap = [n for n, place in deck.nodes.items() if abs(place[0] - far) < 1e-9]
    assert sorted(deck.node_sets["CAP"]) == sorted(on_cap)
    # what a rigid body moves must not be held beside
    assert not set(deck.node_sets["CAP"]) & set(deck.node_sets["SYMMETRY"])
    (rigid,) = deck.all("RIGID BODY")
    reference, rotation = int(rigid.parameters["REF NODE"]), int(rigid.parameters["ROT NODE"])
    held = {tuple(line) for line in deck.all("BOUNDARY")[0].lines}
    assert {("CLAMPED", "1", "3"), ("SYMMETRY", "2", "2")} <= held
    assert {(str(reference), "2", "2"), (str(rotation), "1", "1"), (str(rotation), "3", "3")} < held
    assert len(held) == 5


def test_weights_are_those_of_the_model_in_tonnes_and_millimetres(exported) -> None:
    model, deck = exported
    density = float(deck.all("DENSITY")[0].lines[0][0])
    _, label, size, *direction = deck.all("DLOAD")[0].lines[0]
    assert label == "GRAV"
    weight = density * deck.volume() * float(size) * np.array(direction, dtype=float)
    dead = model.model.dead_load[: model.model.discretisation.displacement_size].reshape(-1, 3)
    assert weight == pytest.approx(dead.sum(axis=0), rel=1e-3, abs=1e-12)
    (line,) = deck.all("CLOAD")[0].lines
    assert line[0] == str(deck.node_sets["CAP_REFERENCE"][0])
    assert line[1] == "1"
    assert float(line[2]) == pytest.approx(model.model.bodies[0].weight[0])
    assert [step.parameters["NLGEOM"] for step in deck.all("STEP")] == ["YES", "YES"]


def test_calculix_prints_at_equal_steps_of_pressure_wherever_its_increments_end(exported) -> None:
    _, deck = exported
    (times,) = deck.all("TIME POINTS")
    # CalculiX 2.20 stops at a GENERATE of a single time, and reads eight to a line
    told = [float(value) for line in times.lines for value in line]
    assert told == pytest.approx(np.arange(1, 11) / 10)
    assert max(len(line) for line in times.lines) <= 8
    for keyword in ("NODE PRINT", "NODE FILE", "EL FILE"):
        names = {block.parameters.get("TIME POINTS") for block in deck.all(keyword)}
        assert names == {times.parameters["NAME"]}


def test_abaqus_gets_hybrid_elements_and_turns_the_reference_node_itself(
    agilus30, tmp_path: Path
) -> None:
    body = mesh_bending_bellow(BellowBendingGeometry.model_validate(SHORT))
    path = tmp_path / "abaqus.inp"
    model = bending_model_on(body, agilus30, acceleration=(0.0, 0.0, 0.0))
    write_deck(path, model, pressure=PRESSURE, program=Program.ABAQUS)
    deck = read_deck(path)
    assert deck.element_type == "C3D20RH"
    (rigid,) = deck.all("RIGID BODY")
    assert rigid.parameters.keys() == {"REF NODE", "TIE NSET"}
    reference = rigid.parameters["REF NODE"]
    held = [line for line in deck.all("BOUNDARY")[0].lines if line[0] == reference]
    assert [line[1] for line in held] == ["2", "4", "6"]
    assert not deck.all("TIME POINTS"), "Abaqus has them for other output only"
    # without gravity there is no step for it
    assert len(deck.all("STEP")) == 1
    assert not deck.all("CLOAD")


K = 7.5e6
D = 2 / 7.5  # 1/MPa


@pytest.mark.parametrize(
    ("energy", "model", "constants"),
    [
        (NeoHookean(0.15e6), "NEO HOOKE", (0.075, D)),
        (MooneyRivlin(0.1e6, 0.02e6), "MOONEY-RIVLIN", (0.1, 0.02, D)),
        (
            MooneyRivlin(0.1e6, 0.02e6, c11=3e3, c20=4e3, c02=5e3),
            "POLYNOMIAL, N=2",
            (0.1, 0.02, 0.004, 0.003, 0.005, D, 0.0),
        ),
        (Yeoh(0.1e6, 2e3, 3e1), "YEOH", (0.1, 2e-3, 3e-5, D, 0.0, 0.0)),
        (
            Ogden((OgdenTerm(0.1e6, 2.0), OgdenTerm(-0.02e6, -1.5))),
            "OGDEN, N=2",
            (0.1, 2.0, -0.02, -1.5, D, 0.0),
        ),
        (Ogden.classic([(0.1e6, 3.0)]), "OGDEN, N=1", (0.15, 3.0, D)),
        (ArrudaBoyce(0.1e6, 3.0), "ARRUDA-BOYCE", (0.1, 3.0, D)),
    ],
)
def test_constants_are_written_as_the_programs_define_them(energy, model, constants) -> None:
    written = hyperelasticity(energy, QuadraticVolume(K))
    assert written.model == model
    assert written.constants == pytest.approx(constants)


def test_a_volumetric_function_that_is_replaced_is_remarked() -> None:
    assert not hyperelasticity(NeoHookean(1e5), QuadraticVolume(K)).remark
    assert not hyperelasticity(ArrudaBoyce(1e5, 3.0), LogarithmicVolume(K)).remark
    assert "(J - 1)^2" in hyperelasticity(NeoHookean(1e5), LogarithmicVolume(K)).remark
    assert "ln J" in hyperelasticity(ArrudaBoyce(1e5, 3.0), QuadraticVolume(K)).remark


def test_what_has_no_counterpart_is_refused(agilus30, tmp_path: Path) -> None:
    with pytest.raises(DeckError, match="SaintVenantKirchhoff"):
        hyperelasticity(SaintVenantKirchhoff(1e5, 0.3), QuadraticVolume(K))
    with pytest.raises(DeckError, match="MeshQuad1 in plane strain"):
        elements_of(discretise(skfem.MeshQuad(), Kinematics.PLANE_STRAIN))
    body = mesh_bending_bellow(BellowBendingGeometry.model_validate(SHORT))
    with pytest.raises(DeckError, match=r"nowhere/x\.inp"):
        write_deck(
            tmp_path / "nowhere" / "x.inp", bending_model_on(body, agilus30), pressure=PRESSURE
        )


@pytest.mark.parametrize(
    ("name", "planes"),
    [
        ("multi-chamber-bending", {"SYMMETRY": 2}),
        ("multi-chamber-linear", {"SYMMETRY": 2, "FLOOR": 3}),
    ],
)
def test_rows_of_chambers_have_their_planes_materials_and_cap(name, planes, tmp_path) -> None:
    actuator = load_actuator(Path(f"models/actuators/{name}.yaml"))
    material = Workspace.find().material(actuator.material)
    model = deck_model(actuator, material)
    path = tmp_path / "row.inp"
    write_deck(path, model, pressure=PRESSURE, program=Program.CALCULIX)
    deck = read_deck(path)
    row = ChamberRow.of(actuator.geometry)
    share = 2 * len(planes)
    assert share * deck.volume() == pytest.approx(1e9 * row.soft_volume, rel=1e-9)
    held = [line for block in deck.all("BOUNDARY") for line in block.lines]
    for plane, component in planes.items():
        assert [plane, str(component), str(component)] in held
    laws = {b.parameters["NAME"]: b.parameters for b in deck.all("MATERIAL")}
    sections = {b.parameters["ELSET"]: b.parameters["MATERIAL"] for b in deck.all("SOLID SECTION")}
    assert set(sections.values()) == set(laws)
    layered = name == "multi-chamber-bending"
    assert set(sections) == ({"SOFT", "LAYER"} if layered else {"SOFT"})
    (reference,) = deck.node_sets["CAP_REFERENCE"]
    free = {1, 3} if layered else {1}
    motions = {int(line[1]) for line in held if line[0] == str(reference)}
    assert motions == {1, 2, 3} - free


def test_a_model_that_decks_have_no_words_for_is_refused(agilus30, monkeypatch) -> None:
    actuator = load_actuator(Path("models/actuators/bellow-axisymmetric.yaml"))
    meshing = Meshing(*[lambda geometry, material: object()] * 2)
    wordless = Family(meshing, meshing)
    monkeypatch.setitem(FAMILIES, "bellow-axisymmetric", wordless)
    with pytest.raises(DeckError, match="no input deck of the family 'bellow-axisymmetric'"):
        deck_model(actuator, agilus30)
