"""A run over Foxglove's WebSocket, as a client of that protocol sees it.

Protocol: https://github.com/foxglove/ws-protocol; binary message data are opcode 1, subscription,
log time and payload.
"""

from __future__ import annotations

import json
import struct
import threading
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from recorded_runs import ATTACHMENTS, START, UNITS, point, write_point, write_run

from rig.experiment.recorder import LinkRecorder
from rig.link.client import Message as LinkMessage
from rig.link.slcan import RawFrame
from rig.record.channels import POINTS_TOPIC, telemetry_topic
from rig.record.errors import RecordError
from rig.record.follow import LogFollower
from rig.record.live import LiveServer, pace, relay
from rig.record.reader import RunReader
from rig.record.writer import RunWriter

pytest.importorskip("foxglove", reason="the server needs rig[watch]")
websockets = pytest.importorskip("websockets.sync.client")

Message = tuple[str, int, bytes]
UNKNOWN = "Unknown channel ID: "
"""What foxglove-sdk answers to a subscription to a channel that it does not know yet."""


class Client:
    """Subscribes to every channel that is advertised and keeps what it is sent."""

    def __init__(self, socket: Any, hesitates_s: float = 0.0) -> None:
        self._socket = socket
        self._hesitates_s = hesitates_s
        self.channels: dict[str, dict[str, str]] = {}
        self._topics: dict[int, str] = {}
        self.received: list[Message] = []

    def receive(self, messages: int) -> None:
        """Until so many messages have come; raises TimeoutError after half a minute of silence."""
        while len(self.received) < messages:
            frame = self._socket.recv(timeout=30)
            if isinstance(frame, str):
                self._answer(json.loads(frame))
            elif frame[0] == 1:
                subscription, time_ns = struct.unpack_from("<IQ", frame, 1)
                self.received.append((self._topics[subscription], time_ns, frame[13:]))

    def _answer(self, said: dict[str, object]) -> None:
        if said["op"] == "status" and str(said["message"]).startswith(UNKNOWN):
            # the server of a busy machine tells of a channel a moment before it knows it itself
            self._subscribe([int(str(said["message"]).removeprefix(UNKNOWN))])
        if said["op"] != "advertise":
            return
        for channel in said["channels"]:
            self.channels[channel["topic"]] = channel
            self._topics[channel["id"]] = channel["topic"]
        self._subscribe(channel["id"] for channel in said["channels"])

    def _subscribe(self, channels: Iterable[int]) -> None:
        time.sleep(self._hesitates_s)
        subscriptions = [{"id": channel, "channelId": channel} for channel in channels]
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))


def everything(folder: Path) -> list[Message]:
    follower = LogFollower(folder)
    chunks = follower.poll()
    return [
        (channel.topic, time_ns, payload)
        for chunk in chunks
        for channel, time_ns, payload in follower.messages(chunk)
    ]


def test_a_follower_reads_what_the_log_holds(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run")
    counts = RunReader(folder).counts()
    read = [topic for topic, _, _ in everything(folder)]
    assert {topic: read.count(topic) for topic in counts} == counts
    assert len(read) == sum(counts.values()) > 1000


def test_a_client_gets_the_channels_of_the_log_and_their_messages(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", points=2)
    follower = LogFollower(folder)
    expected = everything(folder)
    with LiveServer(0) as server:
        assert server.url.startswith("ws://127.0.0.1:")
        sending = threading.Thread(target=relay, args=(follower, server, 0.0))
        sending.start()
        with websockets.connect(
            server.url, subprotocols=["foxglove.sdk.v1"], max_size=None, close_timeout=0.2
        ) as socket:
            client = Client(socket)
            client.receive(len(expected))
        sending.join(timeout=30)
        assert not sending.is_alive()
    logged = {c.topic: c for c in follower.channels.values()}
    assert set(client.channels) == set(logged)
    for topic, channel in client.channels.items():
        assert channel["schemaName"] == logged[topic].schema[0]
        assert channel["schemaEncoding"] == logged[topic].schema[1]
        assert channel["encoding"] == logged[topic].encoding
    assert sorted(client.received) == sorted(expected)
    topic = telemetry_topic("PRESSURE")
    (first, *_) = [json.loads(m[2]) for m in client.received if m[0] == topic]
    assert set(first) == {"pressure_kpa", "setpoint_kpa"}


def test_a_run_in_progress_is_followed_to_its_end(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with RunWriter.create(folder, START, ATTACHMENTS, UNITS) as writer:
        follower = LogFollower(folder)
        assert follower.poll() == []
        seen = 0
        for number in range(3):
            write_point(writer, number)
            topics = [m[0].topic for c in follower.poll() for m in follower.messages(c)]
            assert topics.count(POINTS_TOPIC) == 1
            seen += len(topics)
            assert not follower.finished
    rest = [m for c in follower.poll() for m in follower.messages(c)]
    assert follower.finished
    assert seen + len(rest) == len(everything(folder))


@pytest.mark.parametrize("taken_up", [False, True])
def test_a_run_on_the_clock_is_seen_a_second_later(tmp_path: Path, taken_up: bool) -> None:
    start = START.model_copy(update={"created": "2026-01-31T12:00:00"})
    folder = tmp_path / "run"
    writer = RunWriter.create(folder, start, ATTACHMENTS, UNITS)
    if taken_up:
        writer.point(point(0), 4.0)
        writer.close()
        writer = RunWriter.resume(folder, units=UNITS)
    with writer:
        follower = LogFollower(folder)
        follower.poll()
        drive(writer, 3.5)
        assert last_seen_s(follower) == pytest.approx(3.0, abs=0.1)
        assert pace(follower) == 0.0
    assert pace(follower) == 1.0


def test_a_simulated_run_keeps_its_large_chunks(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with RunWriter.create(folder, START, ATTACHMENTS, UNITS) as writer:
        drive(writer, 3.5)
        assert LogFollower(folder).poll() == []


def drive(writer: RunWriter, until_s: float) -> None:
    """Frames of the link every 20 ms, and no point."""
    recorder = LinkRecorder(writer)
    for number in range(round(until_s / 0.02)):
        time_s = number * 0.02
        row: dict[str, float | int] = {"pressure_kpa": time_s, "setpoint_kpa": 0.0}
        frame = RawFrame(time_s, 0x101, bytes(8))
        recorder([frame], [LinkMessage(time_s, "PRESSURE", row)])


def last_seen_s(follower: LogFollower) -> float:
    topic = telemetry_topic("PRESSURE")
    return max(
        time_ns / 1e9
        for chunk in follower.poll()
        for channel, time_ns, _ in follower.messages(chunk)
        if channel.topic == topic
    )


def test_a_subscription_to_a_channel_that_is_not_there_yet_is_answered_so() -> None:
    with (
        LiveServer(0) as server,
        websockets.connect(server.url, subprotocols=["foxglove.sdk.v1"]) as socket,
    ):
        early = {"op": "subscribe", "subscriptions": [{"id": 10, "channelId": 10}]}
        socket.send(json.dumps(early))
        assert json.loads(socket.recv(timeout=30))["op"] == "serverInfo"
        assert json.loads(socket.recv(timeout=30))["message"] == f"{UNKNOWN}10"


@pytest.mark.parametrize("hesitates_s", [0.0, 0.1])
def test_a_client_loses_nothing_of_a_run_in_progress(tmp_path: Path, hesitates_s: float) -> None:
    folder = tmp_path / "run"
    with LiveServer(0) as server, RunWriter.create(folder, START, ATTACHMENTS, UNITS) as writer:
        writer.point(point(0), 4.0)  # the other channels come with the next
        sending = threading.Thread(target=relay, args=(LogFollower(folder), server, 0.0))
        sending.start()
        with websockets.connect(
            server.url, subprotocols=["foxglove.sdk.v1"], max_size=None, close_timeout=0.2
        ) as socket:
            client = Client(socket, hesitates_s)
            client.receive(1)
            for number in (1, 2):
                write_point(writer, number)
                client.receive(len(everything(folder)))
                assert len(client.received) == len(everything(folder))
            writer.close()
        sending.join(timeout=30)
        assert not sending.is_alive()


def test_a_log_that_resuming_replaced_is_read_again(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", points=2, stop=False)
    follower = LogFollower(folder)
    before = sum(len(list(follower.messages(c))) for c in follower.poll())
    with RunWriter.resume(folder, keep_points=1, units=UNITS) as writer:
        write_point(writer, 1)
    after = sum(len(list(follower.messages(c))) for c in follower.poll())
    assert before == after == len(everything(folder))


def test_bench_time_passes_at_the_speed_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slept: list[float] = []
    monkeypatch.setattr("rig.record.live.time.sleep", slept.append)
    monkeypatch.setattr("rig.record.live.time.monotonic", lambda: sum(slept))

    class Listening:
        advertise = send = staticmethod(lambda *_: None)
        wait_for_somebody = wait_for_all = staticmethod(lambda _: True)

    folder = write_run(tmp_path / "run", points=2)
    times = [time_ns for _, time_ns, _ in everything(folder)]
    relay(LogFollower(folder), Listening(), 4.0)  # type: ignore[arg-type]
    assert sum(slept) == pytest.approx((max(times) - times[0]) / 1e9 / 4)


@pytest.mark.parametrize("content", [None, b"", b"no log at all"])
def test_what_is_no_log_is_refused(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "run.mcap").write_bytes(content)
    with pytest.raises(RecordError, match=r"run\.mcap"):
        LogFollower(tmp_path)


def test_a_port_that_is_taken_is_told() -> None:
    with LiveServer(0) as server:
        port = int(server.url.rsplit(":", 1)[1])
        with pytest.raises(RecordError, match="--port"):
            LiveServer(port)
