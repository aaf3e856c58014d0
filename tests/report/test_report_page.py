"""The page: offline, well formed, accessible, the same every time; and the tables beside it."""

from __future__ import annotations

import csv
import json
import re
import shutil
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from html_page import Page
from hypothesis import given
from hypothesis import strategies as st
from synthetic_run import SHORT, Story, write_synthetic_run

from rig.mechanics.errors import MechanicsError
from rig.record.errors import RecordError
from rig.record.reader import RunReader
from rig.report import build
from rig.report.build import build_report
from rig.report.charts import MAX_COLUMNS, envelope
from rig.report.errors import ReportError
from rig.report.words import decimals_for, duration, freedom, number, significant, uncertain

NAMESPACES = ("http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink")


@pytest.fixture(scope="module")
def built(run_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("built")
    build_report(folder, RunReader(run_folder))
    return folder


@pytest.fixture(scope="module")
def page(built: Path) -> Page:
    return Page((built / "report.html").read_text())


def test_the_page_needs_nothing_from_anywhere(page: Page) -> None:
    for _, attributes in page.elements:
        for name in ("src", "href", "xlink:href", "action", "data"):
            target = attributes.get(name) or "#"
            assert target.startswith(("#", "data:")), target
    assert not list(page.all("script"))
    assert not list(page.all("link"))
    urls = set(re.findall(r"https?://[^\s\"'<)]+", page.text))
    assert urls <= set(NAMESPACES)
    assert "@import" not in page.text
    assert set(re.findall(r"url\(([^)]{1})", page.text)) <= {"#"}


def test_ids_are_unique_and_references_find_them(page: Page) -> None:
    ids = Counter(a["id"] for _, a in page.elements if "id" in a)
    assert [name for name, times in ids.items() if times > 1] == []
    wanted = set(re.findall(r"url\(#([^)]+)\)", page.text))
    wanted |= {(a["xlink:href"] or "")[1:] for a in page.all("use")}
    wanted |= {a["aria-labelledby"] for a in page.all("section") if "aria-labelledby" in a}
    assert wanted <= set(ids)


def test_pictures_and_charts_are_described(page: Page) -> None:
    images = list(page.all("img"))
    assert len(images) == 5
    assert all(len(image["alt"] or "") > 20 for image in images)
    charts = list(page.all("svg"))
    assert len(charts) == 8
    for chart in charts:
        assert chart["role"] == "img"
        assert len(chart["aria-label"] or "") > 40
        assert "viewbox" in chart
        assert "width" not in chart


def test_headings_descend_one_level_at_a_time(page: Page) -> None:
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))


def test_tables_name_their_columns_and_scroll_by_themselves(page: Page) -> None:
    tags = [(tag, a.get("class")) for tag, a in page.elements]
    for index, (tag, _) in enumerate(tags):
        if tag == "table":
            assert tags[index - 1] == ("div", "scroll")
    assert all("scope" in header for header in page.all("th"))


def test_every_axis_has_a_unit(page: Page) -> None:
    labels = {word.strip() for word in page.words}
    for axis in (
        "pressure (kPa)",
        "bending angle (deg)",
        "blocked force (g)",
        "model minus experiment (deg)",
        "model minus experiment (g)",
        "bench time (min)",
        "time since the set-point (s)",
    ):
        assert axis in labels


def test_charts_take_their_colours_from_the_page(page: Page) -> None:
    assert "#0b0c0" not in page.text
    assert page.text.count("var(--series-1)") > 10
    for scheme in ("prefers-color-scheme: dark", "@media print"):
        assert scheme in page.text


def test_the_summary_comes_first_with_its_numbers(page: Page, built: Path) -> None:
    summary = json.loads((built / "summary.json").read_text())
    top = summary["experiments"]["deformation"]["points"][4]
    text = " ".join(" ".join(page.words).split())
    headline = text[: text.index("Models against experiment")]
    assert uncertain(top["mean"], top["u95"], "deg").replace("\xa0", " ") in headline
    rmse = summary["experiments"]["deformation"]["models"]["beam"]["rmse"]
    shown = uncertain(rmse["value"], rmse["u95"], "deg").replace("\xa0", " ")
    assert shown in headline
    order = ["Models against experiment", "Deformation", "Blocked force", "Pressure control"]
    order += ["What the camera saw", "How it was set up", "How to do it again"]
    headings = re.findall(r"<h2[^>]*>([^<]+)</h2>", page.text)
    assert headings == order


def test_the_papers_figures_stand_beside_ours(page: Page) -> None:
    for figure in ("9.00 deg", "7.40 deg", "1.66 g", "contradicts itself"):
        assert figure in page.text


def test_everything_that_was_set_up_is_listed(page: Page, run_folder: Path) -> None:
    reader = RunReader(run_folder)
    for name, content in reader.attachments().items():
        assert name in page.text
        assert f">{len(content)}<" in page.text
    for name, version in reader.start().versions.items():
        assert f"version of {name}" in page.text
        assert version in page.text
    assert "proportional_ml_s_kpa" in page.text


def test_no_path_of_this_machine_is_on_the_page(page: Page, run_folder: Path, built: Path) -> None:
    for folder in (run_folder, built, Path.home()):
        assert str(folder) not in page.text or str(folder) == "/"


def test_the_same_log_gives_the_same_bytes_anywhere(built: Path, run_folder: Path) -> None:
    copy = built.parent / "copy"
    copy.mkdir()
    shutil.copy(run_folder / "run.mcap", copy)
    build_report(copy)
    for name in ("report.html", "summary.json", "points.csv", "deformations.csv", "pressure.csv"):
        assert (copy / name).read_bytes() == (built / name).read_bytes(), name


def test_a_rebuilt_report_replaces_the_old_one(built: Path, run_folder: Path) -> None:
    before = (built / "report.html").read_bytes()
    build_report(built, RunReader(run_folder))
    assert (built / "report.html").read_bytes() == before
    assert not list(built.glob("*.partial"))


def test_tables_have_units_and_every_row(built: Path, run_folder: Path) -> None:
    reader = RunReader(run_folder)
    with (built / "points.csv").open() as stream:
        points = list(csv.DictReader(stream))
    assert len(points) == len(reader.points())
    assert float(points[3]["value"]) == pytest.approx(reader.points()[3].value or 0, rel=1e-5)
    assert points[3]["unit"] == "deg"
    with (built / "deformations.csv").open() as stream:
        angles = list(csv.DictReader(stream))
    assert len(angles) == len(reader.deformation_readings())
    assert {"value", "u", "unit", "target_kpa"} <= set(angles[0])
    with (built / "pressure.csv").open() as stream:
        trace = list(csv.DictReader(stream))
    telemetry = reader.telemetry("PRESSURE")
    highest = max(float(row["pressure_max_kpa"]) for row in trace)
    assert highest == pytest.approx(telemetry["pressure_kpa"].max(), abs=1e-4)
    assert len(trace) == len(np.unique(np.floor(telemetry["time_s"] / 0.5)))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"ending": "aborted", "stop_after": 6}, ["Aborted after 6 of 34 points", "Ctrl-C"]),
        ({"ending": "failed", "stop_after": 9}, ["Failed after 9 of 34 points", "fault leak"]),
        ({"ending": None, "stop_after": 4}, ["Failed after 4 of 34", "log is not complete"]),
        ({"resumed_after": 6}, ["Complete.", "Resumed.", "after 6 points"]),
        (
            {"ending": "failed", "stop_after": 0},
            ["No point was measured.", "no pressure telemetry"],
        ),
    ],
)
def test_the_page_says_how_the_run_ended(
    tmp_path: Path, changes: dict[str, object], expected: list[str]
) -> None:
    folder = write_synthetic_run(tmp_path / "run", Story(**(SHORT | changes)))
    build_report(folder)
    text = Page((folder / "report.html").read_text()).text
    for words in expected:
        assert words in text


def test_a_truncated_log_is_reported_as_far_as_it_goes(tmp_path: Path, run_folder: Path) -> None:
    content = (run_folder / "run.mcap").read_bytes()
    (tmp_path / "run.mcap").write_bytes(content[: len(content) // 2])
    summary = build_report(tmp_path)
    assert summary.status == "failed"
    assert 0 < summary.experiments["deformation"].measured < 19
    assert "the file ends inside a record" in (tmp_path / "report.html").read_text()


def test_a_model_that_cannot_predict_is_a_note_not_an_end(
    tmp_path: Path, run_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise MechanicsError("the beam model ends at 3 kPa <here>.")

    monkeypatch.setattr(build, "predict", refuse)
    summary = build_report(tmp_path / "out", RunReader(run_folder))
    assert summary.experiments["deformation"].models == {}
    (note,) = summary.notes
    assert "ends at 3 kPa" in note
    page = Page((tmp_path / "out" / "report.html").read_text())
    assert "ends at 3 kPa &lt;here&gt;" in page.text


def test_the_page_shows_whole_budgets(tmp_path: Path, run_folder: Path) -> None:
    summary = build_report(tmp_path / "out", RunReader(run_folder))
    page = (tmp_path / "out" / "report.html").read_text()
    levels = [level for e in summary.experiments.values() for level in e.points]
    # one of the value and one of the pressure at each level, closed but for the highest
    assert page.count("expanded for 95 %, k = ") == 2 * len(levels)
    assert page.count("combined standard uncertainty") == 2 * len(levels)
    for heading in ("distribution", "sensitivity", "contribution", "type"):
        assert page.count(f">{heading}") >= len(levels)
    assert page.count("<summary>Budgets at the other pressures</summary>") == 2


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="no readable run"):
        build_report(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path, run_folder: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ReportError, match="cannot be written"):
        build_report(tmp_path / "file" / "inside", RunReader(run_folder))


@given(
    st.lists(st.floats(-50, 50), min_size=1, max_size=4000),
)
def test_decimation_keeps_the_extremes(values: list[float]) -> None:
    y = np.array(values)
    middle, low, high = envelope(np.arange(y.size, dtype=float), y)
    assert middle.size <= MAX_COLUMNS
    assert low.min() == y.min()
    assert high.max() == y.max()
    assert np.all(np.diff(middle) > 0)


@pytest.mark.parametrize(
    ("value", "u95", "text"),
    [
        (9.1234, 0.283, "9.12 ± 0.28"),
        (123.4, 12.0, "123 ± 12"),
        (-0.00123, 0.000456, "−0.00123 ± 0.00046"),
        (-0.001, 0.2, "0.00 ± 0.20"),
        (5.0, 0.0, "5.00 ± 0.00"),
        (98.866, 0.996, "98.87 ± 1.00"),
    ],
)
def test_uncertainty_sets_the_digits(value: float, u95: float, text: str) -> None:
    assert uncertain(value, u95).replace("\xa0", " ") == text
    assert uncertain(value, u95, "deg").replace("\xa0", " ") == f"{text} deg"


@given(st.floats(1e-5, 1e3))
def test_two_digits_of_uncertainty_are_shown(u: float) -> None:
    shown = float(number(u, decimals_for(u)))
    assert shown == pytest.approx(u, rel=0.06)


def test_numbers_in_words() -> None:
    assert number(None, 2) == "–"
    assert number(-1.0, 1) == "−1.0"
    assert significant(0.0061234, 2) == "0.0061"
    assert significant(1234.5) == "1234"
    assert significant(0) == "0"
    assert significant(1.5e-7, 2) == "1.5e−07"
    assert [freedom(d) for d in (None, 4.99, 1.0, 3e7)] == ["∞", "4", "1", "∞"]
    assert [duration(s) for s in (50, 600, 9000)] == ["50 s", "10 min", "2.5 h"]
