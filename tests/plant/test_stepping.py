"""The plant in steps: as an FMU would be driven, saved and restored, and with ever smaller ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.board.virtual import specimen_of
from rig.plant.instruments import Instruments
from rig.plant.plant import Faults, Plant, plant_parameters
from rig.spec.workspace import Workspace
from tests.plant.convergence import SCENARIOS, figures_after
from tests.plant.idealised import STEP_VOLUME, make, push

ROOT = Path(__file__).resolve().parents[2]


def harsh(**changes: Any) -> Plant:
    """The bench `virtual-harsh`, on which nothing is switched off."""
    setup = Workspace(ROOT).setup("bellow-bending", "virtual-harsh")
    assert setup.bench.virtual is not None
    instruments = Instruments.draw(setup.bench, setup.bench.virtual, np.random.default_rng(1))
    specimen = specimen_of(setup, 1)
    parameters = plant_parameters(setup.bench, specimen, instruments, 12e3)
    return Plant(parameters | changes, specimen, 1)


def shake(plant: Plant) -> bytes:
    """Everything that changes the state; the state afterwards."""
    push(plant, 5e-6, 500)
    push(plant, -2e-6, 300)
    plant.set_faults(Faults(leak_conductance=1e-9))
    plant.run(100)
    plant.set_faults(Faults())
    plant.run(50, valve_open=True)
    for _ in range(40):
        plant.do_step(plant.truth().time, 7e-4, pulses=3.5)
    return plant.save()


@pytest.mark.parametrize("wet", [{}, {"liquid": 1, "density": 998.0, "entrained_air": 0.01}])
def test_a_restored_state_goes_the_same_way_to_the_last_bit(wet: dict[str, float]) -> None:
    water = wet and {"bulk_modulus": 2e9, "solubility": 0.02, "dissolution_time": 1.0}
    plant = harsh(**wet, **water)
    push(plant, 3e-6, 500)
    state = plant.save()
    first = shake(plant)
    plant.restore(state)
    assert plant.save() == state
    assert shake(plant) == first
    # and on another plant of the same parameters
    other = harsh(**wet, **water)
    other.restore(state)
    assert shake(other) == first


def test_ticks_are_steps_of_a_millisecond_with_sensors() -> None:
    ticked, stepped = harsh(), harsh()
    ticked.run(400, steps=20)
    for _ in range(400):
        stepped.do_step(stepped.truth().time, 1e-3, pulses=20)
    assert ticked.truth().gauge_pressure == stepped.truth().gauge_pressure > 1e3
    assert ticked.truth().deformation == stepped.truth().deformation


def test_a_tick_of_four_substeps_is_four_steps() -> None:
    ticked, stepped = harsh(substeps=4), harsh()
    ticked.run(100, steps=20)
    for _ in range(400):
        stepped.do_step(stepped.truth().time, 0.25e-3, pulses=5)
    assert ticked.truth().gauge_pressure == stepped.truth().gauge_pressure > 100


@pytest.mark.parametrize(("time", "step"), [(0.1, 1e-3), (0.0, 0.0), (0.0, -1e-3), (0.0, 6e-3)])
def test_a_step_from_another_time_or_of_no_or_great_length_is_refused(
    time: float, step: float
) -> None:
    plant = make()
    before = plant.save()
    with pytest.raises(ValueError, match="from 0"):
        plant.do_step(time, step)
    assert plant.save() == before


def test_pulses_of_a_step_need_not_be_whole() -> None:
    plant = make()
    for _ in range(4):
        plant.do_step(plant.truth().time, 1e-3, pulses=0.25)
    assert plant.truth().pushed_volume == pytest.approx(STEP_VOLUME, rel=1e-12)


@pytest.mark.parametrize(
    ("what", "figure", "coarse_ms", "at_a_millisecond"),
    [
        ("air, pushed in", "gauge_pressure", 4.0, 0.005),
        ("air, pushed in", "shape_pressure", 4.0, 0.01),
        ("air, vented", "actuator_pressure", 2.0, 10.0),
        ("air, vented", "gauge_pressure", 2.0, 5.0),
        ("water, pushed in", "gauge_pressure", 4.0, 5.0),
        ("water, pushed in", "shape_pressure", 4.0, 0.1),
    ],
)
def test_errors_fall_with_the_square_of_the_step(
    what: str, figure: str, coarse_ms: float, at_a_millisecond: float
) -> None:
    scenario = SCENARIOS[what]
    truth = figures_after(scenario, 1 / 16)[figure]
    coarse, fine = (
        abs(figures_after(scenario, step)[figure] - truth) for step in (coarse_ms, coarse_ms / 4)
    )
    # 16 for exactly second order; what is not smooth and the finest step's own error take some
    assert coarse / fine > 9
    assert abs(figures_after(scenario, 1.0)[figure] - truth) < at_a_millisecond
