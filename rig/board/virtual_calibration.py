"""A simulated bench for calibration: no actuator and no camera, but references with errors of
their own.

Its instruments are those that a run of the same seed has.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from rig.board.virtual import Seeds, board_on, virtual_part
from rig.calibrate.air import AIR_KG_M3, BUOYANCY, MASSES_KG_M3
from rig.calibrate.dead_weight import Piston
from rig.calibrate.syringe import water_density
from rig.link.bus import SlcanBus
from rig.plant.instruments import Instruments
from rig.plant.plant import Fixture, Plant, plant_parameters
from rig.plant.truth_tables import TruthTables
from rig.spec.bench import BenchSpec, VirtualReferences
from rig.spec.quantity import CELSIUS, STANDARD_GRAVITY

Idle = Callable[[], object]
_PRESSURES = np.array([-2e3, 20e3])
_CAVITY = 10e-6  # m3 behind the plug, which nobody sees


class VirtualReferenceSet:
    """A gauge, masses, a piston and a balance that know the truth within errors drawn once."""

    def __init__(
        self,
        plant: Plant,
        references: VirtualReferences,
        temperature_c: float,
        rng: np.random.Generator,
    ) -> None:
        self._plant = plant
        self._spec = references
        self._density = water_density(temperature_c) * 1e3
        gauge, mass, balance, self._area = rng.normal(size=4)
        self._gauge = 1 + references.gauge_u * gauge
        self._mass = 1 + references.mass_u * mass
        self._balance = 1 + references.balance_u * balance
        self._filled = 0.0

    def gauge_kpa(self, about_kpa: float, idle: Idle) -> float:
        """The gauge's display."""
        del about_kpa, idle
        shown = self._plant.truth().gauge_pressure * self._gauge
        return _displayed(shown, self._spec.gauge_resolution) / 1e3

    def floating_g(self, piston: Piston, about_kpa: float, idle: Idle) -> float:
        """Masses are chosen to the last digit of the balance; the true area is not as certified."""
        del about_kpa, idle
        area = piston.area_mm2 / 1e6 * (1 + piston.area_u * self._area)
        borne = self._plant.truth().gauge_pressure * area / STANDARD_GRAVITY
        conventional = borne * MASSES_KG_M3 / (MASSES_KG_M3 - AIR_KG_M3)
        masses = (conventional - piston.mass_g / 1e3) / self._mass
        return _displayed(masses, self._spec.balance_resolution) * 1e3

    def place(self, mass_g: float, idle: Idle) -> None:
        """Masses press by their weight less the air's buoyancy."""
        del idle
        weight = mass_g / 1e3 * self._mass * (1 - BUOYANCY) * STANDARD_GRAVITY
        self._plant.set_cell_load(weight)

    def fill(self, idle: Idle) -> None:
        """The balance counts from here."""
        del idle
        self._filled = self._plant.truth().pushed_volume

    def water_g(self, idle: Idle) -> float:
        """The balance's display: adjusted in air, by masses, it weighs water that air bears."""
        del idle
        pushed = self._plant.truth().pushed_volume - self._filled
        load = pushed * (self._density - AIR_KG_M3) * STANDARD_GRAVITY
        per_kg = (MASSES_KG_M3 - AIR_KG_M3) / MASSES_KG_M3 * STANDARD_GRAVITY
        shown = load / per_kg * self._balance
        return _displayed(shown, self._spec.balance_resolution) * 1e3


def _displayed(value: float, resolution: float) -> float:
    return round(value / resolution) * resolution if resolution > 0 else value


class VirtualCalibrationBench:
    """A simulated bench, open for calibration; raises BoardError for one that hides nothing."""

    def __init__(self, bench: BenchSpec, seed: int) -> None:
        seeds, virtual = Seeds.of(seed, 0), virtual_part(bench)
        self.instruments = Instruments.draw(
            bench, virtual, np.random.default_rng(seeds.instruments)
        )
        parameters = plant_parameters(bench, None, self.instruments, _PRESSURES[-1])
        noise = int(seeds.references.generate_state(1, np.uint64)[0])
        self.plant = Plant(parameters, _Rigid(), noise)
        self.references = VirtualReferenceSet(
            self.plant,
            virtual.references,
            bench.ambient.temperature - CELSIUS,
            np.random.default_rng(seeds.references),
        )
        self.board = board_on(bench, self.plant)
        self.bus = SlcanBus(self.board)

    def mount(self, fixture: Literal["free", "blocked", "plugged"], idle: Idle) -> None:
        """Arrange the bench."""
        del idle
        self.plant.set_fixture(Fixture[fixture.upper()])

    def close(self) -> None:
        """Release the board."""
        self.bus.close()


class _Rigid(TruthTables):
    """Something that neither bends nor presses, behind a plug."""

    def __init__(self) -> None:
        still, full = np.zeros(2), np.full(2, _CAVITY)
        super().__init__(still, still, full, full)

    @property
    def pressure(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Gauge pressures of the tables, Pa."""
        return _PRESSURES
