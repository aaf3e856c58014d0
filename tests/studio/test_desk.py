"""The bench behind the page: orders, limits, the seat, a run, and a browser that is lost."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from rig.board.virtual import VirtualBench
from rig.experiment.bench import Bench, Nobody
from rig.experiment.errors import ExperimentError, LimitError
from rig.experiment.request import make_request
from rig.experiment.run import new_run
from rig.link.client import RigLink
from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import Progress
from rig.mechanics.job import Job
from rig.record.reader import RunReader
from rig.studio.desk import LOST, Choice, Desk, _Take
from rig.studio.errors import StudioError
from rig.studio.live import live_route, message
from rig.studio.seat import PATIENCE_S, Seat
from rig.studio.watched import LEFT_BEHIND_S, Pace
from tests.studio.lab import make_lab

BEAM = Choice("bellow-bending", "virtual-beam", seed=1, speed=20.0)
PATIENT_S = 60.0
"""Against a test that hangs; nothing is asserted of it."""


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def desk(tmp_path: Path, clock: Clock) -> Iterator[Desk]:
    made = Desk(make_lab(tmp_path), Seat(clock))
    yield made
    made.close()
    assert not made.is_open


def until(condition: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENT_S
    while not condition():
        assert time.monotonic() < end_s, "it never came to that"
        time.sleep(0.01)


def connected(desk: Desk, choice: Choice = BEAM) -> None:
    desk.take_control("me")
    if not desk.is_open:
        desk.connect("me", choice)
    until(lambda: desk.scope.reading().state == "idle" and not desk.activity.doing)


def pressurised(desk: Desk) -> None:
    connected(desk)
    desk.order("me", "home")
    until(lambda: "homed" in desk.scope.reading().flags)
    desk.order("me", "zero_pressure")
    until(lambda: "zeroed" in desk.scope.reading().flags)
    desk.order("me", "set_pressure", 4.0)
    until(lambda: desk.scope.since(0)[-1][2] > 3.5)


def vented(desk: Desk) -> bool:
    reading = desk.scope.reading()
    return reading.state == "idle" and "valve open" in reading.flags


def test_home_zero_and_a_set_point_and_anybody_may_vent(desk: Desk) -> None:
    pressurised(desk)
    assert desk.scope.reading().state == "run"
    desk.vent()
    until(lambda: vented(desk))


def test_a_browser_that_falls_silent_leaves_a_vented_bench_and_a_free_seat(
    desk: Desk, clock: Clock
) -> None:
    pressurised(desk)
    clock.now_s += PATIENCE_S
    time.sleep(0.05)
    assert desk.scope.reading().state == "run"
    clock.now_s += 0.1
    until(lambda: vented(desk))
    assert desk.activity.said == LOST
    assert desk.seat.holder is None
    with pytest.raises(StudioError, match="take control first"):
        desk.order("me", "home")


def test_a_browser_that_is_gone_without_a_bench_does_not_keep_the_seat(
    desk: Desk, clock: Clock
) -> None:
    desk.take_control("gone")
    clock.now_s += PATIENCE_S
    with pytest.raises(StudioError, match="another browser controls"):
        desk.take_control("next")
    clock.now_s += 0.1
    desk.take_control("next")
    assert desk.seat.holder == "next"
    assert desk.activity.said == ""


def test_disconnecting_leaves_a_vented_bench(desk: Desk) -> None:
    pressurised(desk)
    desk.disconnect("me")
    assert not desk.is_open
    assert vented(desk)


def test_orders_that_wait_are_not_done_after_a_vent(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    connected(desk)
    done: list[str] = []
    carry_out = desk._carry_out

    def noted(link: RigLink, opcode: str, argument: float = 0.0) -> None:
        done.append(opcode)
        if opcode == "hold":
            desk.order("me", "tare")
            desk.vent()
        carry_out(link, opcode, argument)

    monkeypatch.setattr(desk, "_carry_out", noted)
    desk.order("me", "hold")
    until(lambda: "vent" in done)
    seen = desk.scope.number
    until(lambda: desk.scope.since(seen) != [])
    assert done == ["hold", "vent"]


def test_a_real_bench_is_not_opened_with_the_calibrations_that_ship(desk: Desk) -> None:
    desk.seat.take("me")
    with pytest.raises(ExperimentError, match="define the virtual bench"):
        desk.connect("me", Choice("bellow-bending", "mega"))
    assert not desk.is_open


def test_giving_control_back_vents(desk: Desk) -> None:
    pressurised(desk)
    desk.release("somebody else")
    assert desk.seat.holder == "me"
    desk.release("me")
    until(lambda: vented(desk))


def test_who_watches_moves_nothing(desk: Desk) -> None:
    connected(desk)
    for asked in (
        lambda: desk.order("other", "jog", 1.0),
        lambda: desk.take("other", "tiny"),
        lambda: desk.disconnect("other"),
        lambda: desk.connect("other", BEAM),
        lambda: desk.answer("other"),
    ):
        with pytest.raises(StudioError, match="take control first"):
            asked()


def test_a_specimen_that_is_computed_tells_how_far_it_is_until_the_bench_is_let_go_of(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[bool] = []

    def computed(*_arguments: object, job: Job) -> Bench:
        assert job.watch is not None
        progress = Progress(2, 25, fraction=0.5, pressure=1500.0, converged=True, solves=3)
        while job.watch("tip free", progress):
            told.append(True)
            time.sleep(0.01)
        raise MechanicsError("stopped")

    monkeypatch.setattr("rig.studio.desk.VirtualBench", computed)
    desk.take_control("me")
    desk.connect("me", BEAM)
    until(lambda: bool(told))
    assert desk.activity.doing == (
        "opening the bench: finite elements, tip free: 1.50 kPa, 3 of 25 points"
    )
    desk.disconnect("me")
    assert not desk.is_open


def test_a_set_point_beyond_a_limit_never_reaches_the_board(desk: Desk) -> None:
    connected(desk)
    with pytest.raises(LimitError, match=r"limits\.pressure of the actuator"):
        desk.order("me", "set_pressure", 12.5)
    with pytest.raises(StudioError, match="0 kPa or more"):
        desk.order("me", "set_pressure", -1.0)
    with pytest.raises(StudioError, match="mL/s at most"):
        desk.order("me", "jog", 3.0)
    with pytest.raises(StudioError, match="0 kPa or more"):
        desk.order("me", "set_pressure", float("nan"))
    with pytest.raises(StudioError, match="mL/s at most"):
        desk.order("me", "jog", float("nan"))


def test_what_the_board_refuses_is_said_in_its_words(desk: Desk) -> None:
    connected(desk)
    desk.order("me", "set_pressure", 3.0)
    until(lambda: "not_homed" in desk.activity.said)


def test_only_names_of_the_workspace_are_opened(desk: Desk) -> None:
    desk.seat.take("me")
    for choice in (
        Choice("/etc/passwd", "virtual-beam"),
        Choice("bellow-bending", "../benches/virtual-beam"),
    ):
        with pytest.raises(StudioError, match="of this workspace"):
            desk.connect("me", choice)
    with pytest.raises(StudioError, match="seed is 0 or more"):
        desk.connect("me", replace(BEAM, seed=-1))
    connected(desk)
    with pytest.raises(StudioError, match="protocol of this workspace"):
        desk.take("me", "../protocols/tiny")
    with pytest.raises(StudioError, match="connected already"):
        desk.connect("me", BEAM)


def test_a_run_is_recorded_as_from_the_command_line_and_the_bench_comes_back(desk: Desk) -> None:
    folders: list[Path] = []
    desk.after_run = folders.append
    connected(desk, Choice("bellow-bending", "virtual-beam", seed=3, speed=0.0))
    desk.take("me", "tiny")
    until(lambda: bool(folders) and desk.activity.doing == "" and desk.activity.total == 0)
    assert "success" in desk.activity.said
    reader = RunReader(folders[0])
    assert reader.complete
    assert len(reader.points()) == 2
    until(lambda: desk.scope.reading().state == "idle")


def test_a_run_that_is_looked_at_measures_the_same(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rig.studio.desk.CAMERA_PERIOD_S", 0.5)
    folders: list[Path] = []
    desk.after_run = folders.append
    desk.watchers = 1
    connected(desk, replace(BEAM, speed=0.0))
    desk.take("me", "tiny")
    until(lambda: bool(folders))
    setup = desk.workspace.setup(BEAM.actuator, BEAM.bench, "tiny")
    bench = VirtualBench(setup, BEAM.seed, None)
    new_run(tmp_path / "alone", bench, make_request(setup, BEAM.seed), Nobody())
    bench.close()
    alone, watched = RunReader(tmp_path / "alone"), RunReader(folders[0])
    assert watched.points() == alone.points()
    assert [i.jpeg for i in watched.images()] == [i.jpeg for i in alone.images()]
    until(lambda: desk.look.time_s > 0)
    assert desk.look.time_s not in {image.time_s for image in alone.images()}


def test_angle_and_force_come_from_picture_and_load_cell(desk: Desk) -> None:
    desk.watchers = 1
    connected(desk)
    until(lambda: desk.look.value is not None)
    at_rest = desk.look.value
    assert at_rest is not None
    assert abs(at_rest) < 10.0
    assert desk.force_g is None
    desk.order("me", "tare")
    until(lambda: desk.force_g is not None)
    assert desk.force_g == pytest.approx(0.0, abs=1.0)
    pressurised(desk)
    until(lambda: desk.look.value is not None and desk.look.value > at_rest + 20.0)
    assert desk.look.u95 is not None
    assert 0.0 < desk.look.u95 < 3.0
    assert desk.look.jpeg.startswith(b"\xff\xd8")


def test_who_does_not_look_costs_nothing(desk: Desk) -> None:
    connected(desk)
    until(lambda: desk.scope.reading().time_s > 2.0)
    assert desk.look.jpeg == b""


def test_what_is_asked_for_while_a_run_begins_is_not_done_after_it(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    left: list[int] = []
    next_order, let_go = desk._next_order, desk._let_go

    def pressed_at_the_same_time() -> object:
        order = next_order()
        if isinstance(order, _Take):
            desk.order("me", "set_pressure", 4.0)
        return order

    def pressed_once_more(link: RigLink, bench: Bench) -> None:
        monkeypatch.undo()
        with pytest.raises(StudioError, match=r"busy \(closing the bench before the run\)"):
            desk.order("me", "set_pressure", 4.0)
        let_go(link, bench)

    def refuse(_folder: Path) -> None:
        left.append(desk._orders.qsize())
        raise StudioError("enough is going on.")

    desk.after_run = refuse
    connected(desk, replace(BEAM, speed=0.0))
    monkeypatch.setattr(desk, "_next_order", pressed_at_the_same_time)
    monkeypatch.setattr(desk, "_let_go", pressed_once_more)
    desk.take("me", "tiny")
    until(lambda: "Its report was not begun: enough" in desk.activity.said)
    assert "success" in desk.activity.said
    assert left == [0]


def test_vent_stops_a_run_and_its_log_says_so(desk: Desk) -> None:
    folders: list[Path] = []
    desk.after_run = folders.append
    connected(desk)
    desk.take("me", "tiny")
    until(lambda: desk.activity.total == 2)
    desk.vent()
    until(lambda: bool(folders))
    stop = RunReader(folders[0]).stop()
    assert stop is not None
    assert stop.exit_status == "aborted"
    assert "stopped in the studio" in stop.reason


# --- the live WebSocket ------------------------------------------------------------------------


def test_the_live_message_tells_who_controls_and_only_new_samples(desk: Desk) -> None:
    connected(desk)
    until(lambda: desk.scope.number > 5)
    text, number = message(desk, "me", True, 0)
    first = json.loads(text)
    assert first["control"] == "yours"
    assert first["connected"] == "virtual-beam"
    assert len(first["samples"]) >= 5
    again, _ = message(desk, "other", True, number)
    assert json.loads(again)["control"] == "another's"
    assert len(json.loads(again)["samples"]) < len(first["samples"])
    quiet, _ = message(desk, "other", False, 0)
    assert json.loads(quiet)["samples"] == []


def test_a_browser_is_told_what_it_may_ask_for(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    def may(session: str) -> set[str]:
        return set(json.loads(message(desk, session, True, 0)[0])["may"])

    opening = threading.Event()
    go_on = threading.Event()
    open_bench = desk._open

    def opened(*arguments: Any) -> Bench:
        opening.set()
        assert go_on.wait(PATIENT_S)
        return open_bench(*arguments)

    monkeypatch.setattr(desk, "_open", opened)
    assert may("me") == may("other") == {"take"}
    desk.take_control("me")
    assert may("me") == {"give", "connect"}
    assert may("other") == {"take"}
    desk.connect("me", replace(BEAM, speed=0.0))
    assert opening.wait(PATIENT_S)
    assert may("me") == {"give", "disconnect"}
    with pytest.raises(StudioError, match=r"busy \(opening the bench\)"):
        desk.take("me", "tiny")
    go_on.set()
    until(lambda: "order" in may("me"))
    desk.take("me", "tiny")  # as soon as it may be asked for it is begun
    until(lambda: desk.activity.total == 2)
    assert may("me") == {"give", "disconnect"}
    desk._say(question="turn the valve")
    assert may("me") == {"give", "disconnect", "answer"}


def test_an_answer_keeps_the_seat_and_a_session_must_have_a_name(desk: Desk, clock: Clock) -> None:
    app = FastAPI()
    app.include_router(live_route(desk))
    desk.seat.take("me")
    client = TestClient(app)
    with client.websocket_connect("/live?session=me&watch=1") as socket:
        assert desk.watchers == 1
        assert json.loads(socket.receive_text())["control"] == "yours"
        clock.now_s = 2 * PATIENCE_S
        socket.send_text("heard")
        socket.receive_text()
        until(lambda: desk.seat._heard_s == clock.now_s)
        assert not desk.seat.lapsed()
        socket.close()
        until(lambda: desk.watchers == 0)
    for session in ("", "x" * 81):
        with (
            pytest.raises(WebSocketDisconnect),
            client.websocket_connect(f"/live?session={session}") as socket,
        ):
            socket.receive_text()


def test_simulated_time_keeps_pace_and_a_late_bench_does_not_race() -> None:
    clock = Clock()

    def sleep(duration_s: float) -> None:
        clock.now_s += duration_s

    pace = Pace(2.0, clock, sleep)
    pace.keep(0.0)
    pace.keep(4.0)
    assert clock.now_s == pytest.approx(2.0)
    clock.now_s += 10.0
    pace.keep(4.1)
    assert clock.now_s == pytest.approx(12.0)
    pace.keep(5.1)
    assert clock.now_s == pytest.approx(12.5)
    assert LEFT_BEHIND_S < 10.0
    free = Pace(0.0, clock, sleep)
    free.keep(1e9)
    assert clock.now_s == pytest.approx(12.5)
