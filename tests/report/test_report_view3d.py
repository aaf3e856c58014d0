"""The 3D view and the safety factors: what travels in the page is what was calculated."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
from html_page import Page

from rig.mechanics.fe import (
    Extremes,
    Kinematics,
    Model,
    Point,
    PressureSurface,
    Solid,
    Solution,
    Support,
    discretise,
    follow,
    nodal_fields,
    summarise,
)
from rig.mechanics.fe.surface import surface_of
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume
from rig.mechanics.job import Job
from rig.mechanics.simulate.families import FAMILIES, Family, Meshing
from rig.record.reader import RunReader
from rig.report import view3d
from rig.report.build import analyse
from rig.report.page import render_report, render_strength
from rig.report.strength import StrengthSection, strength_section
from rig.report.view3d import Scene, scene_of, turned, view_of
from rig.spec.actuator import ActuatorSpec
from rig.spec.loading import load_actuator
from rig.spec.material import MaterialSpec
from rig.spec.workspace import Workspace
from tests.mechanics.fe_problems import BULK, SHEAR, bending_tube, ring
from tests.mechanics.test_simulate_inflation import TUBES, BendingTube

LIBRARY = Path(__file__).resolve().parents[2] / "models"
ACTUATOR = LIBRARY / "actuators" / "bellow-bending.yaml"
TOP = 3e3
BROWSER = shutil.which("chromium")


@pytest.fixture(scope="module")
def solved() -> tuple[Model, tuple[Solution, ...]]:
    model = bending_tube().model
    result = follow(model, [Point(0.0), Point(1e3), Point(2e3)])
    assert result.failure is None
    return model, result.solutions


@pytest.fixture(scope="module")
def extremes(solved: tuple[Model, tuple[Solution, ...]]) -> list[Extremes]:
    model, solutions = solved
    return [summarise(model, solution) for solution in solutions]


@pytest.fixture(scope="module")
def scene(solved: tuple[Model, tuple[Solution, ...]], extremes: list[Extremes]) -> Scene:
    return scene_of(*solved, extremes, mirror=1)


@pytest.fixture(scope="module")
def specs() -> tuple[ActuatorSpec, MaterialSpec]:
    actuator = load_actuator(ACTUATOR)
    return actuator, Workspace.find(ACTUATOR).material(actuator.material)


@pytest.fixture(scope="module")
def section(specs: tuple[ActuatorSpec, MaterialSpec]) -> StrengthSection:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(FAMILIES, "bellow-bending", TUBES)
        return strength_section(*specs, TOP, Job())


@pytest.fixture(scope="module")
def page(section: StrengthSection) -> str:
    return render_strength(section, "tube, Agilus30")


def _unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def test_the_page_carries_shape_and_colours_of_every_step(
    solved: tuple[Model, tuple[Solution, ...]], scene: Scene
) -> None:
    model, solutions = solved
    data = json.loads(view_of(scene).data)
    surface = surface_of(model, 1)
    triangles = _unpacked(data["triangles"], "<u2").reshape(-1, 3)
    np.testing.assert_array_equal(triangles, np.concatenate((surface.outside, surface.inside)))
    assert data["outside"] == surface.outside.size
    assert data["mirror"] == 1
    assert [step["kpa"] for step in data["steps"]] == [0.0, 1.0, 2.0]
    rest = model.discretisation.nodes[surface.node]
    for step, solution in zip(data["steps"], solutions, strict=True):
        share = _unpacked(step["at"], "<u2").reshape(-1, 3) / 0xFFFF
        places = np.array(data["low"]) + share * np.array(data["size"])
        moved = solution.state.x[: model.discretisation.displacement_size].reshape(-1, 3)
        # half a step of the quantisation, a micrometre over this tube
        np.testing.assert_allclose(places, rest + moved[surface.node], atol=1e-6)
        (fields,) = nodal_fields(model, solution.state)
        quantity = data["quantities"][0]
        shade = _unpacked(step["values"][0], "u1") / 255
        wanted = fields.von_mises[surface.entry] / 1e3 / quantity["high"]
        np.testing.assert_allclose(shade, np.clip(wanted, 0, 1), atol=0.5 / 255 + 1e-9)
        peak = summarise(model, solution).von_mises
        assert f"{1e-3 * peak.value:.3g} kPa at most" in step["peaks"][0]


def test_colours_end_at_what_nearly_all_material_stays_below(scene: Scene) -> None:
    stress, stretch = scene.quantities
    bulk = scene.extremes[-1].von_mises.bulk / 1e3
    assert bulk <= stress.high <= 1.5 * bulk
    assert stretch.low == 1.0
    assert scene.extremes[-1].principal_strain.bulk <= stretch.high - 1


def test_steps_are_left_out_evenly_where_there_is_no_room_for_all(
    solved: tuple[Model, tuple[Solution, ...]],
    extremes: list[Extremes],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model, solutions = solved
    vertices = len(surface_of(model, 1).node)
    monkeypatch.setattr(view3d, "BUDGET", 8 * vertices * 2)
    found = scene_of(model, solutions, extremes, mirror=1)
    np.testing.assert_allclose(found.pressures, [0.0, 2e3])
    assert [e.pressure for e in found.extremes] == pytest.approx([0.0, 2e3])


def test_the_view_turns_without_changing_lengths_or_hands() -> None:
    frame = turned(0.7, -0.4)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    # at rest x hangs down, and whoever looks at the section stands at negative y
    np.testing.assert_allclose(turned(0, 0) @ [1, 0, 0], [0, -1, 0])
    np.testing.assert_allclose(turned(0, 0) @ [0, -1, 0], [0, 0, 1])


def test_the_still_picture_shows_the_whole_body_in_its_colours(scene: Scene) -> None:
    encoded = view_of(scene).still.removeprefix("data:image/png;base64,")
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(encoded), np.uint8), cv2.IMREAD_UNCHANGED)
    assert picture.shape == (view3d.STILL_PX, view3d.STILL_PX, 4)
    seen = picture[..., 3] > 0
    assert 0.1 < seen.mean() < 0.9
    # what the picture covers is the shadow of both halves
    places = scene.positions[-1] @ turned(view3d.YAW, view3d.PITCH).T
    image = scene.positions[-1] * [1, -1, 1] @ turned(view3d.YAW, view3d.PITCH).T
    both = np.concatenate((places, image))[:, :2]
    rows, columns = np.nonzero(seen)
    drawn = np.ptp(columns) / np.ptp(rows)
    assert drawn == pytest.approx(np.ptp(both[:, 0]) / np.ptp(both[:, 1]), rel=0.02)
    assert len(np.unique(picture[seen][:, :3], axis=0)) > 100


def test_the_page_is_offline_well_formed_and_the_same_every_time(
    page: str, section: StrengthSection
) -> None:
    taken_apart = Page(page)
    for _, attributes in taken_apart.elements:
        for name in ("src", "href"):
            assert (attributes.get(name) or "#").startswith(("#", "data:"))
    assert not re.findall(r"https?://", page)
    assert "fetch(" not in page
    assert "import(" not in page
    assert page == render_strength(section, "tube, Agilus30")
    (canvas,) = taken_apart.all("canvas")
    assert canvas["tabindex"] == "0"
    assert canvas["aria-label"]
    (picture,) = taken_apart.all("img")
    assert picture["alt"]
    assert f'id="{canvas["aria-describedby"]}"' in page


def test_safety_factors_are_told_per_pressure(section: StrengthSection, page: str) -> None:
    assert [row.pressure_kpa for row in section.rows] == pytest.approx([0.0, 1.0, 2.0, 3.0])
    last = section.rows[-1]
    strain = last.strain_percent / 100
    low, high = last.factors[section.criteria[1]]
    assert low == pytest.approx(2.2 / strain)
    assert high == pytest.approx(2.7 / strain)
    assert last.governing is min(last.factors, key=lambda c: last.factors[c][0])
    assert "reference [20]" in page


def test_a_material_without_strength_gets_no_factors(
    specs: tuple[ActuatorSpec, MaterialSpec], monkeypatch: pytest.MonkeyPatch
) -> None:
    actuator, material = specs
    monkeypatch.setitem(FAMILIES, "bellow-bending", TUBES)
    bare = material.model_copy(update={"tensile_strength": None, "elongation_at_break": None})
    found = strength_section(actuator, bare, 1e3, Job())
    assert found.criteria == ()
    assert "there are no safety factors" in render_strength(found, "tube")


def test_a_model_in_the_plane_has_factors_but_nothing_to_turn(
    specs: tuple[ActuatorSpec, MaterialSpec], monkeypatch: pytest.MonkeyPatch
) -> None:
    d = discretise(ring(1, 2, 0.01, 0.02), Kinematics.AXISYMMETRIC)
    solid = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))
    base = Support.of(d, d.nodes_at(z=0.0), (0, 1))
    bore = PressureSurface(d, d.facets_on("bore"))
    actuator = BendingTube()
    actuator.model = Model(d, [solid], supports=[base], surface=bore)
    actuator.measures = lambda solution: {"displacement": 0.0, "volume": solution.volume}
    meshing = Meshing(*[lambda geometry, material: actuator] * 2)
    flat = Family(meshing, meshing)
    monkeypatch.setitem(FAMILIES, "bellow-bending", flat)
    found = strength_section(*specs, 1e3, Job())
    assert found.view is None
    assert found.rows[-1].von_mises_kpa > 0.5
    page = Page(render_strength(found, "dome"))
    assert not list(page.all("canvas"))
    assert len(list(page.all("table"))) == 1


def test_the_report_embeds_the_view(run_folder: Path, section: StrengthSection) -> None:
    analysis = analyse(RunReader(run_folder))
    text = render_report(analysis.data, analysis.summary, analysis.predictions, section)
    report = Page(text)
    assert len(list(report.all("canvas"))) == 1
    ids = [a["id"] for _, a in report.elements if "id" in a]
    assert len(ids) == len(set(ids))


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs chromium")
@pytest.mark.parametrize("query", ["", "?painter"])
def test_a_browser_draws_the_shape_where_the_still_picture_was(
    page: str, tmp_path: Path, query: str
) -> None:
    """With WebGL and with the painter: after a change of pressure, colour and section."""
    change = """<script>
      const get = (name) => document.querySelector("." + name);
      get("cut").click();
      get("quantity").value = 1;
      get("quantity").dispatchEvent(new Event("change"));
      get("pressure").value = 1.5;
      get("pressure").dispatchEvent(new Event("input"));
      // how much of the canvas is painted, looked at until the browser ends
      const small = Object.assign(document.createElement("canvas"), { width: 64, height: 64 });
      const brush = small.getContext("2d", { willReadFrequently: true });
      setInterval(() => {
        brush.clearRect(0, 0, 64, 64);
        brush.drawImage(get("live"), 0, 0, 64, 64);
        const pixels = brush.getImageData(0, 0, 64, 64).data;
        let painted = 0;
        for (let i = 3; i < pixels.length; i += 4) painted += pixels[i] > 127;
        document.body.dataset.painted = painted / 4096;
      }, 200);
    </script></body>"""
    file = tmp_path / "view.html"
    file.write_text(page.replace("</body>", change))
    dom = subprocess.run(
        [
            *(str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle"),
            *("--use-angle=swiftshader", "--no-first-run", "--disable-background-networking"),
            *("--virtual-time-budget=8000", "--window-size=800,1000"),
            *(f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", f"file://{file}{query}"),
        ],
        check=True,
        capture_output=True,
        timeout=120,
        text=True,
    ).stdout
    assert "Largest principal stretch at 1.5 kPa: drawn between the calculated 1 and 2 kPa." in dom
    painted = re.search(r'data-painted="([0-9.]+)"', dom)
    assert painted is not None
    assert 0.05 < float(painted[1]) < 0.9
