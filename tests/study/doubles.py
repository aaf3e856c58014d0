"""Functions for workers, which import them by name."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from rig.study.errors import StudyError
from rig.study.plan import Task


def doubled(task: float) -> float:
    return 2 * task


def refusing(task: float) -> float:
    if task == 3:
        raise StudyError("three is refused")
    return task


def breaking(task: float) -> float:
    return 1 / task


def threads_of(_task: object) -> str:
    return os.environ["OPENBLAS_NUM_THREADS"]


def dying_at_once(task: tuple[int, str]) -> int:
    """Number 2 kills its process the first time, number 4 every time; the file counts."""
    number, folder = task
    with (Path(folder) / f"tried-{number}").open("a") as file:
        file.write("x")
    first = (Path(folder) / f"tried-{number}").stat().st_size == 1
    if number == 4 or (number == 2 and first):
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def slowly(task: Task) -> dict[str, float]:
    time.sleep(0.2)
    return walls(task)


def walls(task: Task) -> dict[str, float]:
    """The square of the wall in mm, whatever is asked."""
    wall = task.actuator.geometry.wall_thickness * 1e3
    return {response.name: wall**2 for response in task.responses}


def spinning(count: int) -> int:
    """Work that needs nothing but a core."""
    total = 0
    for i in range(count):
        total += i * i % 7
    return total


def interrupted(task: int) -> int:
    """As a terminal does at Ctrl-C, which signals workers and their parent alike."""
    os.kill(os.getpid(), signal.SIGINT)
    return task
