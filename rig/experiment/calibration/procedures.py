"""The three procedures, each from a ready bench to a list of points, each point told at once.

Every loop goes up and down again: an instrument that drifts evenly in time then looks neither
steeper nor flatter than it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.calibrate.dead_weight import Piston
from rig.calibrate.points import Row
from rig.experiment.calibration.references import CalibrationBench, References, Stage, Taken
from rig.experiment.errors import ExperimentError
from rig.experiment.prepare import leave_home, make_ready, tare, vent
from rig.experiment.sweep import cell_readings, go_to, settle
from rig.link.client import RigLink
from rig.link.schema import load_schema
from rig.spec.protocol import Settling

SETTLING = Settling.model_validate({})
REST_S = 3.0
"""For gas to take the temperature of the wall, and for a person's load to come to rest."""
READING_S = 2.0
CELL_READING_S = 3.0
JOG_MOVES_S = 0.5
"""A jog ends by itself after this time."""
DISPENSE_ML_S = 3.0
DISPENSED_ML = DISPENSE_ML_S * JOG_MOVES_S
"""What a jog pushes out."""
COMPRESSION_ML_S = 2.0
COMPRESSION_KPA = 2.5
"""More than what a jog at that flow, 1 mL, adds to the pressure in a syringe of 60 mL."""
JOG_S = 1.0
"""The jog, and the rest for the water to come to rest."""


@dataclass(frozen=True)
class PressurePlan:
    """References in kPa, visited up and down in each cycle."""

    targets_kpa: tuple[float, ...]
    cycles: int = 2


@dataclass(frozen=True)
class LoadCellPlan:
    """Masses in grams, visited up and down in each cycle, and how long creep is watched."""

    masses_g: tuple[float, ...]
    cycles: int = 2
    creep_s: float = 180.0


@dataclass(frozen=True)
class SyringePlan:
    """Jogs of `DISPENSED_ML` between weighings, weighings, and the highest pressure in kPa."""

    jogs: int
    weighings: int
    top_kpa: float


def pressure_points(
    bench: CalibrationBench,
    link: RigLink,
    plan: PressurePlan,
    taken: Taken,
    stage: Stage,
    piston: Piston | None = None,
) -> None:
    """Transducer beside a gauge, or the `piston` of a dead-weight tester, on the plugged tube.

    The plunger makes the pressure.
    """
    bench.mount("plugged", link.receive)
    stage("homing the plunger and zeroing the transducer")
    make_ready(link)
    _vented(link, taken)
    for cycle in range(1, plan.cycles + 1):
        stage(f"cycle {cycle} of {plan.cycles}")
        leave_home(link)
        for direction, target_kpa in there_and_back(plan.targets_kpa):
            go_to(link, target_kpa)
            settle(link, target_kpa, SETTLING)
            link.wait(REST_S)
            before = _mean(link, "CONTROLLER", "transducer_v", READING_S)
            shown_kpa = _reference_kpa(bench.references, piston, target_kpa, link)
            after = _mean(link, "CONTROLLER", "transducer_v", READING_S)
            taken(
                {
                    "kind": direction,
                    "reference_kpa": shown_kpa,
                    "voltage_v": (before + after) / 2,
                }
            )
        vent(link)
        link.wait(REST_S)
        _vented(link, taken)


def load_cell_points(
    bench: CalibrationBench, link: RigLink, plan: LoadCellPlan, taken: Taken, stage: Stage
) -> None:
    """Load cell under masses, and its creep under the heaviest."""
    references = bench.references
    bench.mount("free", link.receive)
    references.place(0.0, link.receive)
    stage("taring")
    tare(link)
    _weighed(link, "zero", 0.0, taken)
    for cycle in range(1, plan.cycles + 1):
        stage(f"cycle {cycle} of {plan.cycles}")
        for direction, mass_g in there_and_back(plan.masses_g):
            references.place(mass_g, link.receive)
            link.wait(REST_S)
            _weighed(link, direction, mass_g, taken)
        references.place(0.0, link.receive)
        link.wait(REST_S)
        _weighed(link, "zero", 0.0, taken)
    if plan.creep_s > 0:
        stage(f"creep for {plan.creep_s:g} s")
        heaviest = max(plan.masses_g)
        references.place(heaviest, link.receive)
        began_s = link.now_s
        while link.now_s < began_s + plan.creep_s:
            _weighed(link, "creep", heaviest, taken, began_s)


def syringe_points(
    bench: CalibrationBench, link: RigLink, plan: SyringePlan, taken: Taken, stage: Stage
) -> None:
    """Water pushed out and weighed; then gas compressed behind a plug."""
    references = bench.references
    stage("homing the plunger")
    make_ready(link)
    references.fill(link.receive)
    for weighing in range(plan.weighings):
        stage(f"weighing {weighing + 1} of {plan.weighings}")
        for _ in range(plan.jogs):
            link.command("jog", DISPENSE_ML_S)
            link.wait(JOG_S)
        plunger_ml = _mean(link, "PRESSURE", "plunger_ml", READING_S)
        water_g = references.water_g(link.receive)
        taken(
            {"kind": "dispense", "plunger_ml": plunger_ml, "pressure_kpa": 0.0, "water_g": water_g}
        )
    stage("emptying: the plunger goes home")
    vent(link)
    bench.mount("plugged", link.receive)
    make_ready(link)
    leave_home(link)
    stage("compressing gas behind the plug")
    # by jogs, not by the pressure loop: its overshoot would come to rest on the other flank
    link.command("hold")
    pushed = 0
    while (last := _compressed(link, "up", taken)) + COMPRESSION_KPA < plan.top_kpa:
        if pushed and last < pushed * COMPRESSION_KPA / 2:
            raise ExperimentError(
                f"after {pushed} mL the plugged tube holds {last:.2f} kPa only; the plug leaks."
            )
        _jog(link, COMPRESSION_ML_S)
        pushed += 1
    for _ in range(pushed - 1):
        _jog(link, -COMPRESSION_ML_S)
        _compressed(link, "down", taken)
    vent(link)


def _jog(link: RigLink, flow_ml_s: float) -> None:
    link.command("jog", flow_ml_s)
    link.wait(JOG_S + REST_S)


def _compressed(link: RigLink, kind: str, taken: Taken) -> float:
    """Note a point of compression; returns its pressure in kPa."""
    here = [m.values for m in link.wait(READING_S) if m.name == "PRESSURE"]
    _require(here, "PRESSURE")
    pressure_kpa = float(np.mean([v["pressure_kpa"] for v in here]))
    plunger_ml = float(np.mean([v["plunger_ml"] for v in here]))
    taken({"kind": kind, "plunger_ml": plunger_ml, "pressure_kpa": pressure_kpa, "water_g": 0.0})
    return pressure_kpa


def there_and_back(values: Sequence[float]) -> list[tuple[str, float]]:
    """Each value on the way up, the highest twice, and each on the way down."""
    up = sorted(values)
    return [("up", value) for value in up] + [("down", value) for value in reversed(up)]


def _reference_kpa(
    references: References, piston: Piston | None, about_kpa: float, link: RigLink
) -> float:
    if piston is None:
        return references.gauge_kpa(about_kpa, link.receive)
    return piston.pressure_kpa(references.floating_g(piston, about_kpa, link.receive))


def _vented(link: RigLink, taken: Taken) -> None:
    voltage = _mean(link, "CONTROLLER", "transducer_v", READING_S)
    taken({"kind": "zero", "reference_kpa": 0.0, "voltage_v": voltage})


def _weighed(
    link: RigLink, kind: str, mass_g: float, taken: Taken, began_s: float | None = None
) -> None:
    from_s = link.now_s
    readings = cell_readings(link.wait(CELL_READING_S), load_schema())
    counts = [r.counts for r in readings if r.status == "ok"]
    _require(counts, "LOAD_CELL")
    since_s = 0.0 if began_s is None else (from_s + link.now_s) / 2 - began_s
    # the median: a bad word that the board let through must not count
    row: Row = {"kind": kind, "mass_g": mass_g, "counts": float(np.median(counts))}
    taken(row | {"time_s": since_s})


def _mean(link: RigLink, message: str, field: str, duration_s: float) -> float:
    values = [m.values[field] for m in link.wait(duration_s) if m.name == message]
    _require(values, message)
    return float(np.mean(values))


def _require(values: Sequence[object], message: str) -> None:
    if not values:
        raise ExperimentError(
            f"no {message} came from the board while a point was read; check the link and the "
            "instrument's cable."
        )
