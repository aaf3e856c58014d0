"""`rig predict --vtu`: the fields of what was solved, or why there are none."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from rig.mechanics.simulate.families import FAMILIES
from tests.mechanics.test_simulate_inflation import TUBES

from .conftest import Command

SPEC = "models/actuators/bellow-bending.yaml"


@pytest.fixture(autouse=True)
def a_small_model(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Stands in for the bellow, which takes longer; results go to a cache of the test's own."""
    monkeypatch.setitem(FAMILIES, "bellow-bending", TUBES)
    monkeypatch.setenv("RIG_CACHE_DIR", str(tmp_path / "cache"))


def test_fields_come_at_the_pressures_solved_for(rig: Command, tmp_path: Path) -> None:
    folder = tmp_path / "fields"
    outcome = rig(
        *("predict", "--actuator", SPEC, "--model", "beam,fe", "--pressures", "0:1.5:0.5"),
        *("--vtu", folder),
    )
    assert outcome.code == 0, outcome.err
    sets = ElementTree.parse(folder / "solutions.pvd").getroot().findall("Collection/DataSet")
    assert [float(s.attrib["timestep"]) for s in sets] == [0.0, 1.0, 2.0]
    assert sorted(p.name for p in folder.glob("*.vtu")) == [s.attrib["file"] for s in sets]


def test_a_page_to_turn_is_written(rig: Command, tmp_path: Path) -> None:
    page = tmp_path / "view.html"
    asked = ("predict", "--actuator", SPEC, "--model", "fe", "--pressures", "0:1:1", "--view")
    assert rig(*asked, page).code == 0
    assert "bellow-bending, Agilus30" in page.read_text()
    outcome = rig(*asked, tmp_path / "no folder" / "view.html")
    assert outcome.code == 1
    assert "the view cannot be written to" in outcome.err


def test_fields_without_finite_elements_are_refused(rig: Command, tmp_path: Path) -> None:
    for option in ("--vtu", "--view"):
        outcome = rig("predict", "--actuator", SPEC, "--model", "beam", option, tmp_path)
        assert outcome.code == 2
        assert "add --model fe" in outcome.err
