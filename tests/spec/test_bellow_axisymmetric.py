"""Constraints of the axisymmetric bellow: refused with the reason, at the place in the file."""

from __future__ import annotations

from pathlib import Path

import pytest

from rig.spec.actuator import ActuatorSpec, BellowAxisymmetricGeometry
from rig.spec.consistency import pressure_beyond_material
from rig.spec.errors import SpecError
from rig.spec.loading import load_actuator, parse
from rig.spec.workspace import Workspace, library_root

ACTUATOR = library_root() / "models/actuators/bellow-axisymmetric.yaml"


def edited(old: str, new: str) -> str:
    text = ACTUATOR.read_text(encoding="utf-8")
    assert old in text
    return text.replace(old, new)


def test_the_example_is_the_optimised_design_of_the_paper() -> None:
    geometry = load_actuator(ACTUATOR).geometry
    assert geometry == BellowAxisymmetricGeometry(family="bellow-axisymmetric")
    assert geometry.pitch == pytest.approx(4.5e-3)  # (35 - 5 - 3) / 6 mm, eq. 11
    assert geometry.rise == pytest.approx(2.25e-3)  # a half circle, eq. 12


@pytest.mark.parametrize(
    ("old", "new", "reason", "remedy"),
    [
        ("divided_ratio: 2 ", "divided_ratio: 1.9 ", "arcs run into each other", "divided_ratio"),
        ("wall_thickness: 3 mm", "wall_thickness: 20 mm", "leaves no cavity", "top_diameter"),
        ("base_height: 5 mm", "base_height: 32 mm", "layers have no height", "base_height"),
    ],
)
def test_what_describes_no_solid_is_refused_with_reason_and_remedy(
    old: str, new: str, reason: str, remedy: str
) -> None:
    with pytest.raises(SpecError, match=reason) as caught:
        parse(edited(old, new), Path("file.yaml"), ActuatorSpec)
    (problem,) = caught.value.problems
    assert problem.field == "geometry"
    assert remedy in problem.message


def test_keys_of_another_family_are_named() -> None:
    text = edited("  base_height: 5 mm", "  frame_connector_thickness: 5 mm")
    with pytest.raises(SpecError, match="unknown key 'frame_connector_thickness'"):
        parse(text, Path("file.yaml"), ActuatorSpec)


def test_a_pressure_that_tears_the_wall_is_refused() -> None:
    workspace = Workspace(library_root(), is_library=True)
    actuator = workspace.actuator("bellow-axisymmetric")
    material = workspace.material("dragon-skin-30")
    assert pressure_beyond_material(actuator, material) is None
    # a thin tube of radius 17 + 2.25 mm: 3.43 MPa 3 / 19.25 = 534.5 kPa
    for pressure, is_refused in ((534e3, False), (535e3, True)):
        limits = actuator.limits.model_copy(update={"pressure": pressure})
        why = pressure_beyond_material(actuator.model_copy(update={"limits": limits}), material)
        assert (why is not None) == is_refused
