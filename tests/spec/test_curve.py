"""Set-points from CSV files: what is read, what is refused and where."""

from __future__ import annotations

from pathlib import Path

import pytest

from rig.spec.check import check_file
from rig.spec.curve import read_curve
from rig.spec.errors import SpecError
from rig.spec.loading import parse, read
from rig.spec.protocol import ProtocolSpec
from rig.spec.workspace import with_curves


def written(folder: Path, text: str) -> Path:
    path = folder / "line.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_pressures_and_volumes_become_si(tmp_path: Path) -> None:
    pressures = read_curve(written(tmp_path, "time_s,pressure_kpa\n0,0\n1.5,4.2\n\n3,0\n"))
    assert pressures.times == (0.0, 1.5, 3.0)
    assert pressures.pressures == pytest.approx((0.0, 4200.0, 0.0))
    volumes = read_curve(written(tmp_path, "\ufefftime_s, volume_ml\n0,0\n2,3.5\n"))
    assert volumes.volumes == pytest.approx((0.0, 3.5e-6))


@pytest.mark.parametrize(
    ("text", "line", "why"),
    [
        ("t,p\n0,0\n", 1, "the header is 't,p'"),
        ("time_s,pressure_kpa\n0,0\n1,2\n1,3\n", 4, "times that ascend"),
        ("time_s,pressure_kpa\n1,0\n2,2\n", 2, "times that ascend from 0"),
        ("time_s,pressure_kpa\n0,0\n1,-2\n", 3, "no value below zero"),
        ("time_s,pressure_kpa\n0,0\n1,2,3\n", 3, "there are 3 columns"),
        ("time_s,pressure_kpa\n0,0\n1;2\n", 3, "there are 1 columns"),
        ("time_s,pressure_kpa\n0,0\n1,two\n", 3, "is no pair of numbers"),
        ("time_s,pressure_kpa\n0,0\n1,nan\n", 3, "is not finite"),
        ("time_s,pressure_kpa\n0,0\n", 2, "there are 1 set-points"),
        ("", 1, "the header is ''"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(
    tmp_path: Path, text: str, line: int, why: str
) -> None:
    path = written(tmp_path, text)
    with pytest.raises(SpecError) as caught:
        read_curve(path)
    (problem,) = caught.value.problems
    assert (problem.path, problem.line) == (path, line)
    assert why in problem.message


PROTOCOL = """\
kind: protocol
name: gait
trials:
  - {kind: trajectory, name: a, loop: {file: line.csv}, loops: 2}
"""


def test_a_protocol_takes_its_curves_along(tmp_path: Path) -> None:
    written(tmp_path, "time_s,pressure_kpa\n0,0\n1,2\n")
    path = tmp_path / "gait.yaml"
    path.write_text(PROTOCOL, encoding="utf-8")
    source = with_curves(read(path, ProtocolSpec))
    again = parse(source.text, tmp_path / "elsewhere.yaml", ProtocolSpec).spec
    assert again == source.spec
    assert again.trials[0].loop.pressures == (0.0, 2000.0)  # type: ignore[union-attr]


def test_curves_of_different_kinds_do_not_meet(tmp_path: Path) -> None:
    written(tmp_path, "time_s,pressure_kpa\n0,0\n1,2\n")
    (tmp_path / "other.csv").write_text("time_s,volume_ml\n0,0\n1,2\n", encoding="utf-8")
    path = tmp_path / "gait.yaml"
    text = PROTOCOL.replace("loops: 2", "suffix: {file: other.csv}")
    path.write_text(text, encoding="utf-8")
    (problem,) = check_file(path).problems
    assert "others of volumes" in problem.message


def test_rig_check_reads_the_curves_of_a_protocol(tmp_path: Path) -> None:
    path = tmp_path / "gait.yaml"
    path.write_text(PROTOCOL, encoding="utf-8")
    (problem,) = check_file(path).problems
    assert problem.path == tmp_path / "line.csv"
    assert "cannot be read" in problem.message
