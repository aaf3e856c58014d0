"""How far the plant's figures are from those of ever smaller steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rig.board.virtual import specimen_of
from rig.plant.instruments import Instruments
from rig.plant.plant import Plant, plant_parameters
from rig.spec.physics import Liquid
from rig.spec.workspace import Workspace

ROOT = Path(__file__).resolve().parents[2]
STEPS_MS = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125)
FINEST_MS = 1 / 64
FIGURES = {"gauge_pressure": "Pa", "actuator_pressure": "Pa", "shape_pressure": "Pa"}
DURATION_S = 0.48
PEAK_FLOW = 5e-6
"""m3/s of the push: within `DURATION_S` it rises from nothing and falls to nothing again."""


@dataclass(frozen=True)
class Scenario:
    """A bench, and what is done to it."""

    liquid: bool
    pushed: bool
    """Pushed in by a flow that comes and goes; else vented from 10 kPa."""


SCENARIOS = {
    "air, pushed in": Scenario(liquid=False, pushed=True),
    "air, vented": Scenario(liquid=False, pushed=False),
    "water, pushed in": Scenario(liquid=True, pushed=True),
}


def plant_of(scenario: Scenario) -> Plant:
    """The bench `virtual-beam` with all that its file has, and without what is not smooth."""
    setup = Workspace(ROOT).setup("bellow-bending", "virtual-beam")
    assert setup.bench.virtual is not None
    fluid = Liquid(kind="liquid") if scenario.liquid else setup.bench.fluid
    bench = setup.bench.model_copy(update={"fluid": fluid})
    instruments = Instruments.draw(bench, setup.bench.virtual, np.random.default_rng(1))
    specimen = specimen_of(setup, 1)
    parameters: dict[str, Any] = plant_parameters(bench, specimen, instruments, 12e3)
    return Plant(parameters | {"play_share": 0.0}, specimen, 1)


def figures_after(scenario: Scenario, step_ms: float) -> Mapping[str, float]:
    """The figures at the end, with steps of `step_ms`."""
    plant = plant_of(scenario)
    pulse = plant.parameters["volume_per_step"]
    if not scenario.pushed:
        for _ in range(3_000):  # the same start for all
            plant.do_step(plant.truth().time, 1e-3, pulses=7e-6 / pulse / 3_000)
    step = step_ms * 1e-3

    def pushed(time: float) -> float:
        turn = 2 * np.pi * time / DURATION_S
        return PEAK_FLOW * DURATION_S / (4 * np.pi) * (turn - np.sin(turn))

    for k in range(round((DURATION_S if scenario.pushed else 0.032) / step)):
        volume = pushed((k + 1) * step) - pushed(k * step) if scenario.pushed else 0.0
        plant.do_step(
            plant.truth().time, step, pulses=volume / pulse, valve_open=not scenario.pushed
        )
    truth = plant.truth()
    return {name: getattr(truth, name) for name in FIGURES}


def errors(scenario: Scenario) -> dict[str, list[float]]:
    """For each figure how far it is, at each of `STEPS_MS`, from what the finest step gives."""
    finest = figures_after(scenario, FINEST_MS)
    found = [figures_after(scenario, step_ms) for step_ms in STEPS_MS]
    return {name: [abs(one[name] - finest[name]) for one in found] for name in FIGURES}


def orders(errors_by_step: list[float]) -> list[float]:
    """Powers of the step with which the error falls, from one step to the next."""
    e = np.array(errors_by_step)
    return [float(order) for order in np.log2(e[:-1] / e[1:])]
