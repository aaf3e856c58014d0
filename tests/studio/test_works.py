"""What the studio exports is the actuator that was drawn."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

from rig.mechanics.bellow import BellowShape, bending_geometry
from rig.mechanics.cad.stl import is_watertight, read_stl, volume
from rig.spec.workspace import Workspace, library_root
from rig.studio.works import export

LIBRARY = Workspace(library_root())
SPEC = LIBRARY.actuator("bellow-bending")
MATERIAL = LIBRARY.material("agilus30")


def silent(_text: str) -> bool:
    return True


def test_stl_of_all_parts(tmp_path: Path) -> None:
    pytest.importorskip("manifold3d", reason="triangulated solids need manifold3d")
    file = export(silent, SPEC, MATERIAL, "stl")
    assert file.name == "bellow-bending-stl.zip"
    with zipfile.ZipFile(io.BytesIO(file.content)) as packed:
        assert sorted(packed.namelist()) == [
            "bellow-bending-cap.stl",
            "bellow-bending-connector.stl",
            "bellow-bending.stl",
        ]
        packed.extract("bellow-bending.stl", tmp_path)
    soft = read_stl(tmp_path / "bellow-bending.stl")
    assert is_watertight(soft)
    geometry = bending_geometry(SPEC, "This test")
    assert volume(soft) == pytest.approx(BellowShape.of(geometry).soft_volume, rel=2e-3)


def test_the_input_deck_is_one_file() -> None:
    file = export(silent, SPEC, MATERIAL, "inp")
    assert file.name == "bellow-bending.inp"
    assert b"*NODE" in file.content.upper()
