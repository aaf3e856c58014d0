"""What the gas estimator finds on the virtual bench: consistency, noise and lag, leaks.

`python -m tests.bench gas` takes a quarter of an hour: 2000 seeded runs of a minute.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import beta, chi2

from rig.board.virtual import Seeds, board_on, specimen_of
from rig.control.gas import GasEstimate
from rig.control.gas_monitor import ALARM_HOURS, FALSE_ALARMS, GasAlarm
from rig.experiment.gas_watch import LEAK_PRESSURE, GasWatch, gas_line, gas_monitor
from rig.experiment.prepare import leave_home, make_ready, take_over, vent, write_parameters
from rig.experiment.setup import RunRequest
from rig.experiment.sweep import go_to
from rig.link.bus import SlcanBus
from rig.link.client import RigLink
from rig.link.errors import BoardFaultError
from rig.plant.instruments import Instruments
from rig.plant.plant import Faults, Plant, plant_parameters
from rig.record.documents import GasDocument
from tests.experiment.conftest import make_request

SEEDS = 200
GAS_CONSTANT = 8.314462618
UNSEEN_STEP = 20.0
Staircase = Sequence[tuple[float, float]]
"""Pressures in kPa and how long to stay there in s."""
HOLD: Staircase = ((10, 45),)
STAIRS: Staircase = tuple((kpa, 6) for kpa in (2, 4, 6, 8, 10, 8, 6, 4, 2, 5))
LEAKS_ML_S = (0.03, 0.1, 0.3)
CYCLES: Staircase = ((8, 3), (0.5, 3)) * 10
COURSES = {"hold": HOLD, "stairs": STAIRS, "cycles": CYCLES}
SOUND = (
    ("virtual-beam", "hold"),
    ("virtual-beam", "stairs"),
    ("virtual-beam", "cycles"),
    ("virtual-harsh", "stairs"),
)


@dataclass
class Seen:
    """What a run showed; `errors` are estimate minus truth over its standard uncertainty."""

    alarms: list[tuple[float, GasAlarm]]
    notes: list[GasDocument]
    leaks_from_s: float
    errors: tuple[float, float]
    """Gas and volume, at the end."""
    fault: str
    closed_s: float
    evidence: float
    """The most there was of a leak; 1 is a decision."""


def bench_without_camera(request: RunRequest, seed: int) -> tuple[Plant, RigLink]:
    """A plant and the link to its board; to draw a scene would take longer than the run."""
    setup, seeds = request.setup, Seeds.of(seed, 0)
    specimen = specimen_of(setup, seed)
    assert setup.bench.virtual is not None
    instruments = Instruments.draw(
        setup.bench, setup.bench.virtual, np.random.default_rng(seeds.instruments)
    )
    limit = setup.actuator.limits.pressure
    noise = int(seeds.noise.generate_state(1, np.uint64)[0])
    plant = Plant(plant_parameters(setup.bench, specimen, instruments, limit), specimen, noise)
    return plant, RigLink(SlcanBus(board_on(setup.bench, plant)))


def run(
    request: RunRequest,
    seed: int,
    stairs: Staircase,
    leak_ml_s: float = 0.0,
    after_s: float = 0.0,
) -> Seen:
    """One run; `leak_ml_s` at 10 kPa begins `after_s` seconds after the valve closed."""
    plant, link = bench_without_camera(request, seed)
    link.open()
    take_over(link)
    write_parameters(link, request.board_parameters())
    make_ready(link)
    leave_home(link)
    alarms: list[tuple[float, GasAlarm]] = []
    notes: list[GasDocument] = []
    monitor = gas_monitor(request)
    watch = GasWatch(lambda: monitor, lambda _, a: alarms.append((link.now_s, a)), notes.append)
    link.set_tap(watch)
    began_s = link.now_s
    leaks_from_s = began_s + after_s
    fault, leaking, evidence = "", False, 0.0
    errors = (np.nan, np.nan)
    try:
        for kpa, stay_s in stairs:
            go_to(link, kpa)
            until_s = link.now_s + stay_s
            while link.now_s < until_s:
                if leak_ml_s and not leaking and link.now_s >= leaks_from_s:
                    leaking = True
                    plant.set_faults(Faults(leak_conductance=leak_ml_s * 1e-6 / LEAK_PRESSURE))
                link.receive()
                evidence = max(evidence, monitor.evidence)
        errors = _errors(plant, monitor.estimate)
        closed_s = link.now_s - began_s
        vent(link)
    except BoardFaultError as error:
        closed_s = link.now_s - began_s
        fault = error.code
        link.raise_faults(False)
        link.wait(5.0)
    return Seen(alarms, notes, leaks_from_s, errors, fault, closed_s, evidence)


def _errors(plant: Plant, estimate: GasEstimate) -> tuple[float, float]:
    """Gas and actuator's volume against the truth, in standard uncertainties."""
    truth, known = plant.truth(), plant.parameters
    ambient = known["ambient_pressure"]
    gas = truth.gas_moles * GAS_CONSTANT * known["ambient_temperature"] / ambient
    return (
        (estimate.quantity - gas) / estimate.u_quantity,
        (estimate.actuator_volume - truth.actuator_volume) / estimate.u_actuator_volume,
    )


def upper_rate(events: int, hours: float) -> float:
    """Events an hour that are exceeded with 95 % confidence at most (Garwood)."""
    return float(chi2.ppf(0.95, 2 * events + 2) / 2 / hours)


def share(hits: int, of: int) -> str:
    """A share with its 95 % interval (Clopper and Pearson)."""
    low = beta.ppf(0.025, hits, of - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, of - hits) if hits < of else 1.0
    return f"{hits}/{of} ({low:.3f} to {high:.3f})"


def usual_leak_ml_s(request: RunRequest) -> float:
    """Of the bench itself, at 10 kPa; a scripted leak comes on top."""
    assert request.setup.bench.virtual is not None
    return request.setup.bench.virtual.pneumatics.leak * 1e6


def consistency(seeds: int) -> None:
    """Sound runs: false alarms and how near others came; NIS and squared errors."""
    print("\nsound runs; evidence: the largest of all runs, 1 is a decision; z: error over u")
    print(
        "bench          course  runs  closed h  false alarms  95 % bound /h  evidence  NIS   "
        "gas z rms  volume z rms  leak found, mL/s  u       truth within 2 u"
    )
    for bench, course in SOUND:
        request = make_request(bench=bench)
        seen = [run(request, seed, COURSES[course]) for seed in range(1, seeds + 1)]
        hours = sum(s.closed_s for s in seen) / 3600
        false = sum(len(s.alarms) for s in seen)
        notes = [s.notes[0] for s in seen]
        nis = np.mean([note.nis for note in notes])
        rms = np.sqrt(np.mean(np.square([s.errors for s in seen]), axis=0))
        leak = np.array([[note.leak_ml_s, note.leak_u_ml_s] for note in notes])
        inside = int(np.sum(np.abs(leak[:, 0] - usual_leak_ml_s(request)) < 2 * leak[:, 1]))
        print(
            f"{bench:14s} {course:7s} {len(seen):4d} {hours:9.2f} {false:13d} "
            f"{upper_rate(false, hours):14.2f} {max(s.evidence for s in seen):9.2f} {nis:5.2f} "
            f"{rms[0]:10.2f} {rms[1]:13.2f} {leak[:, 0].mean():8.4f} ± {leak[:, 0].std():.4f} "
            f"{leak[:, 1].mean():7.4f}  {share(inside, len(seen))}"
        )
    print(f"designed for at most {FALSE_ALARMS:g} false alarms in {ALARM_HOURS:g} h")


def leaks(seeds: int) -> None:
    """Detection times of leaks that begin at a random time."""
    request = make_request()
    print("\nleaks that begin 10 to 25 s after closing; times in s of bench time until told")
    print(
        "course  mL/s  found                   median   95 %    max  early  truth within 2 u   "
        "     u mean  tripped by the board"
    )
    for course in ("hold", "stairs"):
        for size in LEAKS_ML_S:
            delays, covered, told, early, u, faults = [], 0, 0, 0, [], 0
            for seed in range(1, seeds + 1):
                after_s = float(np.random.default_rng(seed).uniform(10.0, 25.0))
                seen = run(request, seed, COURSES[course], size, after_s)
                faults += bool(seen.fault)
                early += any(time_s < seen.leaks_from_s for time_s, _ in seen.alarms)
                delays += [t - seen.leaks_from_s for t, _ in seen.alarms if t >= seen.leaks_from_s]
                if seen.notes and seen.alarms:
                    told += 1
                    note = seen.notes[0]
                    u.append(note.leak_u_ml_s)
                    error = note.leak_ml_s - size - usual_leak_ml_s(request)
                    covered += abs(error) < 2 * note.leak_u_ml_s
            found = np.array(delays)
            print(
                f"{course:7s} {size:4.2f}  {share(len(found), seeds):22s} {np.median(found):6.1f} "
                f"{np.quantile(found, 0.95):6.1f} {found.max():6.1f} {early:6d}  "
                f"{share(covered, told):22s} {np.mean(u):7.4f} {faults:4d}"
            )


def noise_and_lag(request: RunRequest) -> None:
    """The filter at the link's own 50 Hz, as a loop in the host would use it."""
    plant, link = bench_without_camera(request, 1)
    link.open()
    take_over(link)
    write_parameters(link, request.board_parameters())
    make_ready(link)
    leave_home(link)
    # a single reading is noisier than the mean of ten
    monitor = gas_monitor(request, replace(gas_line(request), pressure_noise=5.0))
    rows: list[tuple[float, float, float, float, float]] = []
    go_to(link, 5.0)
    first = True
    steps = {20.0: 6.0, 40.0: 5.0, 60.0: 7.0}
    began_s = link.now_s
    while link.now_s < began_s + 80.0:
        for at, kpa in list(steps.items()):
            if link.now_s >= began_s + at:
                del steps[at]
                go_to(link, kpa)
        for m in link.receive(0.02):
            if m.name != "PRESSURE":
                continue
            x, p = m.values["plunger_ml"] * 1e-6, m.values["pressure_kpa"] * 1e3
            if first:
                monitor.close(x, p)
                first = False
            else:
                monitor.step(0.02, x, p)
            true = plant.truth().gauge_pressure
            rows.append((m.time_s, x, p, monitor.filtered_pressure, true))
    time_s, _, raw, filtered, truth = np.array(rows[1:]).T
    still = (time_s > began_s + 30) & (time_s < began_s + 40)
    print("\nnoise and lag at 50 Hz, hold and steps of 1 and 2 kPa at 2 kPa/s")
    for name, signal in (("reading", raw), ("filtered", filtered)):
        noise = np.std((signal - truth)[still])
        moving = np.abs(np.gradient(truth, time_s)) > 500
        lag = np.polyfit(np.gradient(truth, time_s)[moving], (truth - signal)[moving], 1)[0]
        print(f"{name:9s} noise {noise:5.2f} Pa, lag while the pressure moves {1e3 * lag:6.1f} ms")
    plunger, start = rows[-1][1], monitor.filtered_pressure
    half = 0
    while monitor.filtered_pressure - start < 0.5 * UNSEEN_STEP:
        monitor.step(0.02, plunger, start + UNSEEN_STEP)
        half += 1
    print(f"a step of {UNSEEN_STEP:g} Pa that no plunger explains shows half after {20 * half} ms")


def main() -> None:
    """Print the three tables."""
    noise_and_lag(make_request())
    consistency(SEEDS)
    leaks(SEEDS)
