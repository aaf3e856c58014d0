"""`rig latitudes`: its table, its file, and whom it refuses."""

from __future__ import annotations

import csv
import sys

import numpy as np
import pytest

from rig.mechanics.errors import MechanicsError
from rig.spec.workspace import library_root

ACTUATORS = library_root() / "models/actuators"


@pytest.fixture
def short(tmp_path):
    """The library's joint bellow with two bellows."""
    text = (ACTUATORS / "bellow-joint.yaml").read_text(encoding="utf-8")
    path = tmp_path / "short.yaml"
    path.write_text(text.replace("bellow_number: 14", "bellow_number: 2"), encoding="utf-8")
    return path


def test_it_tells_every_latitude_and_writes_every_point(rig, short, tmp_path, monkeypatch) -> None:
    pytest.importorskip("pingouin", reason="pingouin is not installed")
    from rig.mechanics.simulate import latitudes

    monkeypatch.setattr(latitudes, "INFLATION", latitudes.Stroke(0.5e-3, 0.5))
    file = tmp_path / "weak.csv"
    given = ("--actuator", short, "--stroke", "inflation", "--fold", "2 mm", "--csv", file)
    found = rig("latitudes", *given)
    assert found.code == 0, found.err
    assert "agreement of bellows, ICC" in found.out
    assert "Pumped: +0.5 mm at" in found.out
    assert "outer flanks" in found.out
    rows = list(csv.DictReader(file.open(encoding="utf-8")))
    assert len(rows) == 2 * 2 * 2 * 10
    assert {row["latitude"] for row in rows} == set("ABCDEFGHIJ")
    assert all(float(row["von_mises_kpa"]) > 0 for row in rows)


def test_other_families_are_refused(rig) -> None:
    found = rig("latitudes", "--actuator", ACTUATORS / "bellow-axisymmetric.yaml")
    assert found.code == 1
    assert "family 'bellow-joint'" in found.err


@pytest.mark.parametrize(("text", "why"), [("9 mm", "below the pitch, 3 mm"), ("2 kPa", "2.1 mm")])
def test_a_fold_that_is_none_is_refused_before_anything_is_computed(rig, short, text, why) -> None:
    found = rig("latitudes", "--actuator", short, "--fold", text)
    assert found.code == 2
    assert why in found.err


def test_a_missing_library_is_told_before_anything_is_computed(rig, short, monkeypatch) -> None:
    from rig.mechanics.simulate import latitudes

    monkeypatch.setitem(sys.modules, "pingouin", None)
    monkeypatch.setattr(latitudes, "drive", lambda *_: pytest.fail("it computes"))
    found = rig("latitudes", "--actuator", short)
    assert found.code == 1
    assert "pip install pingouin" in found.err


@pytest.fixture
def made_up(monkeypatch) -> None:
    """A stroke of numbers, without finite elements."""
    from rig.mechanics.simulate import latitudes

    pytest.importorskip("pingouin", reason="pingouin is not installed")
    even, stress = np.linspace(0.0, 1.0, 4), np.random.default_rng(1).random((4, 2, 3, 10))
    run = latitudes.LatitudeRun(even, even, even, np.full(4, np.inf), stress, np.zeros(4))
    monkeypatch.setattr(latitudes, "drive", lambda *_: run)


@pytest.mark.usefixtures("made_up")
def test_the_file_is_there_even_if_the_fold_cannot_be_finished(
    rig, short, tmp_path, monkeypatch
) -> None:
    from rig.mechanics.simulate import folding

    def refused(*_: object) -> None:
        raise MechanicsError("a bellow cannot be folded by 2 mm")

    monkeypatch.setattr(folding, "fold", refused)
    file = tmp_path / "weak.csv"
    found = rig("latitudes", "--actuator", short, "--fold", "2 mm", "--csv", file)
    assert found.code == 1
    assert "cannot be folded" in found.err
    assert len(file.read_text(encoding="utf-8").splitlines()) == 1 + 2 * 2 * 2 * 3 * 10


@pytest.mark.usefixtures("made_up")
def test_a_file_that_cannot_be_written_is_named(rig, short, tmp_path) -> None:
    file = tmp_path / "nowhere" / "weak.csv"
    found = rig("latitudes", "--actuator", short, "--csv", file)
    assert found.code == 1
    assert f"cannot be written to {file}" in found.err
