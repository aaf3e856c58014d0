"""The design form: made from the specs, checked as files are, saved as they are read."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.mechanics.bellow import BellowShape
from rig.mechanics.model import predict
from rig.mechanics.profile import side_profile
from rig.mechanics.table import GRAM_FORCE
from rig.spec.loading import load_actuator
from rig.spec.workspace import Workspace, library_root
from rig.studio.charts import response_options
from rig.studio.curves import Beam
from rig.studio.design import (
    FAMILIES,
    LIMIT,
    blank,
    check,
    draft_of,
    form_fields,
    open_draft,
    save,
)
from rig.studio.drawing import profile_svg, section_svg
from rig.studio.errors import StudioError
from rig.studio.section import section_of

LIBRARY = Workspace(library_root())
DEFAULT = open_draft(LIBRARY, "bellow-bending")


@pytest.fixture
def lab(tmp_path: Path) -> Workspace:
    shutil.copytree(library_root() / "models", tmp_path / "models")
    (tmp_path / "calibration").mkdir()
    return Workspace(tmp_path)


@pytest.mark.parametrize("name", LIBRARY.names("actuator"))
def test_every_shipped_actuator_survives_the_form(name: str) -> None:
    draft = open_draft(LIBRARY, name)
    checked = check(draft, LIBRARY)
    assert checked.is_sound
    assert checked.spec is not None
    shipped = LIBRARY.actuator(name)
    assert checked.spec.geometry == shipped.geometry
    assert checked.spec.limits == shipped.limits
    assert checked.spec.tolerances == shipped.tolerances
    assert checked.spec.material == shipped.material
    assert draft_of(draft.text, Path("again.yaml")) == draft


@pytest.mark.parametrize("family", FAMILIES)
def test_the_defaults_of_every_family_are_sound(family: str) -> None:
    assert check(blank(family, "agilus30"), LIBRARY).is_sound


def test_fields_have_the_units_of_the_specs() -> None:
    fields = {f.name: f for f in form_fields("bellow-bending")}
    assert fields["geometry.effective_length"].unit == "mm"
    assert fields["geometry.radius_ratio"].unit == ""
    assert fields["geometry.bellow_number"].meaning == "N, convolutions from trough to trough"


def test_a_bare_number_is_in_the_unit_of_the_field() -> None:
    bare = check(DEFAULT.with_value("geometry.effective_length", "66"), LIBRARY)
    assert bare.spec is not None
    assert bare.spec.geometry == LIBRARY.actuator("bellow-bending").geometry


@pytest.mark.parametrize(
    ("field", "text", "said"),
    [
        ("geometry.wall_thickness", "thin", "is not a number with a unit"),
        ("geometry.wall_thickness", "", "expected a length"),
        ("geometry.wall_thickness", "3 kPa", "is a pressure, not a length"),
        ("geometry.bellow_number", "6.5", "whole number"),
        ("geometry.bellow_number", "six", "whole number"),
        (LIMIT, "0", "out of range"),
        (LIMIT, "100 MPa", "would tear the wall"),
    ],
)
def test_a_mistake_is_explained_at_its_field(field: str, text: str, said: str) -> None:
    checked = check(DEFAULT.with_value(field, text), LIBRARY)
    assert not checked.is_sound
    assert said in checked.problems[field]


def test_constraints_between_fields_are_explained_with_what_to_do() -> None:
    checked = check(DEFAULT.with_value("geometry.wall_thickness", "9 mm"), LIBRARY)
    assert len(checked.general) == 1
    assert "reduce wall_thickness below 2.75 mm" in checked.general[0]
    assert checked.spec is None


def test_a_material_is_a_name_of_the_workspace_and_no_path() -> None:
    path = str(library_root() / "models/materials/agilus30.yaml")
    for material in (path, "../materials/agilus30", "nothing", ""):
        assert "material" in check(replace(DEFAULT, material=material), LIBRARY).problems


@settings(max_examples=12)
@given(st.text(max_size=30), st.sampled_from(["name", "value"]))
def test_no_text_breaks_out_of_its_field(text: str, where: str) -> None:
    draft = (
        replace(DEFAULT, name=text)
        if where == "name"
        else DEFAULT.with_value("geometry.wall_thickness", text)
    )
    spec = check(draft, LIBRARY).spec
    if spec is not None:
        assert spec.material == "agilus30"
        assert spec.limits.pressure == pytest.approx(12e3)
        assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", spec.name)


def test_a_saved_design_is_the_one_that_was_drawn(lab: Workspace) -> None:
    draft = replace(DEFAULT, name="mine").with_value("geometry.wall_thickness", "1.4 mm")
    path = save(check(draft, lab), lab)
    assert path == lab.root / "models/actuators/mine.yaml"
    assert load_actuator(path) == check(draft, lab).spec
    with pytest.raises(StudioError, match="already"):
        save(check(draft, lab), lab)
    thinner = draft.with_value("geometry.wall_thickness", "1.3 mm")
    save(check(thinner, lab), lab, replacing=True)
    assert load_actuator(path) == check(thinner, lab).spec


def test_what_is_wrong_is_not_saved_and_the_library_stays_as_it_is(lab: Workspace) -> None:
    with pytest.raises(StudioError, match="mend what is marked"):
        save(check(replace(DEFAULT, name="../mine"), lab), lab)
    library = replace(LIBRARY, is_library=True)
    with pytest.raises(StudioError, match="rig init"):
        save(check(DEFAULT, library), library)


# --- drawing and curves ------------------------------------------------------------------------


def _area_and_moment(points: np.ndarray) -> float:
    x, z = points.T
    return 0.5 * float(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z))


def test_the_section_of_the_bellow_has_its_profile() -> None:
    geometry = LIBRARY.actuator("bellow-bending").geometry
    shape = BellowShape.of(geometry)  # type: ignore[arg-type]
    soft = [o.points for o in section_of(geometry) if o.paint == "soft"]
    hollow = [o.points for o in section_of(geometry) if o.paint == "hollow"]
    assert max(p[:, 1].max() for p in soft) == pytest.approx(shape.outer_radius + shape.wall)
    assert min(p[:, 1].min() for p in soft) == pytest.approx(shape.underside)
    # the bellow's hollow is its profile and the mirror image of it
    area = 2 * float(np.trapezoid(shape.cavity_profile(200)[:, 1], shape.cavity_profile(200)[:, 0]))
    found = max(abs(_area_and_moment(p)) for p in hollow)
    assert found == pytest.approx(area, rel=2e-3)


@pytest.mark.parametrize("name", LIBRARY.names("actuator"))
def test_every_actuator_is_drawn(name: str) -> None:
    spec = LIBRARY.actuator(name)
    svg = section_svg(section_of(spec.geometry), "a <title>")
    assert svg.count("<polygon") == len(section_of(spec.geometry)) >= 2
    assert "a &lt;title&gt;" in svg
    assert "nan" not in svg


def test_the_bent_shape_is_the_model_s_at_that_pressure() -> None:
    spec, material = LIBRARY.actuator("bellow-bending"), LIBRARY.material("agilus30")
    beam = Beam.of(spec, material)
    assert beam is not None
    bent = beam.bent(5e3)
    response = predict(spec, material, "beam", [5e3])
    assert response.angle is not None
    assert response.blocked_force is not None
    assert bent.angle_deg == pytest.approx(np.degrees(response.angle[0]))
    assert bent.force_g == pytest.approx(response.blocked_force[0] / GRAM_FORCE)
    expected = side_profile(beam.geometry, float(response.angle[0]))
    assert np.array_equal(bent.profile.end_cap, expected.end_cap)
    curve = beam.curve()
    assert curve.angle_deg is not None
    assert np.interp(5.0, curve.pressure_kpa, curve.angle_deg) == pytest.approx(
        bent.angle_deg, rel=1e-3
    )


def test_the_slider_never_leaves_the_theory() -> None:
    soft = check(DEFAULT.with_value(LIMIT, "60 kPa"), LIBRARY)
    assert soft.spec is not None
    assert soft.material is not None
    beam = Beam.of(soft.spec, soft.material)
    assert beam is not None
    assert beam.top_pressure < 60e3
    assert beam.bent(60e3).pressure_kpa == pytest.approx(beam.top_pressure / 1e3)
    assert beam.bent(-1.0).angle_deg == pytest.approx(0.0, abs=1e-9)


def test_the_window_holds_every_shape_of_the_slider() -> None:
    spec, material = LIBRARY.actuator("bellow-bending"), LIBRARY.material("agilus30")
    beam = Beam.of(spec, material)
    assert beam is not None
    left, bottom, right, top = beam.window
    for pressure in np.linspace(0, beam.top_pressure, 9):
        bent = beam.bent(float(pressure))
        points = 1e3 * np.concatenate([bent.profile.bellow, bent.profile.end_cap])
        assert points[:, 0].min() > left
        assert points[:, 0].max() < right
        assert points[:, 1].min() > bottom
        assert points[:, 1].max() < top
        assert profile_svg(bent.profile, beam.window, bent.words).count("<polygon") == 4


def test_a_family_without_beam_theory_has_none() -> None:
    spec, material = LIBRARY.actuator("bellow-joint"), LIBRARY.material("agilus30")
    assert Beam.of(spec, material) is None


def test_charts_tell_series_apart_without_colour_and_take_colours_from_the_page() -> None:
    spec, material = LIBRARY.actuator("bellow-bending"), LIBRARY.material("agilus30")
    beam = Beam.of(spec, material)
    assert beam is not None
    curve = beam.curve()
    options = response_options([curve, curve], [curve.angle_deg, curve.force_g], "angle", 5.0)
    first, second = options["series"]
    assert first["lineStyle"]["type"] != second["lineStyle"]["type"]
    assert first["lineStyle"]["color"] == "var(--series-1)"
    assert first["markLine"]["data"] == [{"xAxis": 5.0}]
    assert len(second["data"]) == curve.pressure_kpa.size
