"""`rig check` and `rig init`, as people run them."""

from __future__ import annotations

import json
import stat
from pathlib import Path

import pytest

from rig.cli.main import main
from rig.spec.loading import parse_any

ROOT = Path(__file__).resolve().parents[2]
ACTUATOR = ROOT / "models/actuators/bellow-bending.yaml"


@pytest.fixture
def rig(capsys: pytest.CaptureFixture[str]):  # type: ignore[no-untyped-def]
    """Runs the command line; gives exit code, standard output and standard error."""

    def run(*arguments: object) -> tuple[int, str, str]:
        code = 0
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = int(end.code or 0)
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return code, captured.out, captured.err

    return run


@pytest.fixture
def broken(tmp_path: Path) -> Path:
    path = tmp_path / "broken.yaml"
    text = ACTUATOR.read_text(encoding="utf-8")
    path.write_text(text.replace("66 mm", "66 kPa").replace("name:", "nam:"), encoding="utf-8")
    return path


def test_check_says_ok_for_sound_files(rig) -> None:  # type: ignore[no-untyped-def]
    code, out, _ = rig("check", ACTUATOR, ROOT / "models/benches/virtual.yaml")
    assert code == 0
    assert out.splitlines() == [
        f"OK {ACTUATOR} (actuator)",
        f"OK {ROOT / 'models/benches/virtual.yaml'} (bench)",
    ]


UNSTABLE = """
hyperelastic:
  energy: mooney-rivlin
  c10: 90 kPa
  c01: -15 kPa
  source: a test's
"""


def test_check_warns_once_of_an_energy_that_is_unstable_before_the_material_breaks(
    rig,  # type: ignore[no-untyped-def]
    tmp_path: Path,
) -> None:
    text = (ROOT / "models/materials/agilus30.yaml").read_text(encoding="utf-8")
    material = tmp_path / "soft.yaml"
    material.write_text(text + UNSTABLE, encoding="utf-8")
    actuator = tmp_path / "actuator.yaml"
    drawn = ACTUATOR.read_text(encoding="utf-8")
    actuator.write_text(
        drawn.replace("material: agilus30", "material: soft.yaml"), encoding="utf-8"
    )
    code, out, _ = rig("check", actuator, material)
    assert code == 0
    first, second, warning = out.splitlines()
    assert first.startswith("OK ")
    assert second.startswith("OK ")
    line = text.count("\n") + 3
    assert warning.startswith(f"warning {material}:{line}:")
    assert "hyperelastic.energy: MooneyRivlin" in warning
    assert "checked were stretches from 0.27027 to 3.7" in warning
    code, out, _ = rig("check", "--json", material)
    (only,) = json.loads(out)["warnings"]
    assert only["field"] == "hyperelastic.energy"
    assert "unstable" in only["message"]


def test_check_does_not_warn_of_what_happens_beyond_break(rig, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    text = (ROOT / "models/materials/agilus30.yaml").read_text(encoding="utf-8")
    material = tmp_path / "soft.yaml"
    slight = UNSTABLE.replace("-15 kPa", "-0.01 kPa")
    material.write_text(text + slight, encoding="utf-8")
    code, out, _ = rig("check", material)
    assert code == 0
    assert out.splitlines() == [f"OK {material} (material)"]


def test_check_tells_every_problem_of_every_file_and_fails(rig, broken: Path) -> None:  # type: ignore[no-untyped-def]
    code, out, err = rig("check", broken, ACTUATOR, broken.parent / "none.yaml")
    assert code == 1
    name, nam, length, ok, none = out.splitlines()
    assert name.startswith(f"{broken}:3:1: name: required, but missing")
    assert nam.startswith(f"{broken}:4:1: nam: unknown key 'nam'; did you mean 'name'?")
    assert length.startswith(f"{broken}:8:21: geometry.effective_length: '66 kPa' is a pressure")
    assert ok.startswith("OK ")
    assert none == f"{broken.parent / 'none.yaml'}: no such file"
    assert err == "4 problems in 2 of 3 files\n"


def test_check_takes_directories(rig, broken: Path) -> None:  # type: ignore[no-untyped-def]
    code, out, _ = rig("check", ROOT / "models", ROOT / "calibration")
    assert (code, len(out.splitlines())) == (0, len([*ROOT.glob("models/*/*.yaml")]) + 4)
    hidden = broken.parent / "sub" / ".hidden"
    hidden.mkdir(parents=True)
    (hidden / "x.yaml").write_text("kind: nothing\n", encoding="utf-8")
    code, out, _ = rig("check", broken.parent)
    assert (code, len(out.splitlines())) == (1, 3)
    code, out, _ = rig("check", broken.parent / "sub")
    assert (code, "no YAML files in this directory" in out) == (1, True)


def test_check_follows_references(rig, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "a.yaml"
    text = ACTUATOR.read_text(encoding="utf-8")
    path.write_text(text.replace("agilus30", "agilus31"), encoding="utf-8")
    code, out, _ = rig("check", path)
    assert code == 1
    assert out.startswith(f"{path}:14:11: material: ")
    assert "'agilus31' is no material there; did you mean 'agilus30'?" in out


def test_check_json_is_for_machines(rig, broken: Path) -> None:  # type: ignore[no-untyped-def]
    code, out, err = rig("check", "--json", broken, ACTUATOR)
    report = json.loads(out)
    assert (code, err, report["ok"]) == (1, "", False)
    bad, good = report["files"]
    assert good == {"path": str(ACTUATOR), "kind": "actuator", "ok": True, "problems": []}
    assert [(p["line"], p["column"], p["field"]) for p in bad["problems"]] == [
        (3, 1, "name"),
        (4, 1, "nam"),
        (8, 21, "geometry.effective_length"),
    ]


def test_check_without_files_is_a_usage_error(rig) -> None:  # type: ignore[no-untyped-def]
    assert rig("check")[0] == 2


def test_init_makes_a_workspace_that_checks_clean(rig, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    lab = tmp_path / "new" / "lab"
    code, out, _ = rig("init", lab)
    assert code == 0
    assert f"cd {lab}" in out
    assert rig("check", lab)[0] == 0
    assert (lab / "logs").is_dir()
    settings = json.loads((lab / ".vscode/settings.json").read_text(encoding="utf-8"))
    for schema, globs in settings["yaml.schemas"].items():
        assert (lab / schema).is_file()
        assert all(list(lab.glob(glob)) for glob in globs)
    first = (
        (lab / "models/actuators/bellow-bending.yaml").read_text(encoding="utf-8").split("\n")[0]
    )
    schema = (lab / "models/actuators" / first.split("$schema=")[1]).resolve()
    assert schema == (lab / "models/schemas/actuator.json").resolve()


def test_files_of_a_new_workspace_may_be_edited(rig, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    rig("init", tmp_path / "lab")
    for path in (tmp_path / "lab").rglob("*"):
        assert path.stat().st_mode & stat.S_IWUSR


def test_names_are_looked_up_in_the_workspace_around_a_file(rig, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    lab = tmp_path / "lab"
    rig("init", lab)
    (lab / "models/materials/agilus30.yaml").unlink()
    code, out, _ = rig("check", lab / "models/actuators/bellow-bending.yaml")
    assert code == 1
    assert "'agilus30' is no material there" in out


def test_init_takes_an_empty_directory_and_no_other(rig, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    lab = tmp_path / "lab"
    lab.mkdir()
    assert rig("init", lab)[0] == 0
    before = sorted(path for path in lab.rglob("*"))
    code, _, err = rig("init", lab)
    assert code == 1
    assert "not an empty directory; nothing was written" in " ".join(err.split())
    assert sorted(path for path in lab.rglob("*")) == before
    file = tmp_path / "file"
    file.write_text("mine", encoding="utf-8")
    assert rig("init", file)[0] == 1
    assert file.read_text(encoding="utf-8") == "mine"


def test_init_says_why_it_cannot_write(rig, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "file").write_text("", encoding="utf-8")
    code, _, err = rig("init", tmp_path / "file" / "lab")
    assert code == 1
    assert "choose a directory that you may write to" in " ".join(err.split())


def test_init_can_write_the_schemas_alone(rig, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    code, out, _ = rig("init", "--schemas", tmp_path / "schemas")
    assert code == 0
    written = sorted(path.name for path in (tmp_path / "schemas").iterdir())
    assert written == sorted(path.name for path in (ROOT / "models/schemas").iterdir())
    assert len(out.splitlines()) == len(written)
    assert list(tmp_path.iterdir()) == [tmp_path / "schemas"]


def test_a_defect_met_in_one_file_leaves_the_others_checked(
    rig, broken: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:  # type: ignore[no-untyped-def]
    good = tmp_path / "good.yaml"
    good.write_text(ACTUATOR.read_text(encoding="utf-8"), encoding="utf-8")

    def parse(text: str, path: Path) -> object:
        if path == broken:
            raise ZeroDivisionError("by accident")
        return parse_any(text, path)

    monkeypatch.setattr("rig.spec.check.parse_any", parse)
    code, out, _ = rig("check", broken, good)
    assert code == 1
    assert f"{broken}: could not be checked" in out
    assert "ZeroDivisionError: by accident" in out
    assert f"OK {good} (actuator)" in out
