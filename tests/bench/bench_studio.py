"""The live view while a run is taken: messages a browser gets, and what the link notices of it.

The bench runs at the clock's pace. Watchers are clients in a process of their own that answer as
browsers do. Targets: 20 messages a second, and polls of the link no rarer with
watchers than without.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import pairwise
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import uvicorn
from fastapi import FastAPI
from websockets.sync.client import connect

from rig.link.slcan import RawFrame
from rig.studio.desk import Choice, Desk
from rig.studio.live import live_route, message
from rig.studio.seat import Seat
from tests.studio.lab import make_lab

WATCHED_S = 12.0
VISITS = 6
MOVES = """async () => {
  const knob = document.querySelector('.q-slider [tabindex="0"]');
  const said = document.querySelector('.said');
  const times = [];
  for (let i = 0; i < 40; i++) {
    const redrawn = new Promise((done) => {
      const watch = new MutationObserver(() => {
        watch.disconnect();
        requestAnimationFrame(done);
      });
      watch.observe(said, { childList: true, characterData: true, subtree: true });
    });
    const start = performance.now();
    knob.dispatchEvent(new KeyboardEvent('keydown', { keyCode: 39, key: 'ArrowRight' }));
    knob.dispatchEvent(new KeyboardEvent('keyup', { keyCode: 39, key: 'ArrowRight' }));
    await redrawn;
    times.push(performance.now() - start);
  }
  return times;
}"""


def main() -> None:
    """Print the tables."""
    _pages()
    _hour_of_a_browser()
    _hour()
    print("\nwatchers  messages/s  99 % gap     pictures/s  polls/s  longest poll gap  behind  CPU")
    for watchers in (0, 1, 4):
        print(_measured(watchers))


def _pages() -> None:
    """Wall times within the browser, and what they cost the server; a cold and five warm visits."""
    visits = []
    with _browser() as (browser, address, pid):
        for _ in range(VISITS):
            page = browser.new_context().new_page()
            session = page.context.new_cdp_session(page)
            session.send("Performance.enable")
            cpu_s = _cpu_s(pid)
            page.goto(address, wait_until="commit")
            page.get_by_text("This is a sound design.").wait_for()
            seen_s = float(page.evaluate("performance.now()")) / 1e3
            visits.append((seen_s, _cpu_s(pid) - cpu_s, _spent_s(session)))
        cpu_s, spent_s = _cpu_s(pid), _spent_s(session)
        moves = page.evaluate(MOVES)
        each = (_cpu_s(pid) - cpu_s) / len(moves), (_spent_s(session) - spent_s) / len(moves)
    warm = np.median(visits[1:], axis=0)
    print("first page   shown after   server CPU   browser CPU")
    for name, (seen, server, script) in (("cold", visits[0]), ("warm", warm)):
        print(f"{name:10s}  {seen:10.2f} s  {server:9.2f} s  {script:10.2f} s")
    print(
        f"slider to redraw: median {np.median(moves):.0f} ms, 95 % {np.quantile(moves, 0.95):.0f} "
        f"ms of {len(moves)}; CPU of each {1e3 * each[0]:.0f} ms in the server, "
        f"{1e3 * each[1]:.0f} ms in the browser; load of the machine {os.getloadavg()[0]:.1f}"
    )


def _hour_of_a_browser() -> None:
    """Memory of server and page while a browser watches for an hour of bench time."""
    with _browser() as (browser, address, pid):
        page = browser.new_context().new_page()
        page.set_default_timeout(0)
        session = page.context.new_cdp_session(page)
        session.send("Performance.enable")
        page.goto(f"{address}/bench")
        page.get_by_role("button", name="Take control", exact=True).click()
        page.get_by_label("speed").click()
        page.get_by_role("option", name="as fast as it can").click()
        page.get_by_role("button", name="Connect", exact=True).click()
        print("\nbench time, min   server, MiB   heap of the page, MiB   its nodes")
        for minutes in (5, 20, 40, 60):
            page.wait_for_function(
                "s => Number(document.querySelector('[data-live=time]').textContent) > s",
                arg=60 * minutes,
            )
            session.send("HeapProfiler.collectGarbage")
            now = _metrics(session)
            print(
                f"{minutes:15d}   {_resident_mib(pid):11.1f}   "
                f"{now['JSHeapUsedSize'] / 2**20:21.1f}   {now['Nodes']:9.0f}"
            )


@contextmanager
def _browser() -> Iterator[tuple[Any, str, int]]:
    """A browser, the address of a studio, and its process id."""
    from playwright.sync_api import sync_playwright

    executable = shutil.which("chromium")
    if executable is None:
        raise SystemExit("there is no chromium here: apt-get install chromium")
    with ExitStack() as stack:
        place = stack.enter_context(tempfile.TemporaryDirectory())
        address, pid = stack.enter_context(_server(Path(place)))
        kit = stack.enter_context(sync_playwright())
        browser = kit.chromium.launch(executable_path=executable, args=["--no-sandbox"])
        yield browser, address, pid
        browser.close()


@contextmanager
def _server(place: Path) -> Iterator[tuple[str, int]]:
    """A studio in a process of its own: its address and process id."""
    make_lab(place)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-c", "from rig.cli.main import main; main()", "studio"]
    command += ["--port", str(port)]
    process = subprocess.Popen(command, cwd=place, stdout=subprocess.DEVNULL)
    address = f"http://127.0.0.1:{port}"
    try:
        while True:
            try:
                urllib.request.urlopen(f"{address}/assets/studio.css").close()
                break
            except OSError:
                time.sleep(0.1)
        yield address, process.pid
    finally:
        process.terminate()
        process.wait()


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _spent_s(session: Any) -> float:
    """What the page's main thread has worked."""
    return _metrics(session)["TaskDuration"]


def _metrics(session: Any) -> dict[str, float]:
    return {m["name"]: m["value"] for m in session.send("Performance.getMetrics")["metrics"]}


def _hour() -> None:
    """Memory of a server whose bench is watched for an hour of bench time, as fast as it goes."""
    with tempfile.TemporaryDirectory() as place:
        desk = Desk(make_lab(Path(place)), Seat(time.monotonic, patience_s=1e9))
        desk.watchers = 1
        desk.take_control("0")
        desk.connect("0", Choice("bellow-bending", "virtual-beam", speed=0.0))
        number, told, at = 0, 0, {}
        print("\nbench time, min   resident memory, MiB   messages")
        for minutes in (5, 20, 40, 60):
            while desk.scope.reading().time_s < 60 * minutes:
                text, number = message(desk, "0", True, number)
                told += len(text) > 0
                time.sleep(0.002)
            at[minutes] = _resident_mib()
            print(f"{minutes:15d}   {at[minutes]:20.1f}   {told}")
        desk.close()


def _resident_mib(pid: int | str = "self") -> float:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


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
