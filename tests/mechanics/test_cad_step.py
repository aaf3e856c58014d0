"""Exact solids and STEP files against closed-form volumes; skipped where netgen is missing."""

from __future__ import annotations

import sys

import pytest

from rig.mechanics.bellow import BellowShape
from rig.mechanics.cad.brep import build, write_step
from rig.mechanics.cad.errors import CadError
from rig.mechanics.cad.parts import parts_of
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricBellow
from rig.spec.actuator import BellowAxisymmetricGeometry, BellowBendingGeometry

occ = pytest.importorskip("netgen.occ", reason="netgen is not installed")


def one_convolution() -> BellowBendingGeometry:
    return BellowBendingGeometry.model_validate(
        {"family": "bellow-bending", "bellow_number": 1, "effective_length": 11}
    )


def test_step_files_hold_every_part_by_name_with_its_exact_volume(tmp_path):
    geometry = one_convolution()
    shape = BellowShape.of(geometry)
    path = tmp_path / "bellow.step"
    write_step(path, parts_of(geometry))
    solids = {solid.name: solid.mass for solid in occ.OCCGeometry(str(path)).shape.solids}
    assert set(solids) == {"soft", "connector", "cap"}
    assert solids["soft"] == pytest.approx(shape.soft_volume * 1e9, rel=1e-6)
    assert solids["cap"] == pytest.approx(shape.cap_volume * 1e9, rel=1e-9)
    assert "SI_UNIT(.MILLI.,.METRE.)" in path.read_text()


@pytest.mark.parametrize("ratio", [2.0, 3.0])
def test_axisymmetric_solids_are_exact(ratio):
    geometry = BellowAxisymmetricGeometry(family="bellow-axisymmetric", divided_ratio=ratio)
    shape = AxisymmetricBellow.of(geometry)
    assert build(parts_of(geometry)[0].solid).mass == pytest.approx(
        shape.soft_volume * 1e9, rel=1e-9
    )


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(CadError, match="no folder"):
        write_step(tmp_path / "nowhere" / "a.step", parts_of(one_convolution()))


def test_a_missing_library_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "netgen.occ", None)
    with pytest.raises(CadError, match="pip install netgen-mesher"):
        build(parts_of(one_convolution())[0].solid)
