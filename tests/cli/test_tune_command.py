"""`rig tune` as people call it."""

from __future__ import annotations

import json
from pathlib import Path

from tests.cli.conftest import Command
from tests.control.families import family_of, realistic


def test_an_identification_becomes_gains_that_the_board_takes(rig: Command, tmp_path: Path) -> None:
    family = family_of(realistic(5.0))
    (tmp_path / "identification.json").write_text(family.model_dump_json())
    done = rig("tune", tmp_path, "--bandwidth", "3", "--write", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found == json.loads((tmp_path / "tuning.json").read_text())
    assert found["single"]["gain_margin_db"] > 8
    assert found["single"]["bandwidth_hz"] > 2.9
    assert "the board took the gains" in done.err
    gains = (tmp_path / "gains.yaml").read_text(encoding="utf-8")
    assert gains.startswith("# tuned for test on bench virtual-beam")
    page = (tmp_path / "tuning.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 4
    for axis in ("frequency (rad/s)", "phase (deg)", "gain (dB)", "imaginary part", "time (s)"):
        assert axis in page
    loaded = rig("firmware", "parameters", "load", tmp_path / "gains.yaml", "--bench", "virtual")
    assert loaded.code == 0, loaded.err


def test_what_cannot_be_is_told_in_a_sentence(rig: Command, tmp_path: Path) -> None:
    nothing = rig("tune", tmp_path / "nothing")
    assert nothing.code == 1
    assert "no identification can be read" in nothing.err
    (tmp_path / "identification.json").write_text(family_of(realistic(5.0)).model_dump_json())
    fast = rig("tune", tmp_path, "--bandwidth", "40")
    assert fast.code == 1
    assert "is possible" in fast.err
    for option in ("--bandwidth", "--gain-margin", "--phase-margin"):
        for value in ("0", "-1", "nan", "inf"):
            senseless = rig("tune", tmp_path, option, value)
            assert senseless.code == 1
            assert "was asked for; expected more than 0" in senseless.err
    occupied = rig("tune", tmp_path, "--out", tmp_path / "identification.json")
    assert occupied.code == 1
    assert "the gains cannot be written there: File exists" in occupied.err
