"""The plant as the board sees it, its parameters, and its state; see test_closed_forms, too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from rig.mechanics.bellow import BellowShape
from rig.plant.inertia import deformation_inertia, shape_inertia
from rig.plant.instruments import Instruments
from rig.plant.parameters import actuator_parameters, drive_parameters
from rig.plant.plant import Faults, Fixture, Plant, plant_parameters
from rig.plant.specimen import draw_specimen
from rig.spec.bench import BeamSpecimen, BenchSpec
from rig.spec.physics import PlungerFriction
from rig.spec.workspace import Workspace
from tests.plant.idealised import (
    AMBIENT,
    DEAD_AND_TUBE,
    SYRINGE,
    make,
    push,
)


def test_the_open_valve_brings_ambient_pressure() -> None:
    plant = make()
    push(plant, 6e-6, 1_000)
    plant.run(5_000, valve_open=True)
    assert plant.truth().gauge_pressure == pytest.approx(0.0, abs=1.0)


def test_the_home_switch_closes_at_the_end_of_travel_and_steps_are_lost_beyond() -> None:
    plant = make(start_volume=1e-6)
    pins = plant.run(1, steps=0)
    assert not pins.home_switch
    pins = plant.run(4_000, steps=-1)
    assert pins.home_switch
    assert plant.truth().pushed_volume == 0.0


def test_a_disabled_motor_moves_nothing() -> None:
    plant = make()
    plant.run(1_000, steps=5, enabled=False)
    assert plant.truth().pushed_volume == 0.0


def test_the_tip_pushes_only_when_it_is_blocked() -> None:
    plant = make()
    push(plant, 6e-6, 1_000)
    assert plant.truth().force == 0.0
    plant.set_fixture(Fixture.BLOCKED)
    plant.run(100)
    assert plant.truth().force == pytest.approx(plant.truth().gauge_pressure * 3e-5, rel=1e-2)


def signed24(word: int) -> int:
    return word - (1 << 24) if word & 0x800000 else word


def test_load_cell_words_are_zero_plus_force_times_sensitivity() -> None:
    plant = make(load_cell_zero_counts=-5000.0)
    plant.set_fixture(Fixture.BLOCKED)
    push(plant, 6e-6, 1_000)
    plant.run(2_000)
    for _ in range(200):
        pins = plant.run(1)
        if pins.hx711_ready:
            break
    expected = -5000 + plant.truth().force * 2e5
    assert signed24(pins.hx711_word) == pytest.approx(expected, abs=1.0)


def test_words_come_at_the_sample_rate() -> None:
    plant = make()
    ready = sum(bool(plant.run(1).hx711_ready) for _ in range(5_000))
    assert ready == pytest.approx(50, abs=1)


def test_conversions_are_quantised_voltage() -> None:
    plant = make()
    pins = plant.run(1)
    assert pins.adc_count == 9
    assert {pins.adc[i] for i in range(9)} == {int(0.5 / 5 * 1024)}


def test_broken_wires_show_at_the_converter() -> None:
    plant = make()
    plant.set_faults(Faults(sensor_open=True))
    assert plant.run(1).adc[0] < 10
    plant.set_faults(Faults(sensor_short=True))
    assert plant.run(1).adc[0] == 1023


def test_a_restored_state_continues_identically() -> None:
    plant = make(transducer_noise=0.004, load_cell_noise_counts=50.0)
    push(plant, 3e-6, 500)
    state = plant.save()

    def trace() -> list[tuple[int, ...]]:
        return [tuple(plant.run(1).adc) for _ in range(200)]

    first = trace()
    plant.restore(state)
    assert trace() == first


def test_a_state_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="bytes"):
        make().restore(b"short")


def test_seeds_differ_in_noise_and_only_in_noise() -> None:
    one, other = make(seed=1, transducer_noise=0.004), make(seed=2, transducer_noise=0.004)
    noise = [[tuple(p.run(1).adc) for _ in range(50)] for p in (one, other)]
    assert noise[0] != noise[1]
    assert replace(one.truth(), time=0.0) == replace(other.truth(), time=0.0)


def test_transducer_noise_has_the_stated_deviation() -> None:
    plant = make(transducer_noise=0.02)
    volts = np.array([plant.run(1).adc[i] for _ in range(4_000) for i in (0, 4, 8)]) * 5 / 1024
    assert volts.std() == pytest.approx(0.02, rel=0.03)


def test_the_plant_has_every_imperfection_that_the_bench_states() -> None:
    library = Workspace(Path(__file__).resolve().parents[2])
    setup = library.setup("bellow-bending", "virtual-beam")
    bench, virtual = setup.bench, setup.bench.virtual
    assert virtual is not None
    rng = np.random.default_rng(1)
    specimen = draw_specimen(setup.actuator, setup.material, virtual.specimen, rng)
    hidden = Instruments.draw(bench, virtual, rng)
    found = plant_parameters(bench, specimen, hidden, 12e3)
    assert found["backlash_volume"] == hidden.backlash > 0
    assert found["play_share"] == specimen.hysteresis == virtual.specimen.hysteresis > 0
    assert found["creep_share"][0] == specimen.creep_share == virtual.specimen.creep > 0
    assert found["creep_time"][0] == virtual.specimen.creep_time
    assert found["heat_exchange_time"] == virtual.pneumatics.heat_exchange_time
    assert found["leak_conductance"] * 10e3 == pytest.approx(virtual.pneumatics.leak)
    words = bench.load_cell.sample_rate * virtual.sensors.bad_word_interval
    assert found["bad_word_probability"] == pytest.approx(1 / words)
    noise_newton = found["load_cell_noise_counts"] / found["counts_per_newton"]
    assert noise_newton == pytest.approx(virtual.sensors.load_cell_noise * 9.80665)
    assert found["transducer_drift"] == virtual.sensors.transducer_drift > 0
    assert found["load_cell_drift"] == pytest.approx(9.80665 * virtual.sensors.load_cell_drift)
    assert found["drift_time"] == virtual.sensors.drift_time


def test_true_constants_scatter_about_the_data_sheet_as_the_bench_states() -> None:
    setup = Workspace(Path(__file__).resolve().parents[2]).setup("bellow-bending", "virtual-beam")
    bench, virtual = setup.bench, setup.bench.virtual
    assert virtual is not None
    rng = np.random.default_rng(2)
    drawn = [Instruments.draw(bench, virtual, rng) for _ in range(2000)]
    nominal_and_spread = {
        "transducer_gain": (10e3, 10e3 * virtual.sensors.transducer_gain),
        "transducer_bow": (0.0, virtual.sensors.transducer_bow),
        "voltage_at_zero": (0.5, virtual.sensors.transducer_offset / 10e3),
        "counts_per_gram": (2000.0, 2000 * virtual.sensors.load_cell_gain),
        "load_cell_bow": (0.0, virtual.sensors.load_cell_bow),
        "load_cell_creep": (0.0, virtual.sensors.load_cell_creep),
        "volume_per_step": (
            bench.volume_per_step,
            bench.volume_per_step * virtual.drive.volume_per_step,
        ),
        "dead_volume": (2e-6, 2e-6 * virtual.drive.dead_volume),
    }
    for name, (nominal, spread) in nominal_and_spread.items():
        values = np.array([getattr(one, name) for one in drawn])
        assert values.mean() == pytest.approx(nominal, abs=4 * spread / np.sqrt(2000)), name
        assert values.std() == pytest.approx(spread, rel=0.08), name


def test_sensors_with_a_bow_show_less_in_the_middle_and_the_same_at_both_ends() -> None:
    bent, straight = make(transducer_bow=2e3, transducer_span=12e3), make()
    for plant in (bent, straight):
        push(plant, 6e-6, 4_000)
        plant.run(3_000)
    truth = bent.truth().gauge_pressure
    x = truth / 12e3
    volts = [p.run(1).adc[0] * 5 / 1024 for p in (bent, straight)]
    assert (volts[1] - volts[0]) * 10e3 == pytest.approx(2e3 * 4 * x * (1 - x), abs=60)


def test_masses_load_the_cell_and_a_plug_shuts_the_actuator_out() -> None:
    plant = make()
    plant.set_cell_load(0.5)
    assert plant.run(200).hx711_word == pytest.approx(1000 + 0.5 * 2e5, abs=1)
    plant.set_fixture(Fixture.PLUGGED)
    push(plant, 6e-6, 10_000)
    plant.run(5_000)
    start = SYRINGE + DEAD_AND_TUBE
    expected = AMBIENT * start / (start - plant.truth().pushed_volume) - AMBIENT
    assert plant.truth().gauge_pressure == pytest.approx(expected, rel=1e-5)
    assert plant.truth().actuator_pressure == pytest.approx(0.0, abs=1e-6)


def test_a_load_cell_with_a_bow_shows_less_in_the_middle() -> None:
    bent, straight = make(load_cell_bow=0.01), make()
    for load, less in ((10.0, 0.01), (5.0, 0.0075), (20.0, 0.0)):  # of a span of 20 N
        words = []
        for plant in (bent, straight):
            plant.set_cell_load(load)
            words.append(plant.run(200).hx711_word)
        assert words[1] - words[0] == pytest.approx(less * 2e5, abs=1)


def test_zeros_drift_apart_by_as_much_as_stated() -> None:
    cell, transducer = [], []
    for seed in range(200):
        plant = make(
            seed,
            load_cell_drift=0.01,
            load_cell_zero_counts=1e5,
            transducer_drift=1e3,
            drift_time=0.5,
        )

        def read(plant: Plant = plant) -> tuple[float, float]:
            pins = plant.run(101)
            return pins.hx711_word / 2e5, pins.adc[0] * 5 / 1024 * 10e3

        first = read()
        plant.run(5_000)
        last = read()
        cell.append(last[0] - first[0])
        transducer.append(last[1] - first[1])
    assert np.std(cell) == pytest.approx(0.01, rel=0.2)
    assert np.std(transducer) == pytest.approx(1e3, rel=0.2)


def test_what_a_bench_file_leaves_out_is_ideal() -> None:
    setup = Workspace(Path(__file__).resolve().parents[2]).setup("bellow-bending", "virtual-harsh")
    data = setup.bench.model_dump(mode="json")
    del data["fluid"]
    for section, names in {
        "specimen": ("more_creep", "inertia", "mullins", "ageing"),
        "pneumatics": ("turbulence", "minor_loss", "inertia"),
        "drive": ("friction", "torque"),
    }.items():
        for name in names:
            del data["virtual"][section][name]
    rng = np.random.default_rng(1)
    switches = {
        "liquid": False,
        "shape_inertia": 0.0,
        "mullins_share": 0.0,
        "ageing": 0.0,
        "turbulence": False,
        "minor_loss": 0.0,
        "tube_length_over_area": 0.0,
        "breakaway_force": 0.0,
        "rod_compliance": 0.0,
        "holding_torque": 0.0,
    }
    for bench in (setup.bench, BenchSpec.model_validate(data)):
        assert bench.virtual is not None
        specimen = draw_specimen(setup.actuator, setup.material, bench.virtual.specimen, rng)
        hidden = Instruments.draw(bench, bench.virtual, rng)
        found = plant_parameters(bench, specimen, hidden, 12e3)
        ideal = {name: found[name] for name in switches} == switches
        assert ideal == (bench is not setup.bench)
        assert sum(share > 0 for share in found["creep_share"]) == (1 if ideal else 2)
    for name in switches.keys() - {"liquid"}:
        assert plant_parameters(setup.bench, specimen, hidden, 12e3)[name], name


def test_the_motor_of_the_default_bench_has_torque_to_spare() -> None:
    setup = Workspace(Path(__file__).resolve().parents[2]).setup("bellow-bending", "virtual-beam")
    bench = setup.bench
    assert bench.virtual is not None
    hidden = Instruments.draw(bench, bench.virtual, np.random.default_rng(1))
    found = drive_parameters(bench, bench.virtual.drive, hidden)
    force = bench.safety.pressure * bench.syringe.area + found["sliding_force"]
    rate = bench.controller.max_flow / bench.volume_per_step / found["corner_rate"]
    assert found["torque_per_force"] * force < 0.1 * found["holding_torque"] / np.hypot(1, rate)


def test_a_heavier_fluid_slows_the_bending() -> None:
    workspace = Workspace(Path(__file__).resolve().parents[2])
    setup = workspace.setup("bellow-bending", "virtual-beam")
    assert setup.bench.virtual is not None
    rng = np.random.default_rng(1)
    specimen = draw_specimen(setup.actuator, setup.material, setup.bench.virtual.specimen, rng)
    shape = BellowShape.of(specimen.geometry)
    length, cavity = shape.effective_length, float(specimen.volume_free[40])
    assert specimen.pressure[40] == 0.0

    def energy(density: float) -> float:
        """Kinetic, at a rate of the tip's angle of 1 rad/s, in slices; J."""
        x = (np.arange(2_000) + 0.5) / 2_000 * length
        slice_mass = (shape.soft_mass(specimen.density) + density * cavity) / 2_000
        cap = shape.cap_mass(specimen.density)
        spread = 0.5 * slice_mass * np.sum((x**2 / (2 * length)) ** 2)
        return float(spread + 0.5 * cap * (length / 2) ** 2)

    for density in (1.2, 998.0):
        found = deformation_inertia(specimen, density)
        assert found == pytest.approx(2 * energy(density), rel=1e-5)
    dry, wet = (shape_inertia(specimen, 12e3, density) for density in (1.2, 998.0))
    assert 5 < 1 / (2 * np.pi * np.sqrt(wet)) < 1 / (2 * np.pi * np.sqrt(dry)) < 15
    for bench, inertia in ((setup.bench, dry), (workspace.bench("virtual-water"), wet)):
        assert bench.virtual is not None
        found = actuator_parameters(bench, bench.virtual.specimen, specimen, 12e3)
        assert found["shape_inertia"] == pytest.approx(inertia, rel=1e-3)


def test_a_liquid_bench_has_no_feed_forward_of_a_gas() -> None:
    bench = Workspace(Path(__file__).resolve().parents[2]).bench("virtual-water")
    data = bench.model_dump(mode="json")
    data["controller"]["feed_forward"] = 1.0
    with pytest.raises(ValidationError, match="expected 0"):
        BenchSpec.model_validate(data)


def test_friction_and_creep_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValidationError, match="at least as large as sliding"):
        PlungerFriction.model_validate({"breakaway": "3 N", "sliding": "4 N"})
    variation = Workspace(Path(__file__).resolve().parents[2]).bench("virtual-beam").virtual
    assert variation is not None
    terms = [{"share": 0.5, "time": 1}, {"share": 0.46, "time": 10}]
    with pytest.raises(ValidationError, match="together below 1"):
        BeamSpecimen.model_validate(
            variation.specimen.model_dump(mode="json") | {"more_creep": terms}
        )
