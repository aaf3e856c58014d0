"""`rig export` as a person uses it."""

from __future__ import annotations

from pathlib import Path

import pytest

from rig.mechanics.cad.stl import is_watertight, read_stl
from tests.mechanics.deck_reader import read_deck

from .conftest import Command

ACTUATOR = "models/actuators/bellow-bending.yaml"


def test_stl_of_every_part_is_written_and_watertight(rig: Command, tmp_path: Path) -> None:
    pytest.importorskip("manifold3d")
    out = tmp_path / "bellow.stl"
    outcome = rig("export", "--actuator", ACTUATOR, "--stl", out, "--tolerance", "0.1 mm")
    assert outcome.code == 0
    for name in ("bellow.stl", "bellow-connector.stl", "bellow-cap.stl"):
        assert name in outcome.out
        assert is_watertight(read_stl(tmp_path / name))


def test_moulds_of_a_cast_actuator_are_written(rig: Command, tmp_path: Path) -> None:
    pytest.importorskip("manifold3d")
    actuator = "models/actuators/multi-chamber-bending.yaml"
    assert rig("export", "--actuator", actuator, "--mould", tmp_path / "block.stl").code == 0
    for name in ("block-upper-tray.stl", "block-lower-tray.stl", "block-layer-tray.stl"):
        assert is_watertight(read_stl(tmp_path / name))


def test_an_input_deck_is_written_and_described(rig: Command, tmp_path: Path) -> None:
    out = tmp_path / "bellow.inp"
    outcome = rig(
        *("export", "--actuator", ACTUATOR, "--inp", out),
        *("--program", "abaqus", "--pressure", "8 kPa"),
    )
    assert outcome.code == 0
    assert "C3D20RH for abaqus" in outcome.out
    deck = read_deck(out)
    assert deck.element_type == "C3D20RH"
    assert {float(line[2]) for line in deck.all("DLOAD")[-1].lines} == {0.008}


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ((), "--stl"),
        (("--mould", "x.stl"), "printed"),
        (("--inp", "x.inp", "--pressure", "3 mm"), "--pressure"),
        (("--inp", "x.inp", "--pressure", "-3 kPa"), "above zero"),
        (("--inp", "x.inp", "--size", "3 mm"), "--size"),
        (("--stl", "x.stl", "--tolerance", "2 kPa"), "0.01 mm"),
        (("--stl", "x.stl", "--tolerance", "0"), "out of range"),
    ],
)
def test_what_cannot_be_exported_is_explained(
    rig: Command, tmp_path: Path, arguments: tuple[str, ...], word: str
) -> None:
    outcome = rig("export", "--actuator", ACTUATOR, *arguments)
    assert outcome.code != 0
    assert word in outcome.err
    assert "Traceback" not in outcome.err
