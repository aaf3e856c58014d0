"""Executors: the same outcomes wherever they come from, and a dead worker that costs one point."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import doubles

from rig.study.errors import StudyError
from rig.study.executor import DaskCluster, Executor, InProcess, LocalProcesses, local_dask
from rig.study.extras import package


@pytest.fixture(autouse=True)
def _workers_find_the_doubles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=":")


@pytest.mark.parametrize("executor", [InProcess(), LocalProcesses(2)], ids=["here", "local"])
def test_every_task_has_its_outcome(executor: Executor) -> None:
    outcomes = sorted(executor.map(doubles.doubled, [1.0, 2.0, 3.0]), key=lambda o: o.index)
    assert [o.value for o in outcomes] == [2.0, 4.0, 6.0]
    assert all(o.error is None for o in outcomes)


@pytest.mark.parametrize("executor", [InProcess(), LocalProcesses(2)], ids=["here", "local"])
def test_errors_and_defects_cost_their_own_point(executor: Executor) -> None:
    outcomes = sorted(executor.map(doubles.refusing, [1, 3, 5]), key=lambda o: o.index)
    assert [o.value for o in outcomes] == [1, None, 5]
    assert outcomes[1].error == "three is refused"
    (broken,) = executor.map(doubles.breaking, [0])
    assert broken.error is not None
    assert broken.error.startswith("defect: ZeroDivisionError")
    assert not broken.lasting
    assert outcomes[1].lasting


def test_a_worker_that_dies_costs_one_point(tmp_path: Path) -> None:
    tasks = [(number, str(tmp_path)) for number in range(6)]
    outcomes = sorted(LocalProcesses(2).map(doubles.dying_at_once, tasks), key=lambda o: o.index)
    assert [o.value for o in outcomes] == [0, 1, 2, 3, None, 5]
    assert outcomes[4].crashed
    assert not outcomes[4].lasting
    assert outcomes[4].error is not None
    assert "-9" in outcomes[4].error
    tried = {n: (tmp_path / f"tried-{n}").stat().st_size for n in range(6)}
    assert tried == {0: 1, 1: 1, 2: 2, 3: 1, 4: 2, 5: 1}


def test_an_interrupt_of_the_terminal_is_left_to_the_parent() -> None:
    (outcome,) = LocalProcesses(1).map(doubles.interrupted, [7])
    assert (outcome.value, outcome.error) == (7, None)


def test_workers_have_the_threads_that_were_asked_for() -> None:
    assert {o.value for o in LocalProcesses(2, threads=3).map(doubles.threads_of, [0, 1])} == {"3"}


def test_dask_gives_the_same(tmp_path: Path) -> None:
    pytest.importorskip("dask.distributed", reason="the extra 'cluster' is not installed")
    tasks = [(number, str(tmp_path)) for number in range(4)]
    outcomes = sorted(local_dask(2).map(doubles.dying_at_once, tasks), key=lambda o: o.index)
    assert [o.value for o in outcomes] == [0, 1, 2, 3]


def test_what_dask_computed_and_lost_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its worker died between the end of the task and the question for the result."""

    class Future:
        def __init__(self, task: int) -> None:
            self.task, self.statuses = task, ["lost", "finished"] if task else ["finished"]

        @property
        def status(self) -> str:
            return self.statuses[0]

        def result(self) -> tuple[int, None, float, bool]:
            return self.task, None, 0.0, False

        def exception(self) -> None:
            return None

    class Completed:
        def __init__(self, futures: Iterable[Future]) -> None:
            self.futures = list(futures)

        def add(self, future: Future) -> None:
            future.statuses.pop(0)
            self.futures.append(future)

        def __iter__(self) -> Iterator[Future]:
            while self.futures:
                yield self.futures.pop(0)

    client = SimpleNamespace(submit=lambda _function, _work, task, **_: Future(task))
    library = SimpleNamespace(Client=lambda _: nullcontext(client), as_completed=Completed)
    monkeypatch.setattr("rig.study.executor.package", lambda *_: library)
    outcomes = DaskCluster(nullcontext).map(doubles.threads_of, [0, 1, 2])
    assert sorted((o.index, o.value, o.crashed) for o in outcomes) == [
        (number, number, False) for number in range(3)
    ]


def test_a_missing_extra_is_named() -> None:
    with pytest.raises(StudyError, match=r"rig\[cluster\]"):
        package("no_such_package", "cluster")


@pytest.mark.slow
def test_work_is_spread_over_two_processes() -> None:
    """Prints the ratio; asserts only that work is spread, as other load is not ours to know."""
    tasks = [6_000_000] * 16
    began = time.perf_counter()
    list(LocalProcesses(1).map(doubles.spinning, tasks))
    one = time.perf_counter() - began
    began = time.perf_counter()
    names = {o.worker for o in LocalProcesses(2).map(doubles.spinning, tasks)}
    print(f"speed-up on two processes: {one / (time.perf_counter() - began):.2f}")
    assert len(names) == 2
