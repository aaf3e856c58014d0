"""What a material is known by, with units and sources, for every material that ships."""

from __future__ import annotations

import pytest

from rig.spec.workspace import Workspace, library_root
from rig.studio.pages.design import properties_html
from rig.studio.properties import UNKNOWN, properties_of

LIBRARY = Workspace(library_root())


@pytest.mark.parametrize("name", LIBRARY.names("material"))
def test_every_material_tells_its_constants_with_their_sources(name: str) -> None:
    rows = {row.what: row for row in properties_of(LIBRARY.material(name))}
    assert rows["Young's modulus"].value.endswith(" kPa")
    for what in ("Young's modulus", "Poisson's ratio", "density"):
        assert rows[what].source
    assert ("energy" in rows) != ("plasticity" in rows)


def test_the_default_material_is_told_as_its_file_has_it() -> None:
    rows = {row.what: row.value for row in properties_of(LIBRARY.material("agilus30"))}
    assert rows["Young's modulus"] == "450 kPa"
    assert rows["Poisson's ratio"] == "0.49"
    assert rows["density"] == "1160 kg/m³"
    assert rows["tensile strength"] == "2.4 MPa to 3.1 MPa"
    assert rows["elongation at break"] == "220 % to 270 %"
    assert rows["energy"] == "neo-hookean, from the two constants"


def test_a_range_of_one_value_is_that_value() -> None:
    rows = {row.what: row.value for row in properties_of(LIBRARY.material("ecoflex-00-30"))}
    assert rows["elongation at break"] == "900 %"


def test_what_is_not_known_is_said_and_what_a_file_says_is_no_markup() -> None:
    material = LIBRARY.material("agilus30")
    told = material.model_copy(update={"name": "<b>x</b>", "tensile_strength": None})
    assert {row.what: row.value for row in properties_of(told)}["tensile strength"] == UNKNOWN
    assert "<b>x" not in properties_html(told)
