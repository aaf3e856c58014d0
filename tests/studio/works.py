"""Work for the process of a calculation: a module of its own, as a new process imports it."""

from __future__ import annotations

import os
import time

from rig.mechanics.errors import MechanicsError
from rig.studio.calculation import Tell


def square(tell: Tell, value: int) -> int:
    tell("half way")
    return value * value


def fail(tell: Tell) -> None:
    raise MechanicsError("the wall is too thin.")


def break_down(tell: Tell) -> None:
    raise ZeroDivisionError("a defect")


def vanish(tell: Tell) -> None:
    os._exit(3)


def until_told(tell: Tell) -> str:
    while tell("going on"):
        time.sleep(0.01)
    return "kept"
