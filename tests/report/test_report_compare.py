"""Runs beside each other, and the two verbs."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from html_page import Page
from synthetic_run import SHORT, Story, write_synthetic_run

from rig.cli.main import main
from rig.report.compare import NamedRun, agreements, compare, read_runs, write_comparison
from rig.report.errors import ReportError


def test_a_run_agrees_with_itself(run_folder: Path) -> None:
    runs = read_runs([run_folder, run_folder])
    assert [run.name for run in runs] == ["whole (1)", "whole (2)"]
    (agreement,) = agreements(runs, "deformation")
    assert agreement.agrees
    assert (agreement.difference, agreement.en, agreement.levels) == (0.0, 0.0, 5)


def test_repeats_of_one_experiment_agree_within_their_uncertainty(
    run_folder: Path, other_run_folder: Path
) -> None:
    runs = read_runs([run_folder, other_run_folder])
    for experiment in ("deformation", "blocked_force"):
        (agreement,) = agreements(runs, experiment)
        assert abs(agreement.en) < 1.5
        assert agreement.beyond <= 1


def test_a_different_experiment_is_found_out(run_folder: Path, tmp_path: Path) -> None:
    from unittest import mock

    import synthetic_run

    original = synthetic_run._Teller._value

    def stiffer(self: object, key: object) -> tuple[float, float]:
        value, u = original(self, key)
        return 0.9 * value, u

    with mock.patch.object(synthetic_run._Teller, "_value", stiffer):
        other = write_synthetic_run(tmp_path / "stiffer", Story(**SHORT))
    (agreement,) = agreements(read_runs([run_folder, other]), "deformation")
    assert not agreement.agrees
    assert agreement.beyond >= 3
    assert agreement.difference < 0
    assert agreement.en < -5


def test_the_comparison_is_one_offline_page_and_always_the_same(
    run_folder: Path, other_run_folder: Path, tmp_path: Path
) -> None:
    runs = read_runs([run_folder, other_run_folder])
    experiments = write_comparison(tmp_path / "one.html", runs)
    write_comparison(tmp_path / "two.html", runs)
    assert (tmp_path / "one.html").read_bytes() == (tmp_path / "two.html").read_bytes()
    page = Page((tmp_path / "one.html").read_text())
    assert [e.title for e in experiments] == ["Bending angle", "Blocked force"]
    assert len(list(page.all("svg"))) == 4
    assert not list(page.all("script"))
    for run in runs:
        assert run.name in page.text


def test_runs_of_different_experiments_stand_side_by_side(run_folder: Path, tmp_path: Path) -> None:
    story = Story(**SHORT, experiments=("blocked_force",))
    other = write_synthetic_run(tmp_path / "force", story)
    deformation, force = compare(read_runs([run_folder, other]))
    assert [row.run for row in deformation.rows] == ["whole"]
    assert deformation.differences is None
    assert [row.run for row in force.rows] == ["whole", "force"]
    assert len(force.agreements) == 1


def test_angles_and_elongations_are_not_held_against_each_other(run_folder: Path) -> None:
    bent, other = read_runs([run_folder, run_folder])
    long = other.summary.experiments["deformation"].model_copy(
        update={"unit": "mm", "quantity": "elongation"}
    )
    experiments = other.summary.experiments | {"deformation": long}
    lengthened = NamedRun("long", other.summary.model_copy(update={"experiments": experiments}))
    angle, elongation, force = compare([bent, lengthened, replace(lengthened, name="longer")])
    assert [row.run for row in angle.rows] == [bent.name]
    assert angle.agreements == ()
    assert [(a.run, a.first) for a in elongation.agreements] == [("longer", "long")]
    assert len(force.agreements) == 2
    assert (angle.title, elongation.title) == ("Bending angle", "Elongation")


def test_comparing_needs_two_runs_and_a_point(run_folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ReportError, match="at least two"):
        read_runs([run_folder])
    empty = write_synthetic_run(tmp_path / "empty", Story(**SHORT, stop_after=0, ending="failed"))
    with pytest.raises(ReportError, match="nothing to compare"):
        compare(read_runs([empty, empty]))


def rig(*arguments: object) -> None:
    """Run the command line; typer leaves by SystemExit."""
    with pytest.raises(SystemExit) as stopped:
        main([str(argument) for argument in arguments])
    assert stopped.value.code == 0


def test_rig_report_writes_the_report_again(
    run_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig("report", run_folder, "--out", tmp_path / "again", "--json")
    printed = capsys.readouterr().out
    assert printed == (tmp_path / "again" / "summary.json").read_text()
    assert (tmp_path / "again" / "report.html").is_file()
    rig("report", run_folder / "run.mcap", "--out", tmp_path / "again")
    assert "status: success" in capsys.readouterr().out


def test_rig_compare_prints_tables_and_writes_the_page(
    run_folder: Path,
    other_run_folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "page.html"
    rig("compare", run_folder, other_run_folder, "--out", out)
    printed = capsys.readouterr().out
    assert "Bending angle" in printed
    assert "other" in printed
    assert out.is_file()
    rig("compare", run_folder, other_run_folder, "--out", out, "--json")
    assert set(json.loads(capsys.readouterr().out)) == {"whole", "other"}


@pytest.mark.parametrize("verb", ["report", "compare"])
def test_verbs_refuse_what_is_no_run_in_one_paragraph(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        main([verb, str(tmp_path / "nowhere"), *([str(tmp_path)] if verb == "compare" else [])])
    assert stopped.value.code == 1
    printed = " ".join(capsys.readouterr().err.split())  # the paragraph may wrap anywhere
    assert "no readable run" in printed
    assert "Traceback" not in printed


def test_square_brackets_in_names_are_printed_as_they_are(
    run_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    strange = tmp_path / "[bold]run"
    shutil.copytree(run_folder, strange)
    page = tmp_path / "[red].html"
    with pytest.raises(SystemExit) as stopped:
        main(["compare", str(strange), str(run_folder), "--out", str(page)])
    assert not stopped.value.code
    said = capsys.readouterr().out
    assert f"comparison: {page}" in said
    assert "agrees with [bold]run;" in said


def test_the_outcome_of_a_run_in_a_folder_with_brackets_is_printed_as_it_is(
    run_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from rich.console import Console

    from rig.cli._summary import show_summary

    (run,) = read_runs([run_folder, run_folder])[:1]
    show_summary(Console(width=200), run.summary, Path("[") / "b]run")
    assert "report: [/b]run/report.html" in capsys.readouterr().out
