"""Two calculations side by side: the same answers, shared threads, one failure ends both."""

from __future__ import annotations

from functools import partial
from threading import Barrier, Event

import numpy as np
import pytest

from rig.mechanics.fe import Progress
from rig.mechanics.fe.threads import LIMIT_VARIABLE, available_threads, side_by_side
from rig.mechanics.job import Job, SharedWatch
from rig.mechanics.simulate.families import FAMILIES
from rig.mechanics.simulate.prediction import blocked_inflation, free_inflation, inflations
from rig.spec.workspace import Workspace, library_root
from tests.mechanics.test_simulate_inflation import TUBES

SETUP = Workspace(library_root(), is_library=True).setup("bellow-bending")
LONG = 60.0
"""Seconds after which something hangs."""


@pytest.fixture(autouse=True)
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.delenv(LIMIT_VARIABLE, raising=False)


def never() -> None:
    raise AssertionError("nothing failed")


def test_both_run_at_once_and_answer_in_order() -> None:
    meeting = Barrier(2)

    def work(name: str) -> str:
        meeting.wait(LONG)
        return name

    assert side_by_side([partial(work, "free"), partial(work, "blocked")], never) == [
        "free",
        "blocked",
    ]


def test_threads_are_shared_until_one_is_left() -> None:
    asked = Barrier(2)
    found = []

    def short() -> None:
        found.append(available_threads())
        asked.wait(LONG)

    def long() -> int:
        found.append(available_threads())
        asked.wait(LONG)
        while available_threads() == 1:
            pass
        return available_threads()

    assert side_by_side([short, long], never) == [None, 2]
    assert found == [1, 1]
    assert available_threads() == 2


def test_a_worker_that_has_one_thread_goes_one_after_the_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(LIMIT_VARIABLE, "1")
    order: list[str] = []
    side_by_side([partial(order.append, "free"), partial(order.append, "blocked")], never)
    assert order == ["free", "blocked"]
    assert available_threads() == 1


@pytest.mark.parametrize("failing", [0, 1])
def test_the_failure_of_one_ends_the_other(failing: int) -> None:
    begun, ended = Event(), Event()

    def fails() -> None:
        assert begun.wait(LONG)
        raise ValueError("no equilibrium")

    def goes_on() -> None:
        begun.set()
        assert ended.wait(LONG), "nobody stopped it"

    works = [goes_on, goes_on]
    works[failing] = fails
    with pytest.raises(ValueError, match="no equilibrium"):
        side_by_side(works, ended.set)


def test_a_stopped_watch_ends_every_calculation_and_asks_nobody() -> None:
    told: list[str] = []

    def listen(what: str, _: Progress) -> bool:
        told.append(what)
        return True

    progress = Progress(0, 1, 1.0, 0.0, True, 1)
    watch = SharedWatch(listen)
    assert watch("tip free", progress)
    watch.stop()
    assert not watch("tip free", progress)
    assert told == ["tip free"]


def test_curves_are_those_of_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FAMILIES, "bellow-bending", TUBES)
    actuator, material = SETUP.actuator, SETUP.material
    told: list[str] = []

    def listen(what: str, _: Progress) -> bool:
        told.append(what)
        return True

    top = actuator.limits.pressure / 4
    both = inflations(actuator, material, top, Job(watch=listen))
    assert set(told) == {"tip free", "tip blocked"}
    for found, question in zip(both, (free_inflation, blocked_inflation), strict=True):
        expected = question(actuator, material).curves(top, Job())
        assert expected.measured.keys() == found.measured.keys()
        for name, values in expected.measured.items():
            np.testing.assert_array_equal(found.measured[name], values)
