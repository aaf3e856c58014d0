"""One scenario: a whole run on a simulated bench that a fault script breaks, and what came of it.

The truth of the simulator is read here: this is a test of the rig, not an experiment.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rig.board.injection import PRESSURISED, FaultyLine, Injection
from rig.board.virtual import VirtualBench
from rig.errors import RigError
from rig.experiment.bench import Nobody
from rig.experiment.plan import make_plan
from rig.experiment.run import new_run
from rig.experiment.setup import RunRequest
from rig.mechanics.job import Job
from rig.mechanics.outline import body_of
from rig.record.documents import PointDocument, PointKey
from rig.record.errors import RecordError
from rig.record.reader import RunReader
from rig.spec.faults import FaultScript
from rig.spec.workspace import Setup

AFTERMATH_S = 30.0
"""Bench time after a run's end, without a host, before the final state is judged."""


@dataclass(frozen=True)
class Outcome:
    """What came of a scenario; times in seconds after the first fault began, pressures in kPa."""

    script: FaultScript
    seed: int
    limit_kpa: float
    """The pressure at which the board trips."""
    injected_s: float | None
    """Bench time of the first fault; None if its moment never came, or there was none."""
    detected_s: float | None
    """First report of a fault code."""
    code: str
    """The first code that was reported, or 'none'."""
    valve_s: float | None
    """Opening of the valve, if the board reported a fault and the valve was closed before."""
    vented_s: float | None
    """From then on nothing was above 0.5 kPa; None if something is at the end."""
    peak_kpa: float
    """Highest true pressure anywhere."""
    final_kpa: float
    """Highest true pressure at the end."""
    valve_open: bool
    run: Literal["success", "aborted", "failed", "refused"]
    reason: str
    """Why the run ended."""
    points: tuple[PointDocument, ...]
    """As the log has them."""
    told: tuple[PointDocument, ...]
    """As the run said that they were safe."""
    log_problem: str | None
    """What is wrong with the log; None if nothing is, or if there should be none."""

    @property
    def reacted_s(self) -> float | None:
        """The first thing that the board did about it."""
        times = [t for t in (self.detected_s, self.valve_s) if t is not None]
        return min(times) if times else None

    @property
    def actuator(self) -> Literal["vented", "pressurised"]:
        """Whether the bench is safe to touch at the end."""
        safe = self.valve_open and self.final_kpa <= PRESSURISED / 1e3
        return "vented" if safe else "pressurised"


class _Told(Nobody):
    """Keeps the points that the run said were on disk."""

    def __init__(self) -> None:
        self.points: list[PointDocument] = []

    def point_done(self, point: PointDocument) -> None:
        """A point is safely on disk."""
        self.points.append(point)


def run_scenario(
    script: FaultScript, setup: Setup, seed: int, folder: Path, job: Job | None = None
) -> Outcome:
    """Take a whole run into `folder` while `script` breaks the simulated bench."""
    request = RunRequest(
        setup=setup,
        plan=make_plan(setup.protocol, setup.actuator, setup.bench),
        seed=seed,
        cavity_volume=body_of(setup.actuator.geometry).cavity_volume,
    )
    bench = VirtualBench(setup, seed, folder / "truth.mcap", faults=script, job=job)
    line = bench.line
    assert line is not None, "a bench with a script has a faulty line"
    told = _Told()
    run: Literal["success", "aborted", "failed", "refused"]
    try:
        try:
            stop = new_run(folder, bench, request, told).stop
            run, reason = stop.exit_status, stop.reason
        except RigError as error:
            run, reason = "refused", str(error)
        line.read(AFTERMATH_S)
    finally:
        bench.close()
    points, log_problem = _read_back(folder, run)
    truth = line.truth
    first = _first(line.injections)
    injected_s = None if first is None else first.began_s
    reports = [r for r in line.witness.reports if injected_s is not None and r.time_s >= injected_s]
    found = [r for r in reports if r.code != "none"]
    final_kpa = max(truth.gauge_pressure, truth.actuator_pressure) / 1e3
    return Outcome(
        script=script,
        seed=seed,
        limit_kpa=request.board_parameters()["pressure_limit_kpa"],
        injected_s=injected_s,
        detected_s=_after(injected_s, found[0].time_s) if found else None,
        code=found[0].code if found else "none",
        valve_s=(
            None
            if first is None or first.valve_was_open or not found
            else _after(injected_s, line.valve_opened_s)
        ),
        vented_s=_vented_after(injected_s, line) if final_kpa < PRESSURISED / 1e3 else None,
        peak_kpa=truth.peak_pressure / 1e3,
        final_kpa=final_kpa,
        valve_open=truth.valve_open,
        run=run,
        reason=reason,
        points=points,
        told=tuple(told.points),
        log_problem=log_problem,
    )


def _first(injections: list[Injection]) -> Injection | None:
    begun = [(i.began_s, n) for n, i in enumerate(injections) if i.began_s is not None]
    return injections[min(begun)[1]] if begun else None


def _vented_after(injected_s: float | None, line: FaultyLine) -> float | None:
    return None if injected_s is None else max(0.0, line.pressurised_s - injected_s)


def _after(injected_s: float | None, time_s: float) -> float | None:
    if injected_s is None or time_s < injected_s:
        return None
    return time_s - injected_s


def _read_back(folder: Path, run: str) -> tuple[tuple[PointDocument, ...], str | None]:
    """Points of the log, and what is wrong with it."""
    if run == "refused":
        return (), None
    try:
        reader = RunReader(folder)
        points, stop = reader.points(), reader.stop()
    except RecordError as error:
        return (), str(error)
    if reader.problem is not None:
        return points, reader.problem
    if stop is None or stop.exit_status != run:
        return points, f"its stop document does not say that the run was {run}"
    return points, None


def wrong_points(outcome: Outcome, healthy: Outcome) -> tuple[PointKey, ...]:
    """Recorded points that the same bench, unbroken, measures otherwise.

    Before the first fault every bit must agree; after it, the values within three standard
    uncertainties of their difference.
    """
    sound = {point.key: point for point in healthy.points}
    wrong: list[PointKey] = []
    for point in outcome.points:
        other = sound[point.key]
        if outcome.injected_s is None or point.measured_to_s < outcome.injected_s:
            same = point == other
        else:
            same = _agree(point, other)
        if not same:
            wrong.append(point.key)
    return tuple(wrong)


def _agree(point: PointDocument, other: PointDocument) -> bool:
    if point.value is None or other.value is None:
        return point.value is other.value
    return abs(point.value - other.value) <= 3 * math.hypot(point.value_u, other.value_u)
