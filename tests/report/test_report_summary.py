"""The numbers of the summary, recomputed here from the points in the plainest way."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_run import SHORT, Story, library_setup, write_synthetic_run

from rig.mechanics.model import predict
from rig.mechanics.response import Response
from rig.record.reader import RunReader
from rig.report.analysis import build_summary
from rig.report.build import analyse
from rig.report.levels import nearest_scatter
from rig.report.summary import RunSummary, rounded, run_summary_schema
from rig.spec.workspace import library_root


@pytest.fixture(scope="module")
def summary(run_folder: Path) -> RunSummary:
    return analyse(RunReader(run_folder)).summary


def values(folder: Path, experiment: str, kpa: float, direction: str = "up") -> np.ndarray:
    return np.array(
        [
            p.value
            for p in RunReader(folder).points()
            if (p.key.experiment, p.key.target_kpa, p.key.direction) == (experiment, kpa, direction)
        ]
    )


def test_the_summary_names_the_run(summary: RunSummary) -> None:
    assert (summary.status, summary.complete, summary.problem) == ("success", True, None)
    assert (summary.actuator, summary.bench, summary.seed) == ("bellow-bending", "virtual", 1)
    assert summary.versions["rig"] == "0.1.0"
    assert list(summary.experiments) == ["deformation", "blocked_force"]
    assert summary.resumed == ()
    assert summary.notes == ()


def test_every_planned_point_is_counted(summary: RunSummary) -> None:
    deformation = summary.experiments["deformation"]
    assert (deformation.measured, deformation.planned) == (19, 19)
    assert [(p.direction, p.pressure_kpa) for p in deformation.points] == [
        *(("up", kpa) for kpa in (0, 2.5, 5, 7.5, 10)),
        *(("down", kpa) for kpa in (0, 2.5, 5, 7.5)),
    ]
    assert [p.repeats for p in deformation.points] == [3] * 5 + [1] * 4


def test_means_and_deviations_are_those_of_the_points(
    summary: RunSummary, run_folder: Path
) -> None:
    for name, experiment in summary.experiments.items():
        for level in experiment.points:
            measured = values(run_folder, name, level.pressure_kpa, level.direction)
            assert level.mean == pytest.approx(measured.mean(), rel=1e-5, abs=1e-9)
            if level.repeats > 1:
                assert level.sd == pytest.approx(measured.std(ddof=1), rel=1e-5)
            else:
                assert level.sd is None


def test_uncertainty_holds_repeats_and_calibrations(summary: RunSummary, run_folder: Path) -> None:
    level = summary.experiments["blocked_force"].points[-1]
    measured = values(run_folder, "blocked_force", 10.0)
    repeats = measured.std(ddof=1) / np.sqrt(3)
    load_cell = np.hypot(0.001 * measured.mean(), 0.02)
    slope = (measured.mean() - values(run_folder, "blocked_force", 7.5).mean()) / 2.5
    pressure = slope * np.hypot(0.001 * 10, 0.005)
    u = np.linalg.norm([repeats, load_cell, pressure])
    dof = u**4 / (repeats**4 / 2)
    from scipy.stats import t

    assert level.u95 == pytest.approx(t.ppf(0.975, dof) * u, rel=1e-3)


def test_a_single_repeat_borrows_the_scatter_at_its_own_pressure(summary: RunSummary) -> None:
    points = summary.experiments["deformation"].points
    up = {p.pressure_kpa: p for p in points if p.direction == "up"}
    single = [p for p in points if p.repeats == 1]
    assert len(single) == 4
    for point in single:
        (line,) = (line for line in point.budget.lines if line.source == "repeats")
        assert line.u == up[point.pressure_kpa].sd
        assert line.degrees_of_freedom == 2


def test_a_single_repeat_borrows_from_its_own_direction_where_both_repeat() -> None:
    calm, wild, far = (np.array([0.0, step]) for step in (0.1, 2.0, 9.0))
    repeated = {("up", 5.0): calm, ("down", 5.0): wild, ("up", 9.0): far}
    for direction, own in (("up", calm), ("down", wild)):
        found = nearest_scatter(repeated, direction, 5.0)
        assert found is not None
        assert found.sd == pytest.approx(own.std(ddof=1))
    only_up = nearest_scatter(repeated, "down", 8.0)
    assert only_up is not None
    assert only_up.sd == pytest.approx(far.std(ddof=1))
    assert nearest_scatter({}, "up", 5.0) is None


def test_repeats_that_scatter_differently_are_told(summary: RunSummary, run_folder: Path) -> None:
    found = summary.experiments["deformation"].repeatability
    assert found is not None
    sd = {kpa: values(run_folder, "deformation", kpa).std(ddof=1) for kpa in (0, 2.5, 5, 7.5, 10)}
    assert found.largest == pytest.approx(max(sd.values()), rel=1e-5)
    assert found.largest_pressure_kpa == max(sd, key=lambda kpa: sd[kpa])
    assert found.homogeneous


def test_the_uncertainty_of_the_models_inputs_is_in_the_validation(run_folder: Path) -> None:
    reader, setup = RunReader(run_folder), library_setup()
    response = predict(setup.actuator, setup.material, "beam", np.linspace(0, 10.1e3, 200))
    loose = build_summary(reader, {"beam": response}).experiments["deformation"].models["beam"]
    (top,) = (e for e in loose.errors if e.pressure_kpa == 10)
    tolerances = setup.actuator.tolerances
    assert tolerances is not None
    bends = [
        np.degrees(
            predict(
                setup.actuator.model_copy(
                    update={
                        "geometry": setup.actuator.geometry.model_copy(
                            update={"wall_thickness": 1.5e-3 * (1 + wall)}
                        )
                    }
                ),
                setup.material.model_copy(
                    update={
                        "young_modulus": setup.material.young_modulus.model_copy(
                            update={"value": 450e3 * (1 + modulus)}
                        )
                    }
                ),
                "beam",
                [0.0, 10e3],
            ).angle[-1]
        )
        for modulus, wall in ((0, 0), (tolerances.young_modulus, 0), (0, tolerances.wall_thickness))
    ]
    change = np.hypot(bends[1] - bends[0], bends[2] - bends[0])
    assert top.u_input == pytest.approx(change, rel=0.05)
    # finite elements obey a law of scaling instead: a stiffness more is a pressure less
    scaled = build_summary(reader, {"fe": response}).experiments["deformation"].models["fe"]
    (top,) = (e for e in scaled.errors if e.pressure_kpa == 10)
    stiffer = 114.633 * tolerances.young_modulus  # the angle is proportional to the pressure here
    assert top.u_input == pytest.approx(np.hypot(stiffer, bends[2] - bends[0]), rel=0.05)
    assert top.u_validation > top.u_input


def test_rmse_is_that_of_model_minus_mean(summary: RunSummary, run_folder: Path) -> None:
    setup = library_setup()
    kpa = np.array([0, 2.5, 5, 7.5, 10])
    response = predict(setup.actuator, setup.material, "beam", kpa * 1e3)
    assert response.blocked_force is not None
    predicted = {
        "deformation": np.degrees(response.angle),
        "blocked_force": response.blocked_force / 9.80665e-3,
    }
    for name, curve in predicted.items():
        means = np.array([values(run_folder, name, p).mean() for p in kpa])
        result = summary.experiments[name].models["beam"]
        error = curve - means
        # measured pressures differ from the targets by some pascals
        assert result.rmse.value == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.01)
        assert result.bias.value == pytest.approx(error.mean(), rel=0.02)
        assert result.max_error.value == pytest.approx(np.abs(error).max(), rel=0.01)
        assert result.nrmse is not None
        assert result.nrmse.value == pytest.approx(
            100 * result.rmse.value / (means.max() - means.min()), rel=1e-4
        )
        assert result.rmse.unit == summary.experiments[name].unit
        assert 0 < result.rmse.u95 < result.rmse.value


def test_repeatability_and_hysteresis_come_from_the_points(
    summary: RunSummary, run_folder: Path
) -> None:
    deformation = summary.experiments["deformation"]
    groups = [values(run_folder, "deformation", kpa) for kpa in (0, 2.5, 5, 7.5, 10)]
    pooled = np.sqrt(np.mean([g.var(ddof=1) for g in groups]))
    assert deformation.repeatability is not None
    assert deformation.repeatability.sd == pytest.approx(pooled, rel=1e-5)
    assert deformation.hysteresis is not None
    up = [values(run_folder, "deformation", kpa)[-1] for kpa in (0, 2.5, 5, 7.5, 10)]
    down = [values(run_folder, "deformation", kpa, "down")[0] for kpa in (0, 2.5, 5, 7.5)]
    gaps = np.array(down) - np.array(up[:4])
    worst = int(np.argmax(np.abs(gaps)))
    assert deformation.hysteresis.pressure_kpa == 2.5 * worst
    assert deformation.hysteresis.difference == pytest.approx(gaps[worst], rel=1e-5)
    assert deformation.hysteresis.percent_of_span == pytest.approx(
        100 * abs(gaps[worst]) / (up[-1] - up[0]), rel=1e-5
    )
    assert summary.experiments["blocked_force"].hysteresis is None


def test_the_controller_is_judged_at_every_step(summary: RunSummary) -> None:
    controller = summary.experiments["deformation"].controller
    assert controller is not None
    assert len(controller.steps) == 19
    assert controller.unsettled == 0
    assert controller.tolerance_kpa == pytest.approx(0.05)
    assert controller.worst_settling_time_s == max(s.settling_time_s or 0 for s in controller.steps)
    assert 0.5 < (controller.worst_settling_time_s or 0) < 4
    # made up with 6 Pa of noise
    assert controller.worst_noise_kpa == pytest.approx(0.006, rel=0.3)
    assert abs(controller.worst_steady_error_kpa) < 0.01


def test_the_paper_stands_beside_with_its_contradiction(summary: RunSummary) -> None:
    (reference,) = summary.experiments["deformation"].references
    figures = {(v.model, v.value) for v in reference.values}
    assert figures == {("beam", 9.0), ("beam", 7.4), ("fe", 9.0), ("fe", 7.4)}
    assert "contradicts itself" in reference.note
    (force,) = summary.experiments["blocked_force"].references
    assert [(v.value, v.unit) for v in force.values] == [(1.66, "g")]


def test_the_budget_adds_up_to_the_whole_variance(summary: RunSummary) -> None:
    for experiment in summary.experiments.values():
        for level in experiment.points:
            for budget in (level.budget, level.pressure_budget):
                lines = budget.lines
                assert sum(line.share_percent for line in lines) == pytest.approx(100, abs=0.01)
                assert {line.kind for line in lines} == {"A", "B"}
                contributions = [line.contribution for line in lines]
                assert np.hypot.reduce(contributions) == pytest.approx(budget.u, rel=1e-4)
                assert budget.u95 == pytest.approx(budget.coverage_factor * budget.u, rel=1e-4)
            assert level.budget.u95 == level.u95


def test_the_summary_survives_json(summary: RunSummary) -> None:
    assert RunSummary.model_validate_json(summary.to_json()) == summary
    assert json.loads(summary.to_json())["schema_version"] == 1


def test_the_exported_schema_is_up_to_date() -> None:
    exported = library_root() / "models" / "schemas" / "run-summary.json"
    assert exported.read_text() == run_summary_schema(), "run `rig init --schemas models/schemas`"


def test_the_contract_of_the_command_line_is_in_the_schema() -> None:
    schema = json.loads(run_summary_schema())
    assert {"status", "actuator", "bench", "seed", "versions", "experiments"} <= set(
        schema["required"]
    )
    level = schema["$defs"]["LevelSummary"]["properties"]
    assert {"pressure_kpa", "mean", "u95", "repeats"} <= set(level)
    assert {"value", "unit", "u95"} <= set(schema["$defs"]["Quantity"]["properties"])


@pytest.mark.parametrize(
    ("ending", "status"), [("aborted", "aborted"), ("failed", "failed"), (None, "failed")]
)
def test_a_run_that_ended_early_says_how(tmp_path: Path, ending: str | None, status: str) -> None:
    story = Story(**SHORT, ending=ending, stop_after=7)
    folder = write_synthetic_run(tmp_path / "run", story)
    summary = analyse(RunReader(folder)).summary
    assert summary.status == status
    assert summary.reason
    assert summary.complete == (ending is not None)
    deformation = summary.experiments["deformation"]
    assert (deformation.measured, deformation.planned) == (7, 19)
    assert "beam" in deformation.models
    assert summary.experiments["blocked_force"].points == ()


def test_a_run_without_any_point_still_has_a_summary(tmp_path: Path) -> None:
    folder = write_synthetic_run(tmp_path / "run", Story(**SHORT, ending="failed", stop_after=0))
    summary = analyse(RunReader(folder)).summary
    assert all(not e.points and not e.models for e in summary.experiments.values())
    assert all(e.controller is None for e in summary.experiments.values())


def test_a_resumed_run_says_so(tmp_path: Path) -> None:
    folder = write_synthetic_run(tmp_path / "run", Story(**SHORT, resumed_after=5))
    summary = analyse(RunReader(folder)).summary
    assert summary.status == "success"
    assert [note.points_kept for note in summary.resumed] == [5]
    assert summary.experiments["deformation"].measured == 19


def test_one_repeat_without_descent_has_no_repeatability(tmp_path: Path) -> None:
    story = Story(repeats=1, descending_repeats=0, step_kpa=5, hold_s=2, frames=1)
    summary = analyse(RunReader(write_synthetic_run(tmp_path / "run", story))).summary
    for experiment in summary.experiments.values():
        assert experiment.repeatability is None
        assert experiment.hysteresis is None
        assert all(point.u95 > 0 and point.sd is None for point in experiment.points)


def test_without_predictions_there_are_no_models(run_folder: Path) -> None:
    summary = build_summary(RunReader(run_folder), {}, notes=["why not"])
    assert all(experiment.models == {} for experiment in summary.experiments.values())
    assert summary.notes == ("why not",)


@pytest.mark.parametrize(
    ("value", "expected"), [(-0.0, 0.0), (1 / 3, 0.333333), (123456789.0, 123457000.0)]
)
def test_numbers_keep_six_digits(value: float, expected: float) -> None:
    assert str(rounded(value)) == str(expected)


def test_a_model_that_ended_early_is_compared_where_it_answers(run_folder: Path) -> None:
    setup = library_setup()
    pressures = np.linspace(0.0, 10e3, 101)
    whole = predict(setup.actuator, setup.material, "beam", pressures)
    gone = pressures > 5e3
    cut = replace(
        whole,
        angle=np.where(gone, np.nan, whole.angle),
        blocked_force=np.full_like(pressures, np.nan),
        shortfalls=("the path stopped at 5 kPa",),
    )
    reader = RunReader(run_folder)
    experiments = build_summary(reader, {"cut": cut, "whole": whole}).experiments
    found = experiments["deformation"].models["cut"]
    assert [e.pressure_kpa for e in found.errors] == [0, 2.5, 5]
    same = experiments["deformation"].models["whole"].errors[:3]
    # a mean pressure just above the end counts as the end
    assert [e.error for e in found.errors] == pytest.approx([e.error for e in same], abs=0.01)
    assert all(np.isfinite(e.u_validation) for e in found.errors)
    assert list(experiments["blocked_force"].models) == ["whole"]


def test_noise_above_the_highest_set_point_asks_no_more_of_a_model(run_folder: Path) -> None:
    analysis = analyse(RunReader(run_folder))
    assert 10.0 < analysis.data.highest_kpa < 10.03
    assert analysis.predictions["beam"].pressure[-1] == 10e3
    errors = analysis.summary.experiments["deformation"].models["beam"].errors
    assert errors[-1].pressure_kpa == 10


def test_a_model_that_ends_between_points_of_its_curve_still_answers_at_its_end(
    run_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ends_early(*asked: Any) -> Response:
        whole = predict(*asked)
        assert whole.angle is not None
        return replace(whole, angle=np.where(whole.pressure > 2.5e3, np.nan, whole.angle))

    monkeypatch.setattr("rig.report.build.predict", ends_early)
    monkeypatch.setattr("rig.report.build.CURVE_POINTS", 4)
    found = analyse(RunReader(run_folder)).summary.experiments["deformation"].models["beam"]
    assert [e.pressure_kpa for e in found.errors] == [0, 2.5]
