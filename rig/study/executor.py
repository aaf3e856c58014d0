"""Where points are computed: in this process, in local processes, on a Dask cluster, under SLURM.

One interface: `Executor.map` hands back each outcome as soon as it is there, in any order. A worker
that dies costs the point it was at, which is tried once more; nothing else is lost. Libraries of
linear algebra get a fixed number of threads per worker, so that workers do not fight for cores.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from typing import Any, Protocol

from rig.errors import RigError
from rig.study.extras import package

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
ATTEMPTS = 2
"""Of a point whose worker dies."""
_GRACE_S = 5.0


@dataclass(frozen=True)
class Outcome:
    """What became of one task."""

    index: int
    value: Any
    """What the function gave; None of a failure."""
    error: str | None
    seconds: float
    worker: str
    defect: bool = False
    """Whether an exception that nobody foresaw ended it, as for want of memory."""
    crashed: bool = False
    """Whether the worker died of it, or without a reason of its own."""

    @property
    def lasting(self) -> bool:
        """Whether the same task would end so again; after a defect or a crash it may work."""
        return not (self.defect or self.crashed)


class Executor(Protocol):
    """Computes a function, which must be importable by its name, for all tasks."""

    def map(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Outcome]:
        """Outcomes as they come; closing the iterator stops what is left."""
        ...


@dataclass(frozen=True)
class InProcess:
    """One after the other, here."""

    def map(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Outcome]:
        """Outcomes in order."""
        for index, task in enumerate(tasks):
            value, error, seconds, defect = timed(function, task)
            yield Outcome(index, value, error, seconds, "here", defect)


@dataclass(frozen=True)
class LocalProcesses:
    """Processes of their own on this machine."""

    workers: int
    threads: int = 1

    def map(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Outcome]:
        """Outcomes as they come; a task whose process dies is tried in another one."""
        waiting = deque((index, 1) for index in range(len(tasks)))
        busy: list[_Worker] = []
        idle: list[_Worker] = []
        try:
            while waiting or busy:
                while waiting and len(busy) < self.workers:
                    worker = idle.pop() if idle else _Worker.started(function, self.threads)
                    worker.give(*waiting.popleft(), tasks)
                    busy.append(worker)
                ready = wait([w.pipe for w in busy] + [w.process.sentinel for w in busy])
                for worker in list(busy):
                    if worker.pipe not in ready and worker.process.sentinel not in ready:
                        continue
                    busy.remove(worker)
                    outcome = worker.outcome()
                    if not outcome.crashed:
                        idle.append(worker)
                    elif worker.attempt < ATTEMPTS:
                        waiting.appendleft((worker.index, worker.attempt + 1))
                        continue
                    yield outcome
        finally:
            for worker in busy + idle:
                worker.stop()


@dataclass
class _Worker:
    """A process that computes one task at a time."""

    process: Any
    pipe: Connection
    index: int = -1
    attempt: int = 0
    began: float = field(default=0.0)

    @classmethod
    def started(cls, function: Callable[[Any], Any], threads: int) -> _Worker:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs, function), daemon=True)
        with _thread_variables(threads):
            process.start()
        theirs.close()
        return cls(process, ours)

    def give(self, index: int, attempt: int, tasks: Sequence[Any]) -> None:
        self.index, self.attempt, self.began = index, attempt, time.monotonic()
        try:
            self.pipe.send(tasks[index])
        except (BrokenPipeError, ConnectionResetError):
            return  # it died while it was idle: `outcome` finds the closed pipe

    def outcome(self) -> Outcome:
        name = f"process {self.process.pid}"
        try:
            value, error, seconds, defect = self.pipe.recv()
            return Outcome(self.index, value, error, seconds, name, defect)
        except (EOFError, ConnectionResetError):
            self.process.join(_GRACE_S)
            why = f"the worker died (exit status {self.process.exitcode})"
            seconds = time.monotonic() - self.began
            return Outcome(self.index, None, why, seconds, name, crashed=True)

    def stop(self) -> None:
        self.pipe.close()
        self.process.terminate()
        self.process.join(_GRACE_S)
        if self.process.is_alive():
            self.process.kill()


def _serve(pipe: Connection, function: Callable[[Any], Any]) -> None:
    """What a worker does until nobody asks any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is for the parent to answer
    try:
        while True:
            pipe.send(timed(function, pipe.recv()))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def timed(function: Callable[[Any], Any], task: Any) -> tuple[Any, str | None, float, bool]:
    """Value or error of a task, the seconds that it took, and whether the error is a defect."""
    began = time.monotonic()
    value, error, defect = None, None, False
    try:
        value = function(task)
    except RigError as problem:
        error = str(problem)
    except Exception as unforeseen:  # one point must not cost the others
        error, defect = f"defect: {type(unforeseen).__name__}: {unforeseen}", True
    return value, error, time.monotonic() - began, defect


@contextmanager
def _thread_variables(threads: int) -> Iterator[None]:
    """The environment that a process inherits at its start."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, str(threads)))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@dataclass(frozen=True)
class DaskCluster:
    """A Dask cluster that `start` makes; a worker that dies is replaced by the cluster."""

    start: Callable[[], Any]
    """Makes the cluster (dask.distributed's or dask-jobqueue's), to be closed by its `close`."""

    def map(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Outcome]:
        """Outcomes as they come; tasks of workers that died are given to others by the scheduler,
        three times at most."""
        distributed = package("dask.distributed", "cluster")
        with self.start() as cluster, distributed.Client(cluster) as client:
            futures = {
                client.submit(timed, function, task, pure=False): index
                for index, task in enumerate(tasks)
            }
            completed = distributed.as_completed(futures)
            for future in completed:
                if future.status == "lost":
                    # computed, but its worker died before it was asked for: it is computed again
                    completed.add(future)
                elif future.status == "finished":
                    value, error, seconds, defect = future.result()
                    yield Outcome(futures[future], value, error, seconds, "dask", defect)
                else:
                    problem = future.exception()
                    why = f"the worker died: {type(problem).__name__}"
                    yield Outcome(futures[future], None, why, 0.0, "dask", crashed=True)


def local_dask(workers: int, threads: int = 1) -> DaskCluster:
    """Dask's own processes on this machine; raises StudyError without the extra `cluster`."""

    def start() -> Any:
        distributed = package("dask.distributed", "cluster")
        with _thread_variables(threads):
            return distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                host="127.0.0.1",
            )

    return DaskCluster(start)


def slurm(workers: int, threads: int = 1, **options: Any) -> DaskCluster:
    """Jobs of SLURM, one worker each; `options` go to dask_jobqueue.SLURMCluster.

    Raises StudyError without the extra `cluster`, when it starts.
    """

    def start() -> Any:
        jobqueue = package("dask_jobqueue", "cluster")
        exports = [f"export {name}={threads}" for name in THREAD_VARIABLES]
        settings = {"cores": 1, "processes": 1, "memory": "2GB", **options}
        prologue = [*exports, *settings.pop("job_script_prologue", [])]
        scheduler = {"dashboard": False, **settings.pop("scheduler_options", {})}
        cluster = jobqueue.SLURMCluster(
            job_script_prologue=prologue,
            scheduler_options=scheduler,
            job_cpu=threads,
            **settings,
        )
        cluster.adapt(minimum=workers, maximum=workers)  # replaces jobs that end
        return cluster

    return DaskCluster(start)
