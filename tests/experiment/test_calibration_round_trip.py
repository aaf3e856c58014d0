"""Instruments calibrated on the virtual bench against their true constants, within uncertainty.

E_n is the error over the expanded uncertainty (ISO 13528:2022, 9.7): within +-1 where both agree.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from rig.board.virtual import VirtualBench
from rig.board.virtual_calibration import VirtualCalibrationBench, VirtualReferenceSet
from rig.board.virtual_target import hidden_lean
from rig.calibrate.dead_weight import Piston
from rig.calibrate.load_cell import fit_load_cell
from rig.calibrate.points import Row
from rig.calibrate.syringe import Surroundings, fit_syringe
from rig.calibrate.transducer import fit_transducer
from rig.experiment import prepare
from rig.experiment.calibration.procedures import (
    LoadCellPlan,
    PressurePlan,
    SyringePlan,
    load_cell_points,
    pressure_points,
    syringe_points,
    there_and_back,
)
from rig.experiment.calibration.session import calibrate_on
from rig.experiment.errors import AbortedError
from rig.experiment.prepare import bench_parameters
from rig.link.client import RigLink
from rig.plant.instruments import Instruments
from rig.spec.calibration import (
    LoadCellCalibration,
    Provenance,
    SyringeCalibration,
    TransducerCalibration,
)
from rig.spec.quantity import CELSIUS, STANDARD_GRAVITY
from rig.spec.workspace import Workspace

from .conftest import ROOT, make_request

SPACE = Workspace(ROOT)
BENCH = SPACE.bench("virtual-beam")
CALIBRATIONS = SPACE.resolve_bench(BENCH)
PARAMETERS = bench_parameters(BENCH, CALIBRATIONS.transducer, None, 0.0)
PROVENANCE = Provenance(date=date(2026, 1, 1), method="test", instrument="virtual", simulated=True)
assert BENCH.virtual is not None
REFERENCES = BENCH.virtual.references
EXPANDED = 1.96


def silent(_: str) -> None:
    return


def calibrated_transducer(
    seed: int, steps: int = 10, piston: Piston | None = None
) -> tuple[Instruments, TransducerCalibration]:
    bench, rows = VirtualCalibrationBench(BENCH, seed), list[Row]()
    plan = PressurePlan(tuple(np.linspace(14 / steps, 14, steps).tolist()))
    calibrate_on(
        bench,
        PARAMETERS,
        lambda link: pressure_points(bench, link, plan, rows.append, silent, piston),
        silent,
    )
    scale_u = REFERENCES.gauge_u if piston is None else np.hypot(REFERENCES.mass_u, piston.area_u)
    made = fit_transducer(rows).calibration(rows, float(scale_u), PROVENANCE)
    return bench.instruments, made


def transducer_en(true: Instruments, made: TransducerCalibration) -> list[float]:
    """E_n of the pressures that the straight line gives as 2, 7 and 13 kPa."""
    found = []
    for indicated in (2e3, 7e3, 13e3):
        felt = indicated / made.gain * true.transducer_gain
        x = felt / BENCH.transducer.pressure_high
        really = felt + true.transducer_bow * 4 * x * (1 - x)
        u = np.hypot(made.gain_u * indicated, made.linearity_u * made.bow_share(indicated))
        found.append((made.corrected(indicated) - really) / (EXPANDED * u))
    return found


def calibrated_cell(seed: int) -> tuple[Instruments, LoadCellCalibration]:
    bench, rows = VirtualCalibrationBench(BENCH, seed), list[Row]()
    plan = LoadCellPlan((20.0, 50.0, 100.0, 150.0, 200.0), creep_s=120.0)
    calibrate_on(
        bench,
        PARAMETERS,
        lambda link: load_cell_points(bench, link, plan, rows.append, silent),
        silent,
    )
    return bench.instruments, fit_load_cell(rows).calibration(rows, REFERENCES.mass_u, PROVENANCE)


def cell_en(true: Instruments, made: LoadCellCalibration) -> list[float]:
    """E_n of the loads that the straight line gives as 20, 60 and 200 g."""
    found = []
    for indicated in (0.02, 0.06, 0.2):
        felt = indicated * made.counts_per_gram / true.counts_per_gram
        x = felt / BENCH.load_cell.capacity
        really = felt + true.load_cell_bow * 4 * x * (1 - x)
        u = np.linalg.norm(
            [
                made.counts_per_gram_u * indicated,
                made.linearity_u * made.bow_share(indicated),
                made.creep_u * indicated,
            ]
        )
        found.append(float((made.corrected(indicated) - really) / (EXPANDED * u)))
    return found


def calibrated_syringe(seed: int) -> tuple[Instruments, SyringeCalibration]:
    bench, rows = VirtualCalibrationBench(BENCH, seed), list[Row]()
    plan = SyringePlan(jogs=5, weighings=5, top_kpa=14.0)
    calibrate_on(
        bench,
        PARAMETERS,
        lambda link: syringe_points(bench, link, plan, rows.append, silent),
        silent,
    )
    around = Surroundings(
        ambient_kpa=BENCH.ambient.pressure / 1e3,
        ambient_u_kpa=0.0,
        temperature_c=BENCH.ambient.temperature - CELSIUS,
        temperature_u_c=0.0,
        volume_per_step_ul=PARAMETERS["volume_per_step_ul"],
        syringe_ml=BENCH.syringe.volume * 1e6,
        tube_ml=BENCH.tubing.volume * 1e6,
        tube_u_ml=0.0,
        balance_u=REFERENCES.balance_u,
        transducer=CALIBRATIONS.transducer,
    )
    return bench.instruments, fit_syringe(rows, around).calibration(rows, PROVENANCE)


def syringe_en(true: Instruments, made: SyringeCalibration) -> list[float]:
    """E_n of steps per mL, dead volume and backlash."""
    return [
        (made.steps_per_ml * true.volume_per_step * 1e6 - 1) / (EXPANDED * made.steps_per_ml_u),
        (made.dead_volume - true.dead_volume) / (EXPANDED * made.dead_volume_u),
        (made.backlash - true.backlash) / (EXPANDED * made.backlash_u),
    ]


@pytest.mark.parametrize("seed", [1, 2])
def test_a_transducer_is_found_again_better_than_its_data_sheet(seed: int) -> None:
    true, made = calibrated_transducer(seed)
    assert max(map(abs, transducer_en(true, made))) < 1
    # worth having: the shipped calibration, drawn from the data sheet, knows it to 0.1 %
    assert made.gain_u < 0.75 * CALIBRATIONS.transducer.gain_u


@pytest.mark.parametrize("seed", [1, 2])
def test_a_load_cell_is_found_again(seed: int) -> None:
    true, made = calibrated_cell(seed)
    assert max(map(abs, cell_en(true, made))) < 1
    assert made.counts_per_gram_u < CALIBRATIONS.load_cell.counts_per_gram_u


@pytest.mark.parametrize("seed", [1, 2])
def test_a_syringe_is_found_again(seed: int) -> None:
    true, made = calibrated_syringe(seed)
    assert max(map(abs, syringe_en(true, made))) < 1
    assert made.steps_per_ml_u < 5e-4


@pytest.mark.slow
def test_errors_of_forty_calibrations_are_within_their_uncertainty() -> None:
    table = {
        "transducer": np.array([transducer_en(*calibrated_transducer(s)) for s in range(40)]),
        "load cell": np.array([cell_en(*calibrated_cell(s)) for s in range(40)]),
        "syringe": np.array([syringe_en(*calibrated_syringe(s)) for s in range(40)]),
    }
    for name, en in table.items():
        print(
            f"\n{name}: r.m.s. E_n {np.sqrt((en**2).mean(axis=0)).round(2)}, "
            f"within 1: {(abs(en) <= 1).mean(axis=0)}"
        )
        # 95 % each; binomial: fewer than 35 of 40 come by chance in 1 case of 70
        assert ((abs(en) <= 1).sum(axis=0) >= 35).all(), name


def test_the_instruments_are_those_of_a_run_with_the_same_seed() -> None:
    request = make_request(seed=5)
    run = VirtualBench(request.setup, 5)
    alone = VirtualCalibrationBench(request.setup.bench, 5)
    shared = {"transducer_gain", "transducer_bow", "counts_per_newton", "load_cell_bow"}
    shared |= {"load_cell_creep_share", "volume_per_step", "dead_volume", "backlash_volume"}
    for name in shared:
        assert run.plant.parameters[name] == alone.plant.parameters[name]
    assert run.camera._camera.layout.ruler_lean == hidden_lean(BENCH, 5) != 0


def test_rulers_are_as_square_as_the_bench_says() -> None:
    assert BENCH.virtual is not None
    leans = [hidden_lean(BENCH, seed) for seed in range(300)]
    assert np.std(leans) == pytest.approx(BENCH.virtual.optics.ruler_squareness, rel=0.15)


def test_the_reference_gauge_has_an_error_of_its_own() -> None:
    readings = []
    for seed in range(20):
        bench = VirtualCalibrationBench(BENCH, seed)
        bench.mount("plugged", lambda: None)
        bench.plant.run(2_000, steps=8)
        bench.plant.run(3_000)
        truth = bench.plant.truth().gauge_pressure / 1e3
        readings.append(bench.references.gauge_kpa(0.0, lambda: None) / truth - 1)
    assert np.std(readings) == pytest.approx(REFERENCES.gauge_u, rel=0.6)


def test_a_dead_weight_tester_calibrates_as_a_gauge_does_within_its_own_uncertainty() -> None:
    piston = Piston(area_mm2=80.65, area_u=5e-4, mass_g=7.3, gravity=STANDARD_GRAVITY)
    found = []
    for seed in range(4):
        true, made = calibrated_transducer(seed, 7, piston)
        assert made.gain_u >= 5e-4
        found += transducer_en(true, made)
    assert max(map(abs, found)) < 1.5
    assert np.sqrt(np.mean(np.square(found))) > 0.15  # the area's error is there, and counted


def test_the_balance_weighs_water_in_air(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = VirtualCalibrationBench(BENCH, 1).plant
    exact = REFERENCES.model_copy(update={"balance_u": 0.0, "balance_resolution": 0.0})
    balance = VirtualReferenceSet(plant, exact, 20.0, np.random.default_rng(1))
    balance.fill(lambda: None)
    truth = plant.truth()
    pushed = replace(truth, pushed_volume=truth.pushed_volume + 1e-6)
    monkeypatch.setattr(plant, "truth", lambda: pushed)
    # 1 mL: 0.9982 g of water displace 1.2 mg of air
    assert balance.water_g(lambda: None) == pytest.approx(0.9972, abs=5e-5)


def test_a_calibration_that_is_stopped_leaves_the_bench_vented_and_its_points() -> None:
    bench, rows = VirtualCalibrationBench(BENCH, 1), list[Row]()
    plan = PressurePlan((4.0, 8.0, 12.0))

    def stop() -> None:
        if len(rows) == 3:
            raise AbortedError("stopped on request.")

    with pytest.raises(AbortedError):
        calibrate_on(
            bench,
            PARAMETERS,
            lambda link: pressure_points(bench, link, plan, rows.append, silent),
            silent,
            stop,
        )
    assert [row["kind"] for row in rows] == ["zero", "up", "up"]
    assert abs(bench.plant.truth().gauge_pressure) < 50.0
    assert bench.plant.truth().valve_open


def test_a_person_who_does_not_wait_for_the_venting_is_told_who_vents(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def insist(_: RigLink) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(prepare, "vent", insist)
    told: list[str] = []
    bench = VirtualCalibrationBench(BENCH, 1)
    calibrate_on(bench, PARAMETERS, lambda link: None, told.append)
    assert told == [
        "Venting was interrupted; the board's own watchdog vents when it hears nothing."
    ]


def test_every_sweep_goes_there_and_back() -> None:
    assert there_and_back([3.0, 1.0]) == [("up", 1.0), ("up", 3.0), ("down", 3.0), ("down", 1.0)]
