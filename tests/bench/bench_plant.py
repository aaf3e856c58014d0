"""The virtual bench's physics: beside closed forms, with ever smaller steps, and how fast it is.

Target: firmware and plant together 300 times real time on one core, in processor seconds.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

from rig.board.native import NativeBoard
from rig.board.virtual import VirtualBench
from rig.link.client import RigLink
from rig.spec.workspace import Workspace
from tests.plant.closed_forms import CASES
from tests.plant.convergence import FIGURES, SCENARIOS, STEPS_MS, errors

ROOT = Path(__file__).resolve().parents[2]
BENCHES = ("virtual-beam", "virtual-harsh", "virtual-water")


def closed_forms() -> Iterator[str]:
    """Rows of a table in Markdown."""
    yield "| case | plant | theory | relative error | tolerance |"
    yield "| --- | ---: | ---: | ---: | ---: |"
    for what, compare in CASES.items():
        c = compare()
        error = abs(c.plant / c.theory - 1)
        yield f"| {what} | {c.plant:.7g} | {c.theory:.7g} | {error:.1e} | {c.tolerance:.0e} |"


def convergence() -> Iterator[str]:
    """Rows of a table in Markdown: errors in the end against steps of 1/64 ms."""
    yield "| scenario | figure | " + " | ".join(f"{step:g} ms" for step in STEPS_MS) + " |"
    yield "| --- | --- |" + " ---: |" * len(STEPS_MS)
    for what, scenario in SCENARIOS.items():
        for name, found in errors(scenario).items():
            figure = f"{name.replace('_', ' ')}, {FIGURES[name]}"
            yield f"| {what} | {figure} | " + " | ".join(f"{e:.2g}" for e in found) + " |"


def times_real_time(bench_name: str) -> tuple[float, float, float]:
    """Of plant alone, of firmware and plant, and of both with the host's link, held at 10 kPa."""
    bench = VirtualBench(Workspace(ROOT).setup("bellow-bending", bench_name), 1)
    assert isinstance(bench.board, NativeBoard)
    link = RigLink(bench.bus)
    link.open()
    link.command("home")
    link.await_state("idle", 60.0)
    link.command("zero_pressure")
    link.wait(1.5)
    link.command("set_pressure", 10.0)
    link.wait(8.0)

    def rate(advance: Callable[[float], object], seconds: float) -> float:
        began = time.process_time()
        advance(seconds)
        return seconds / (time.process_time() - began)

    def hold(seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            link.wait(0.1)

    linked = rate(hold, 10.0)
    # without the host: within the second that the board waits for it
    boards = []
    for _ in range(10):
        boards.append(rate(bench.board.read, 0.8))
        link.wait(0.3)
    alone = rate(lambda seconds: bench.plant.run(round(1000 * seconds)), 20.0)
    return alone, sorted(boards)[len(boards) // 2], linked


def main() -> None:
    """Print the tables."""
    for rows in (closed_forms(), convergence()):
        print(*rows, "", sep="\n")
    print("times real time       plant alone   with firmware   with the host's link")
    for name in BENCHES:
        alone, board, linked = times_real_time(name)
        print(f"{name:<20}{alone:>13.0f}{board:>16.0f}{linked:>23.0f}")
