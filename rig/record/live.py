"""Serves the channels of a log over Foxglove's WebSocket protocol, on this machine alone.

The protocol knows neither tokens nor users, so there is no way to bind another address than
loopback; `ssh -L` brings it to another machine. Clients can only read.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rig.record.errors import RecordError
from rig.record.follow import LogFollower, LoggedChannel

if TYPE_CHECKING:
    import foxglove

LOOPBACK = "127.0.0.1"
NS = 1_000_000_000
POLL_S = 0.2
GRACE_S = 3.0
"""For clients to subscribe to channels that are new. On a busy machine the server announces one
before it accepts subscriptions to it, so that a client has to ask again."""
BACKLOG = 65_536
"""Messages that may wait for a client before the oldest are dropped; a chunk comes at once."""


class LiveServer:
    """The server, running until it is closed; port 0 takes a free one.

    Raises RecordError if the library is missing or the port is taken.
    """

    def __init__(self, port: int) -> None:
        try:
            import foxglove
        except ImportError as error:
            raise RecordError(
                "The Foxglove server needs the library foxglove-sdk, which is not installed. "
                "Install it with `pip install 'rig[watch]'`."
            ) from error
        self._library = foxglove
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._listening = _Listener()
        listener: Any = self._listening  # the protocol's other events need capabilities
        try:
            self._server = foxglove.start_server(
                name="rig",
                host=LOOPBACK,
                port=port,
                context=self._context,
                server_listener=listener,
                message_backlog_size=BACKLOG,
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise RecordError(
                f"the Foxglove server cannot listen on port {port}: {error}. Another program may "
                f"use it; choose another one with --port."
            ) from error

    @property
    def url(self) -> str:
        """What to connect to."""
        return f"ws://{LOOPBACK}:{self._server.port}"

    def __enter__(self) -> LiveServer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.stop()

    def advertise(self, channel: LoggedChannel) -> bool:
        """Tell clients of a channel, once; whether it was new to them."""
        if channel.topic in self._channels:
            return False
        name, encoding, data = channel.schema
        self._channels[channel.topic] = self._library.Channel(
            channel.topic,
            schema=self._library.Schema(name=name, encoding=encoding, data=data),
            message_encoding=channel.encoding,
            context=self._context,
        )
        return True

    def send(self, channel: LoggedChannel, time_ns: int, payload: bytes) -> None:
        """Pass a message on to whoever subscribed to its channel."""
        self._channels[channel.topic].log(payload, log_time=time_ns)

    def wait_for_somebody(self, timeout_s: float) -> bool:
        """Whether somebody has subscribed to anything, after waiting for it."""
        return self._listening.wait(lambda topics: bool(topics), timeout_s)

    def wait_for_all(self, timeout_s: float) -> bool:
        """Whether somebody has subscribed to each channel, after waiting for it."""
        return self._listening.wait(lambda topics: topics >= self._channels.keys(), timeout_s)


class _Listener:
    """Notes what is subscribed to."""

    def __init__(self) -> None:
        self._topics: set[str] = set()
        self._more = threading.Condition()

    def wait(self, enough: Callable[[set[str]], bool], timeout_s: float) -> bool:
        with self._more:
            return self._more.wait_for(lambda: enough(self._topics), timeout_s)

    def on_subscribe(self, _: Any, channel: Any) -> None:
        with self._more:
            self._topics.add(channel.topic)
            self._more.notify_all()

    def on_unsubscribe(self, *_: Any) -> None:
        """A client that leaves changes nothing: the run goes on."""


def pace(follower: LogFollower) -> float:
    """Speed of a log unless told: as it comes while it grows, else like the clock."""
    return 1.0 if follower.ended() else 0.0


def relay(follower: LogFollower, server: LiveServer, speed: float) -> int:
    """Serve a log from its beginning to its end, waiting for more while it is being written.

    Bench time runs `speed` times as fast as the clock on the wall; 0 sends what is there at once.
    Begins when somebody subscribes. Returns how many messages were sent.
    """
    waiting: deque[tuple[int, int]] = deque()
    sent = 0
    began: tuple[float, int] | None = None
    somebody = False
    while not (follower.finished and somebody and not waiting):
        waiting += follower.poll()
        new = [channel for channel in follower.channels.values() if server.advertise(channel)]
        if not somebody:
            somebody = server.wait_for_somebody(POLL_S)
            if somebody:  # the first subscription is followed by those of other channels
                server.wait_for_all(GRACE_S)
            continue
        if new:  # what is sent before clients subscribe is lost to them
            server.wait_for_all(GRACE_S)
        if not waiting:
            time.sleep(POLL_S)
            continue
        for channel, time_ns, payload in follower.messages(waiting.popleft()):
            if speed:
                began = began or (time.monotonic(), time_ns)
                due = began[0] + (time_ns - began[1]) / NS / speed
                time.sleep(max(0.0, due - time.monotonic()))
            server.send(channel, time_ns, payload)
            sent += 1
    return sent
