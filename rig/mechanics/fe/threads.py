"""How many threads one calculation may take, and two calculations side by side.

Elements and fronts are shared among threads whose number changes nothing in what comes out.
`OMP_NUM_THREADS` limits it as it does for other numerical programs: workers of a study get one.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from threadpoolctl import ThreadpoolController

LIMIT_VARIABLE = "OMP_NUM_THREADS"
_T = TypeVar("_T")

_share: ContextVar[Callable[[], int] | None] = ContextVar("share", default=None)
"""Threads of a calculation that runs beside others; None where it runs alone."""


def available_threads() -> int:
    """Threads that whoever asks may take now, at least one."""
    share = _share.get()
    if share is not None:
        return share()
    limit = os.environ.get(LIMIT_VARIABLE, "")
    cores = os.cpu_count() or 1
    return min(cores, max(1, int(limit))) if limit.isdigit() else cores


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """The BLAS libraries of NumPy and SciPy with one thread each: more inside the small matrices
    of elements and fronts would only fight with the threads around them."""
    with _blas().limit(limits=1, user_api="blas"):
        yield


@functools.cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController()


def side_by_side(works: Sequence[Callable[[], _T]], stop: Callable[[], None]) -> list[_T]:
    """What each of the works answers, in order, computed at once where there are threads for it.

    Raises what the first to fail raises, after `stop` has told the others to end; so does Ctrl-C.
    """
    threads = available_threads()
    if threads < len(works):
        return [work() for work in works]
    futures: list[Future[_T]] = []

    def share() -> int:
        return threads // (len(works) - sum(future.done() for future in futures))

    def beside(work: Callable[[], _T]) -> _T:
        _share.set(share)
        return work()

    # around all of them: each lifts its own limit when it ends, while others still go on
    with one_blas_thread(), ThreadPoolExecutor(len(works)) as pool:
        futures += [pool.submit(beside, work) for work in works]
        try:
            wait(futures, return_when=FIRST_EXCEPTION)
            return [future.result() for future in futures if future.done()]
        except BaseException:
            stop()
            raise
