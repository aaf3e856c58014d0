"""A bench that others look at while somebody uses it: every frame and picture is seen on the way.

The simulated bench is as fast as the machine; here it is held back to a pace that people follow.
The link itself does no more than before: frames are kept as they come, and decoded by who looks.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from rig.experiment.bench import Bench, Camera, Fixture
from rig.link.bus import FrameBus
from rig.link.slcan import RawFrame

Seen = Callable[[list[RawFrame], float], None]
"""Told the frames of a poll and the bench time after it."""
Shown = Callable[[float, bytes], None]
"""Told the bench time and the JPEG of a picture."""

LEFT_BEHIND_S = 0.5
"""A bench further behind its pace than this gives up catching up."""


class Pace:
    """Holds simulated time to `speed` times the clock's; a speed of 0 holds nothing."""

    def __init__(
        self,
        speed: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._speed = speed
        self._clock = clock
        self._sleep = sleep
        self._offset_s: float | None = None

    def keep(self, bench_s: float) -> None:
        """Wait until the clock has come to a bench time."""
        if self._speed <= 0:
            return
        due_s = bench_s / self._speed
        now_s = self._clock()
        if self._offset_s is None or now_s - (self._offset_s + due_s) > LEFT_BEHIND_S:
            self._offset_s = now_s - due_s
        wait_s = self._offset_s + due_s - now_s
        if wait_s > 0:
            self._sleep(wait_s)


@dataclass(frozen=True)
class WatchedBus:
    """A bus, with somebody looking over the shoulder."""

    bus: FrameBus
    seen: Seen
    pace: Pace
    glance: Callable[[], None]

    @property
    def name(self) -> str:
        """What to call it in messages."""
        return self.bus.name

    @property
    def now_s(self) -> float:
        """Bench time in seconds."""
        return self.bus.now_s

    def send(self, frame_id: int, payload: bytes) -> None:
        """Send a standard data frame."""
        self.bus.send(frame_id, payload)

    def poll(self, duration_s: float) -> list[RawFrame]:
        """Let bench time pass; return the frames received, oldest first."""
        frames = self.bus.poll(duration_s)
        self.seen(frames, self.bus.now_s)
        self.glance()
        self.pace.keep(self.bus.now_s)
        return frames

    def reopen(self) -> None:
        """Open the channel again."""
        self.bus.reopen()

    def close(self) -> None:
        """Release the bus."""
        self.bus.close()


@dataclass(frozen=True)
class WatchedCamera:
    """A camera whose pictures are shown as well."""

    taken: Camera
    shown: Shown

    def grab(self) -> tuple[float, bytes]:
        """Bench time in seconds and the JPEG of a frame taken now."""
        time_s, jpeg = self.taken.grab()
        self.shown(time_s, jpeg)
        return time_s, jpeg


class Glances:
    """When it is time for another picture to look at: on the clock's time, while somebody looks."""

    def __init__(
        self,
        period_s: float,
        somebody_looks: Callable[[], bool],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._period_s = period_s
        self._somebody_looks = somebody_looks
        self._clock = clock
        self._next_s = clock()

    def due(self) -> bool:
        """True once for each picture."""
        now_s = self._clock()
        if now_s < self._next_s or not self._somebody_looks():
            return False
        self._next_s = now_s + self._period_s
        return True


class WatchedBench:
    """A bench, open, whose frames and pictures are seen.

    The simulated camera is also looked through between the pictures that are asked for, which
    changes none of them. A real one is not: the link would wait for its exposure.
    """

    def __init__(
        self, bench: Bench, seen: Seen, shown: Shown, pace: Pace, glances: Glances | None
    ) -> None:
        self._bench = bench
        self._shown = shown
        self._glances = glances
        self.bus: FrameBus = WatchedBus(bench.bus, seen, pace, self._glance)
        self.camera: Camera = WatchedCamera(bench.camera, shown)

    def _glance(self) -> None:
        if self._glances is not None and self._glances.due():
            self._shown(*self._bench.camera.grab())

    def mount(self, fixture: Fixture) -> None:
        """Arrange the bench as `fixture` says."""
        self._bench.mount(fixture)

    def close(self) -> None:
        """Release everything."""
        self._bench.close()
