"""Puts everything that comes over the link on record, in batches."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from rig.link.client import Message
from rig.link.slcan import RawFrame
from rig.record.writer import RunWriter

BATCH_FRAMES = 1000
"""Frames gathered before they go to the log; a point flushes them first."""
LIVE_S = 1.0
"""On a bench that runs with the clock the log is never further behind: `rig watch` follows it."""


class LinkRecorder:
    """A tap on the link; `flush` before a point, so that the log holds what the point used."""

    def __init__(self, record: RunWriter) -> None:
        self._record = record
        self._frames: list[RawFrame] = []
        self._messages: list[Message] = []

    def __call__(self, frames: Sequence[RawFrame], messages: Sequence[Message]) -> None:
        """Take a batch."""
        self._frames += frames
        self._messages += messages
        if len(self._frames) >= BATCH_FRAMES or self._is_awaited():
            self.flush()

    def _is_awaited(self) -> bool:
        """Whether somebody may be watching who has seen nothing for a while."""
        return (
            self._record.is_live
            and bool(self._frames)
            and self._frames[-1].time_s - self._frames[0].time_s >= LIVE_S
        )

    def flush(self) -> None:
        """Write what was gathered; what cannot be written is lost."""
        try:
            self._write()
            if self._record.is_live:
                self._record.hand_on()
        finally:
            self._frames.clear()
            self._messages.clear()

    def _write(self) -> None:
        if not self._frames:
            return
        times, ids, payloads = zip(*self._frames, strict=True)
        self._record.can_frames(times, ids, payloads)
        by_name: dict[str, list[Message]] = defaultdict(list)
        for message in self._messages:
            by_name[message.name].append(message)
        for name, messages in by_name.items():
            self._record.telemetry(name, [m.time_s for m in messages], [m.values for m in messages])
