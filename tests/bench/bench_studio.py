"""The live view while a run is taken: messages a browser gets, and what the link notices of it.

The bench runs at the clock's pace. Watchers are clients in a process of their own that answer as
browsers do. Targets: 20 messages a second, and polls of the link no rarer with
watchers than without.
"""

from __future__ import annotations

import json
import multiprocessing
import socket
import statistics
import tempfile
import threading
import time
from contextlib import ExitStack
from itertools import pairwise
from multiprocessing.connection import Connection
from pathlib import Path

import uvicorn
from fastapi import FastAPI
from websockets.sync.client import connect

from rig.link.slcan import RawFrame
from rig.studio.desk import Choice, Desk
from rig.studio.live import live_route
from rig.studio.seat import Seat
from tests.studio.lab import make_lab

WATCHED_S = 12.0


def main() -> None:
    """Print the table."""
    print("watchers  messages/s  99 % gap     pictures/s  polls/s  longest poll gap  behind  CPU")
    for watchers in (0, 1, 4):
        print(_measured(watchers))


def _measured(watchers: int) -> str:
    with tempfile.TemporaryDirectory() as place:
        desk = Desk(make_lab(Path(place)), Seat(time.monotonic, patience_s=1e9))
        polls: list[tuple[float, float]] = []
        seen = desk.scope.seen

        def noted(frames: list[RawFrame], now_s: float) -> None:
            polls.append((time.monotonic(), now_s))
            seen(frames, now_s)

        desk.scope.seen = noted  # type: ignore[method-assign]
        app = FastAPI()
        app.include_router(live_route(desk))
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        server = uvicorn.Server(uvicorn.Config(app, port=port, log_level="error"))
        serving = threading.Thread(target=server.run)
        serving.start()
        desk.take_control("0")
        desk.connect("0", Choice("bellow-bending", "virtual-beam", speed=1.0))
        while desk.activity.doing or desk.scope.reading().state != "idle":
            time.sleep(0.05)
        desk.take("0", "quick")
        while not desk.activity.total:
            time.sleep(0.05)
        heard = _watch(port, watchers)
        polls.clear()
        began_s, began_cpu = time.monotonic(), time.process_time()
        time.sleep(WATCHED_S)
        cpu = (time.process_time() - began_cpu) / (time.monotonic() - began_s)
        noticed = list(polls)
        told = heard.recv() if watchers else None
        assert desk.activity.total, "the run ended while it was watched"
        desk.close()
        server.should_exit = True
        serving.join()
    return _row(watchers, noticed, told, cpu)


def _row(
    watchers: int,
    polls: list[tuple[float, float]],
    told: tuple[float, float, float] | None,
    cpu: float,
) -> str:
    walls = [wall for wall, _ in polls]
    gap_ms = 1e3 * max(b - a for a, b in pairwise(walls))
    lasted_s = walls[-1] - walls[0]
    behind_ms = 1e3 * (lasted_s - (polls[-1][1] - polls[0][1]))
    rate = len(walls) / lasted_s
    shown = (
        "         -            -           -"
        if told is None
        else (f"{told[0]:10.1f}  {told[1]:8.0f} ms  {told[2]:10.1f}")
    )
    return f"{watchers:8d}  {shown}  {rate:7.0f}  {gap_ms:13.0f} ms  {behind_ms:3.0f} ms  {cpu:.0%}"


def _watch(port: int, watchers: int) -> Connection:
    heard, said = multiprocessing.Pipe(duplex=False)
    if watchers:
        context = multiprocessing.get_context("spawn")
        context.Process(target=_browsers, args=(said, port, watchers), daemon=True).start()
        heard.poll(60)
        heard.recv()
    return heard


def _browsers(said: Connection, port: int, watchers: int) -> None:
    """Tell the slowest one's messages a second, longest gap in ms and pictures a second."""
    results: list[tuple[float, float, float]] = []
    with ExitStack() as stack:
        sockets = [
            stack.enter_context(
                connect(f"ws://127.0.0.1:{port}/live?session={n}&watch=1", max_size=None)
            )
            for n in range(watchers)
        ]
        said.send("watching")
        threads = [
            threading.Thread(target=lambda s=s: results.append(_watched(s))) for s in sockets
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    said.send((min(r[0] for r in results), max(r[1] for r in results), min(r[2] for r in results)))


def _watched(channel: object) -> tuple[float, float, float]:
    times: list[float] = []
    pictures = 0
    end_s = time.monotonic() + WATCHED_S - 1.0
    while time.monotonic() < end_s:
        message = channel.recv(timeout=30)  # type: ignore[attr-defined]
        if isinstance(message, bytes):
            pictures += 1
            continue
        channel.send("heard")  # type: ignore[attr-defined]
        json.loads(message)
        times.append(time.monotonic())
    lasted_s = times[-1] - times[0]
    gap_s = statistics.quantiles((b - a for a, b in pairwise(times)), n=100)[-1]
    return len(times) / lasted_s, 1e3 * gap_s, pictures / lasted_s
