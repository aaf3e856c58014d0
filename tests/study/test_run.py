"""Whole studies: resumed by content, failures told of, one table with its manifest."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import doubles

from rig.errors import RigError
from rig.spec.workspace import Workspace, library_root
from rig.study.analysis import analyse
from rig.study.errors import StudyError
from rig.study.executor import InProcess
from rig.study.plan import Plan, Task, make_plan
from rig.study.results import MANIFEST, RESULTS, Folder, write_whole
from rig.study.run import Standing, run_study

LIBRARY = Workspace(library_root(), is_library=True)
STUDY = """\
kind: study
name: small
actuator: bellow-bending
factors:
  - {name: wall, field: actuator.geometry.wall_thickness, low: 1.2 mm, high: 1.8 mm}
  - {name: count, field: actuator.geometry.bellow_number, low: 5, high: 7}
  - {name: modulus, field: material.young_modulus.value, low: 400 kPa, high: 500 kPa}
design: {kind: box-behnken, centre_points: 3}
responses:
  - {name: angle, quantity: angle, model: beam, pressure: 4 kPa, goal: maximise}
  - {name: volume, quantity: volume, model: beam, pressure: 4 kPa, at_most: 14.5}
"""


def plan_of(folder: Path, text: str = STUDY) -> Plan:
    path = folder / "study.yaml"
    path.write_text(text)
    return make_plan(path, LIBRARY)


def test_points_are_specs_with_whole_numbers_where_they_must_be(tmp_path: Path) -> None:
    plan = plan_of(tmp_path)
    assert len(plan.points) == 15
    first = plan.points[0]
    assert first.task is not None
    geometry = first.task.actuator.geometry
    assert (geometry.wall_thickness, geometry.bellow_number) == (pytest.approx(1.2e-3), 5)
    assert first.task.material.young_modulus.value == pytest.approx(450e3)
    assert {point.key for point in plan.points[12:]} == {plan.points[14].key}


def test_the_table_has_what_beam_theory_says(tmp_path: Path) -> None:
    from rig.mechanics.model import predict

    plan = plan_of(tmp_path)
    study = run_study(plan, Folder(tmp_path / "out"), InProcess())
    assert study is not None
    assert study.computed == 13  # replicates of a deterministic model once
    table = pq.read_table(tmp_path / "out" / RESULTS).to_pydict()
    assert table["wall"][:4] == pytest.approx([1.2, 1.2, 1.8, 1.8])
    assert table["modulus"][0] == pytest.approx(450)
    task = plan.points[3].task
    assert task is not None
    expected = predict(task.actuator, task.material, "beam", [4e3])
    assert expected.angle is not None
    assert table["angle"][3] == pytest.approx(np.degrees(expected.angle[0]))
    manifest = json.loads((tmp_path / "out" / MANIFEST).read_text())
    digest = hashlib.sha256((tmp_path / "out" / RESULTS).read_bytes()).hexdigest()
    assert manifest["results_sha256"] == digest
    assert manifest["factors"][0] == {
        "name": "wall", "field": "actuator.geometry.wall_thickness", "unit": "mm",
        "low": 1.2, "high": 1.8,
    }  # fmt: skip
    assert manifest["failed"] == {}


def test_a_stopped_study_goes_on_where_it_was(tmp_path: Path) -> None:
    plan, folder = plan_of(tmp_path), Folder(tmp_path / "out")
    standings: list[Standing] = []

    def until_five(standing: Standing) -> bool:
        standings.append(standing)
        return standing.done < 5

    assert run_study(plan, folder, InProcess(), until_five) is None
    assert not (folder.path / RESULTS).exists()
    study = run_study(plan, folder, InProcess(), lambda s: standings.append(s) or True)
    assert study is not None
    assert study.computed == 8
    assert standings[-1].done == standings[-1].total == 8
    assert standings[-1].left_s == 0
    again = run_study(plan, folder, InProcess())
    assert again is not None
    assert again.computed == 0
    assert [a.values for _, a in again.answers] == [a.values for _, a in study.answers]


def test_a_changed_level_computes_the_points_that_it_changes(tmp_path: Path) -> None:
    folder = Folder(tmp_path / "out")
    run_study(plan_of(tmp_path), folder, InProcess(), function=doubles.slowly)
    changed = plan_of(tmp_path, STUDY.replace("high: 500 kPa", "high: 510 kPa"))
    study = run_study(changed, folder, InProcess(), function=doubles.slowly)
    assert study is not None
    assert study.computed == 9  # middle and high moduli change: 4 + 4 edges and the centre
    broken = next((folder.path / "answers").glob("*.json"))
    broken.write_text("{")
    assert folder.known(broken.stem) is None


def test_points_beyond_a_model_fail_alone_and_are_told_of(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, STUDY.replace("4 kPa", "7 kPa").replace("low: 1.2", "low: 1.0"))
    study = run_study(plan, Folder(tmp_path / "out"), InProcess())
    assert study is not None
    assert 0 < len(study.failed) < 6
    analysis = analyse(study)
    told = " ".join(analysis.remarks)
    for point, answer in study.failed:
        assert f"point {point.name} is left out" in told
        assert answer.error is not None
        assert "beam model ends" in answer.error
    errors = pq.read_table(tmp_path / "out" / RESULTS)["error"].to_pylist()
    assert sum(error is not None for error in errors) == len(study.failed)


def test_points_that_are_no_spec_fail_alone(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, STUDY.replace("high: 1.8 mm", "high: 3.2 mm"))
    study = run_study(plan, Folder(tmp_path / "out"), InProcess())
    assert study is not None
    assert any("wall does not fit" in (a.error or "") for _, a in study.failed)


def test_the_analysis_finds_the_best_point_within_limits(tmp_path: Path) -> None:
    study = run_study(plan_of(tmp_path), Folder(tmp_path / "out"), InProcess())
    assert study is not None
    analysis = analyse(study)
    assert analysis.surfaces["angle"].r2 > 0.99
    assert analysis.best is not None
    assert analysis.best.actual[0] == pytest.approx(1.2, abs=0.05)
    assert analysis.best.limited[0] <= 14.5 * (1 + 1e-6)
    assert any("no pure error" in remark for remark in analysis.remarks)


def test_a_study_without_any_answer_is_analysed_to_that(tmp_path: Path) -> None:
    def refusing(_: Task) -> Mapping[str, float]:
        raise StudyError("not today")

    study = run_study(plan_of(tmp_path), Folder(tmp_path / "out"), InProcess(), function=refusing)
    assert study is not None
    analysis = analyse(study)
    assert analysis.surfaces == {}
    assert "angle has no surface: response 'angle': no run has a value." in analysis.remarks


def test_there_is_no_optimum_under_a_limit_that_cannot_be_judged(tmp_path: Path) -> None:
    """The volume is the same everywhere, so that it has no surface; and it breaks its limit."""

    def constant_volume(task: Task) -> Mapping[str, float]:
        wall, modulus = task.actuator.geometry.wall_thickness, task.material.young_modulus.value
        return {"angle": 1e3 * wall + (modulus / 450e3) ** 2, "volume": 15.0}

    study = run_study(
        plan_of(tmp_path), Folder(tmp_path / "out"), InProcess(), function=constant_volume
    )
    assert study is not None
    analysis = analyse(study)
    assert set(analysis.surfaces) == {"angle"}
    assert analysis.best is None
    assert any("limit on 'volume' cannot be judged" in remark for remark in analysis.remarks)


def test_a_defect_is_tried_again_the_next_time(tmp_path: Path) -> None:
    plan, folder = plan_of(tmp_path), Folder(tmp_path / "out")

    def starving(task: Task) -> Mapping[str, float]:
        if task.name == "03":
            raise MemoryError
        return doubles.walls(task)

    first = run_study(plan, folder, InProcess(), function=starving)
    assert first is not None
    assert [point.name for point, _ in first.failed] == ["03"]
    second = run_study(plan, folder, InProcess(), function=doubles.walls)
    assert second is not None
    assert (second.computed, second.failed) == (1, ())


def test_results_are_readable_as_other_files_are_and_leave_nothing_half(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.touch()
    write_whole(tmp_path / "out" / "a.json", b"{}")
    assert (tmp_path / "out" / "a.json").stat().st_mode == plain.stat().st_mode
    (tmp_path / "out" / "b.json").mkdir()
    with pytest.raises(StudyError, match=r"b\.json"):
        write_whole(tmp_path / "out" / "b.json", b"{}")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.json", "b.json"]


def test_unbalanced_sobol_points_are_remarked(tmp_path: Path) -> None:
    text = STUDY.replace("{kind: box-behnken, centre_points: 3}", "{kind: sobol, points: 12}")
    study = run_study(
        plan_of(tmp_path, text), Folder(tmp_path / "out"), InProcess(), function=doubles.walls
    )
    assert study is not None
    assert any("a power of two, as 16" in remark for remark in analyse(study).remarks)


def test_responses_of_recorded_runs_are_read_and_missed_ones_are_told_of(tmp_path: Path) -> None:
    text = STUDY.replace("model: beam", "model: run").replace(
        "quantity: volume", "quantity: blocked_force"
    )
    plan = plan_of(
        tmp_path, text.replace("actuator: bellow-bending", "actuator: bellow-bending\nruns: runs")
    )
    for point in plan.points[:-1]:
        run = tmp_path / "runs" / point.name
        run.mkdir(parents=True)
        points = [{"pressure_kpa": 4.0, "mean": 10.0}, {"pressure_kpa": 4.0, "mean": 12.0}]
        experiments = {"deformation": {"points": points}, "blocked_force": {"points": points}}
        summary = {"status": "success", "experiments": experiments}
        (run / "summary.json").write_text(json.dumps(summary))
    plan = make_plan(tmp_path / "study.yaml", LIBRARY)
    study = run_study(plan, Folder(tmp_path / "out"), InProcess())
    assert study is not None
    values = [a.values["angle"] for _, a in study.answers if a.values is not None]
    assert values == [11.0] * 14
    ((missed, answer),) = study.failed
    assert missed.name == "15"
    assert answer.error is not None
    assert "rig characterise" in answer.error


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("wall_thickness, low", "wall_thicknes, low", ("wall_thicknes", "wall_thickness")),
        ("low: 1.2 mm", "low: 1.2 kPa", ("wall", "length")),
        ("low: 5", "low: 5.5", ("whole number",)),
        ("low: 5", "low: 8", ("not below",)),
        ("kind: box-behnken", "kind: box-benken", ("box-benken",)),
        ("field: material.young_modulus.value", "field: material.name", ("material.name",)),
    ],
)
def test_studies_that_cannot_be_are_explained(
    tmp_path: Path, old: str, new: str, words: tuple[str, ...]
) -> None:
    with pytest.raises(RigError) as caught:
        plan_of(tmp_path, STUDY.replace(old, new))
    for word in (*words, "study.yaml"):
        assert word in str(caught.value)


def test_surfaces_are_judged_by_points_that_they_were_not_fitted_to(tmp_path: Path) -> None:
    """Walls squared are a parabola, walls to the fourth are not."""
    text = STUDY.replace("responses:", "check_points: 5\nresponses:")
    plan = plan_of(tmp_path, text)
    assert [p.name for p in plan.points if p.is_check] == [f"check-{i}" for i in range(1, 6)]
    assert len(plan.points) == 20

    def powers(task: Task) -> Mapping[str, float]:
        wall = 1e3 * task.actuator.geometry.wall_thickness
        return {"angle": wall**2, "volume": wall**4}

    study = run_study(plan, Folder(tmp_path / "out"), InProcess(), function=powers)
    assert study is not None
    found = analyse(study)
    assert len(found.points) == 15
    exact, missed = found.checks["angle"], found.checks["volume"]
    assert exact.points == 5
    assert exact.largest == pytest.approx(0, abs=1e-9)
    walls = np.array([1e3 * p.values["wall"] for p, _ in study.checked])
    levels = np.array([1.2, 1.5, 1.8])
    parabola = np.polynomial.Polynomial.fit(levels, levels**4, 2)
    error = parabola(walls) - walls**4
    assert missed.largest == pytest.approx(np.max(np.abs(error)), rel=1e-6)
    assert missed.rmse == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
