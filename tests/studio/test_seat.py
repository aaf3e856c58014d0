"""One session moves the bench, and loses it by falling silent."""

from __future__ import annotations

import pytest

from rig.studio.errors import StudioError
from rig.studio.seat import PATIENCE_S, Seat


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_the_second_session_watches_until_the_first_stands_up() -> None:
    seat = Seat(Clock())
    seat.take("first")
    seat.take("first")
    with pytest.raises(StudioError, match="another browser controls"):
        seat.take("second")
    with pytest.raises(StudioError, match="take control first"):
        seat.require("second")
    assert not seat.release("second")
    assert seat.release("first")
    seat.take("second")
    seat.require("second")


def test_who_is_not_heard_of_loses_the_seat_once() -> None:
    clock = Clock()
    seat = Seat(clock)
    assert not seat.lapsed()
    seat.take("first")
    clock.now_s = PATIENCE_S
    assert not seat.lapsed()
    seat.heard("first")
    seat.heard("second")
    clock.now_s = 2 * PATIENCE_S
    assert not seat.lapsed()
    seat.heard("second")
    clock.now_s = 2 * PATIENCE_S + 0.1
    assert seat.lapsed()
    assert not seat.lapsed()
    assert seat.holder is None
