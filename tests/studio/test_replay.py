"""A run played again: what was known at each time, and only by the sensors."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from rig.record.reader import RunReader
from rig.spec.workspace import Workspace
from rig.studio.errors import StudioError
from rig.studio.replay import MOST_REPLAYS, Replay, Replays, Series
from rig.studio.routes import routes
from rig.studio.runs import levels_of, short_names, summary_of
from rig.studio.state import Studio
from tests.studio.lab import make_lab, record_run


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """A workspace with one short run in it, as `rig characterise` takes it."""
    workspace = make_lab(tmp_path_factory.mktemp("lab"))
    record_run(workspace, workspace.logs / "run-1")
    return workspace


@pytest.fixture(scope="module")
def replay(lab: Workspace) -> Replay:
    return Replay(lab.logs / "run-1")


def test_before_anything_was_measured_nothing_is_claimed(replay: Replay) -> None:
    moment = replay.at(0.0)
    assert moment.deformation is moment.force_g is moment.frame is moment.frame_s is None
    assert moment.words == "0.0 s"


def test_each_point_is_there_while_it_is_measured(lab: Workspace, replay: Replay) -> None:
    for point in RunReader(lab.logs / "run-1").points():
        moment = replay.at(point.measured_to_s)
        assert moment.pressure_kpa == pytest.approx(point.pressure_kpa, abs=0.1)
        assert f"{point.key.target_kpa:g} kPa" in moment.doing
        if point.unit == "deg":
            assert moment.deformation == pytest.approx(point.value, abs=0.5)
            assert moment.frame_s is not None
            assert point.measured_from_s < moment.frame_s <= point.measured_to_s
        else:
            assert moment.force_g == pytest.approx(point.value, abs=1.0)


def test_an_untared_cell_says_no_force(lab: Workspace, replay: Replay) -> None:
    beat = RunReader(lab.logs / "run-1").telemetry("HEARTBEAT")
    tared_s = beat["time_s"][beat["tared"] > 0]
    assert replay.force.time_s.size > 0
    assert replay.force.time_s[0] >= tared_s[0] > 5.0


def test_steps_go_from_picture_to_picture_and_stop_at_the_ends(replay: Replay) -> None:
    times = [image.time_s for image in replay.images]
    assert len(times) == 2
    assert replay.beside(0.0, 1) == times[0]
    assert replay.beside(times[0] + 0.01, 1) == times[1]
    assert replay.beside(times[1], 1) == times[1]
    assert replay.beside(times[0], -1) == times[0]
    assert replay.end_s > times[1]


def test_a_picture_comes_as_it_was_or_with_what_was_measured(replay: Replay) -> None:
    plain, drawn = replay.picture(1, overlay=False), replay.picture(1, overlay=True)
    assert plain == replay.images[1].jpeg
    before, after = (
        cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR) for jpeg in (plain, drawn)
    )
    assert before.shape == after.shape
    assert np.abs(before.astype(int) - after).max() > 100
    for frame in (-1, 2):
        with pytest.raises(StudioError, match="2 pictures"):
            replay.picture(frame, overlay=False)


def test_pictures_are_served_and_bad_addresses_get_a_sentence(lab: Workspace) -> None:
    app = FastAPI()
    app.include_router(routes(Studio(lab)))
    client = TestClient(app)
    for query in ("", "?overlay=true"):
        answer = client.get(f"/pictures/run-1/0{query}")
        assert answer.headers["content-type"] == "image/jpeg"
        assert answer.content.startswith(b"\xff\xd8")
    (lab.logs / "empty").mkdir(exist_ok=True)
    for address in ("/pictures/run-1/7", "/pictures/empty/0", "/pictures/..%2Fmodels/0"):
        assert client.get(address).status_code == 404
    assert client.get("/pictures/run-1/x").status_code == 422


def test_a_log_is_read_once_and_again_when_it_has_changed(tmp_path: Path, lab: Workspace) -> None:
    replays = Replays()
    folder = lab.logs / "run-1"
    first = replays.of(folder)
    assert replays.of(folder) is first
    log = (folder / "run.mcap").read_bytes()
    for number in range(MOST_REPLAYS):
        (tmp_path / str(number)).mkdir()
        (tmp_path / str(number) / "run.mcap").write_bytes(log)
        replays.of(tmp_path / str(number))
    assert replays.of(folder) is not first


def test_a_log_too_large_to_be_read_whole_is_for_other_tools(
    lab: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rig.studio.replay.LARGEST_LOG", 1000)
    with pytest.raises(StudioError, match="rig watch"):
        Replays().of(lab.logs / "run-1")


def test_levels_lay_models_beside_the_measurement(lab: Workspace) -> None:
    summary = summary_of(lab.logs / "run-1")
    assert summary is not None
    measured, beam = levels_of(summary, "deformation", "one")
    assert (measured.label, beam.label) == ("one, measured", "one, beam theory")
    assert beam.is_model
    assert not measured.is_model
    assert measured.value[1] == pytest.approx(summary.experiments["deformation"].points[1].mean)
    assert np.abs(beam.value - measured.value).max() < 10.0
    only = summary.model_copy(update={"experiments": {}})
    assert levels_of(only, "blocked_force", "one") == ()


def test_names_are_told_apart_by_what_differs() -> None:
    assert short_names(["a-b-seed1", "a-b-seed2"]) == ["seed1", "seed2"]
    assert short_names(["a-b"]) == ["b"]
    assert short_names(["a", "a-2"]) == ["a", "a-2"]


def test_a_series_gives_its_last_value() -> None:
    series = Series(np.array([1.0, 2.0]), np.array([5.0, 6.0]))
    assert [series.before(t) for t in (0.9, 1.0, 1.9, 9.0)] == [None, 5.0, 5.0, 6.0]
