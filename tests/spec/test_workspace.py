"""Workspaces: names become files, files become a set-up."""

from __future__ import annotations

import shutil
from datetime import date, timedelta
from pathlib import Path

import pytest

from rig.spec.errors import SpecError
from rig.spec.loading import AnySpec, load
from rig.spec.workspace import Setup, Workspace, library_root

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """A workspace of one's own, apart from the library."""
    root = tmp_path / "lab"
    for part in ("models", "calibration"):
        shutil.copytree(ROOT / part, root / part)
    return root


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def complaints(error: pytest.ExceptionInfo[SpecError]) -> list[str]:
    return [str(problem) for problem in error.value.problems]


def test_a_workspace_is_found_from_any_folder_in_it(lab: Path) -> None:
    deep = lab / "models" / "actuators"
    assert Workspace.find(deep) == Workspace(lab)
    assert Workspace.find(lab).logs == lab / "logs"


def test_the_shipped_library_stands_in_for_a_workspace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    workspace = Workspace.find()
    assert workspace.is_library
    assert workspace.root == library_root()
    assert workspace.logs == tmp_path / "logs"
    assert workspace.actuator("bellow-bending").geometry.bellow_number == 6


def test_names_and_paths_mean_the_same_file(lab: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(lab)
    workspace = Workspace.find()
    expected = lab / "models/materials/agilus30.yaml"
    assert workspace.path("material", "agilus30") == expected
    assert workspace.path("material", "agilus30.yaml") == expected
    assert workspace.path("material", "models/materials/agilus30.yaml") == expected
    assert workspace.path("material", expected) == expected
    monkeypatch.chdir(lab / "models")
    assert workspace.path("material", "materials/agilus30").samefile(expected)


def test_each_kind_of_file_has_its_reader(lab: Path) -> None:
    workspace = Workspace(lab)
    specs: list[AnySpec] = [
        workspace.actuator("bellow-bending"),
        workspace.material("agilus30"),
        workspace.bench("virtual"),
        workspace.protocol("quick"),
        workspace.calibration("camera-virtual"),
    ]
    assert [spec.kind for spec in specs] == [
        "actuator", "material", "bench", "protocol", "calibration",
    ]  # fmt: skip
    assert [reference.name for reference in workspace.published()] == ["yao-bellow-rmse"]


@pytest.mark.parametrize("name", ["agilus31", "", " ", "..", "\0", "a" * 5000, "agilus30\n"])
def test_an_unknown_name_lists_what_there_is(lab: Path, name: str) -> None:
    with pytest.raises(SpecError) as caught:
        Workspace(lab).material(name)
    (problem,) = complaints(caught)
    assert "is no material there" in problem
    assert "'agilus30', 'agilus30-dm40'" in problem
    assert "'tangoplus-dm70'" in problem
    assert len(problem) < 500 + len(str(lab))


def test_a_near_miss_is_guessed(lab: Path) -> None:
    with pytest.raises(SpecError, match=r"'virtal' is no bench there; did you mean 'virtual'\?"):
        Workspace(lab).bench("virtal")


def test_a_missing_path_says_so(lab: Path) -> None:
    with pytest.raises(SpecError, match=r"nowhere/x.yaml: no such protocol file; expected a path"):
        Workspace(lab).protocol("nowhere/x.yaml")


def test_a_setup_gathers_all_that_a_run_needs(lab: Path) -> None:
    setup = Workspace(lab).setup("bellow-bending", "virtual", "quick")
    assert setup.material.name == "Agilus30"
    assert setup.calibrations == Workspace(lab).resolve_bench(setup.bench)
    assert setup.calibrations.camera.width == 1280
    assert setup.calibrations.ruler.pitch == pytest.approx(0.01)
    assert set(setup.attachments()) == {
        "actuator.yaml", "material.yaml", "bench.yaml", "protocol.yaml",
        "transducer.yaml", "load_cell.yaml", "camera.yaml", "ruler.yaml",
    }  # fmt: skip
    for source in setup.sources.values():
        assert source.text == source.path.read_text(encoding="utf-8")


def test_a_setup_is_rebuilt_from_its_attachments(lab: Path) -> None:
    setup = Workspace(lab).setup("bellow-bending")
    shutil.rmtree(lab)
    again = Setup.from_attachments(setup.attachments(), Path("run.mcap"))
    assert again.attachments() == setup.attachments()
    assert (again.actuator, again.material, again.bench, again.protocol, again.calibrations) == (
        setup.actuator, setup.material, setup.bench, setup.protocol, setup.calibrations,
    )  # fmt: skip


def test_missing_and_broken_attachments_are_all_told(lab: Path) -> None:
    texts = Workspace(lab).setup("bellow-bending").attachments()
    del texts["ruler.yaml"]
    texts["bench.yaml"] = texts["bench.yaml"].replace("60 mL", "60 mm")
    with pytest.raises(SpecError) as caught:
        Setup.from_attachments(texts, Path("run.mcap"))
    bench, ruler = complaints(caught)
    assert bench.startswith("run.mcap/bench.yaml:9:11: syringe.volume: '60 mm' is a length")
    assert ruler == "run.mcap/ruler.yaml: the attachment is missing"


def test_problems_of_all_files_of_a_setup_are_told_at_once(lab: Path) -> None:
    edit(lab / "models/actuators/bellow-bending.yaml", "agilus30", "agilus3000")
    edit(lab / "models/benches/virtual.yaml", "ruler-virtual", "ruler-lost")
    edit(lab / "calibration/camera-virtual.yaml", "width: 1280", "width: -1")
    with pytest.raises(SpecError) as caught:
        Workspace(lab).setup("bellow-bending", "virtual", "slow")
    material, camera, ruler, protocol = complaints(caught)
    assert "bellow-bending.yaml:14:11: material: " in material
    assert "'agilus3000' is no material there; did you mean 'agilus30'?" in material
    assert "camera-virtual.yaml:4:8: width: '-1' is out of range" in camera
    assert "virtual.yaml:42:10: camera.ruler: " in ruler
    assert "'ruler-lost' is no calibration there" in ruler
    shipped = sorted(file.stem for file in (lab / "models/protocols").glob("*.yaml"))
    named = ", ".join(f"'{name}'" for name in shipped)
    assert f"'slow' is no protocol there; expected one of {named}" in protocol


def test_a_calibration_of_the_wrong_instrument_is_refused(lab: Path) -> None:
    edit(lab / "models/benches/virtual.yaml", "calibration: camera-virtual", "calibration: ruler-virtual")  # fmt: skip  # noqa: E501
    with pytest.raises(SpecError, match="instrument: this file is for 'ruler'; expected 'camera'"):
        Workspace(lab).setup("bellow-bending")


def test_a_material_beside_the_actuator_is_found_by_path(lab: Path, tmp_path: Path) -> None:
    shutil.copy(lab / "models/actuators/bellow-bending.yaml", tmp_path / "mine.yaml")
    shutil.copy(lab / "models/materials/tangoplus.yaml", tmp_path / "rubber.yaml")
    edit(tmp_path / "mine.yaml", "material: agilus30", "material: ./rubber.yaml")
    assert Workspace(lab).setup(tmp_path / "mine.yaml").material.name == "TangoPlus"


@pytest.mark.parametrize(("pressure", "is_refused"), [("359 kPa", False), ("361 kPa", True)])
def test_a_pressure_that_tears_the_material_is_refused(
    lab: Path, pressure: str, is_refused: bool
) -> None:
    # p ro / t with ro = 10 mm, t = 1.5 mm reaches the 2.4 MPa of Agilus30 at 360 kPa
    edit(lab / "models/actuators/bellow-bending.yaml", "12 kPa", pressure)
    if not is_refused:
        assert Workspace(lab).setup("bellow-bending").actuator.limits.pressure == 359e3
        return
    with pytest.raises(SpecError) as caught:
        Workspace(lab).setup("bellow-bending")
    (problem,) = complaints(caught)
    assert ":16:13: limits.pressure: 361 kPa would tear the wall" in problem
    assert "Agilus30 breaks from 2.4 MPa; expected well below 360 kPa" in problem


def test_specs_are_frozen(lab: Path) -> None:
    spec = load(lab / "models/materials/agilus30.yaml")
    with pytest.raises(ValueError, match="frozen"):
        spec.kind = "bench"  # type: ignore[assignment,union-attr]


SYRINGE = """
kind: calibration
instrument: syringe
steps_per_ml: 2850
steps_per_ml_u: 0.02 %
backlash: 0.011 mL
backlash_u: 0.001 mL
dead_volume: 2.1 mL
dead_volume_u: 0.06 mL
provenance: {date: 2026-01-31, valid_until: 2027-01-31, method: water, instrument: BD 60 mL}
"""


def test_a_calibrated_syringe_travels_with_the_set_up(lab: Path) -> None:
    (lab / "calibration" / "syringe-mine.yaml").write_text(SYRINGE)
    bench = lab / "models" / "benches" / "virtual-beam.yaml"
    assert Workspace(lab).setup("bellow-bending", "virtual-beam").calibrations.syringe is None
    edit(bench, "  dead_volume: 2 mL ", "  calibration: syringe-mine\n  dead_volume: 2 mL ")
    setup = Workspace(lab).setup("bellow-bending", "virtual-beam")
    assert setup.calibrations.syringe is not None
    assert setup.calibrations.syringe.steps_per_ml == 2850
    attached = setup.attachments()
    assert attached["syringe.yaml"] == SYRINGE
    assert Setup.from_attachments(attached, lab).calibrations == setup.calibrations


def test_calibrations_expire_on_the_day_after_their_last(lab: Path) -> None:
    (lab / "calibration" / "syringe-mine.yaml").write_text(SYRINGE)
    bench = lab / "models" / "benches" / "virtual-beam.yaml"
    edit(bench, "  dead_volume: 2 mL ", "  calibration: syringe-mine\n  dead_volume: 2 mL ")
    calibrations = Workspace(lab).setup("bellow-bending", "virtual-beam").calibrations
    last = date(2027, 1, 31)
    assert calibrations.expired(last) == {}
    assert calibrations.expired(last + timedelta(days=1)) == {"syringe": last}


def test_a_calibration_does_not_end_before_it_begins(lab: Path) -> None:
    path = lab / "calibration" / "syringe-mine.yaml"
    path.write_text(SYRINGE.replace("2027-01-31", "2025-01-31"))
    with pytest.raises(SpecError, match="valid_until not before date"):
        load(path)
