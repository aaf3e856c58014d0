"""A bench without imperfections, to which tests add one at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.plant.plant import Plant

AMBIENT = 101_325.0
TEMPERATURE = 295.15
GAS_CONSTANT = 8.314462618
GAMMA = 1.4
STEP_VOLUME = 0.35e-9
SYRINGE = 60e-6
CAVITY = 13e-6
DEAD_AND_TUBE = 1.5e-6 + 1.57e-6


@dataclass(frozen=True)
class Tables:
    pressure: NDArray[np.float64]
    deformation: NDArray[np.float64]
    blocked_force: NDArray[np.float64]
    volume_free: NDArray[np.float64]
    volume_blocked: NDArray[np.float64]


def rigid() -> Tables:
    """A cavity that does not grow, with an angle and a force proportional to pressure."""
    pressure = np.linspace(-2e3, 30e3, 200)
    return Tables(
        pressure=pressure,
        deformation=pressure * 1e-4,
        blocked_force=pressure * 3e-5,
        volume_free=np.full_like(pressure, CAVITY),
        volume_blocked=np.full_like(pressure, CAVITY),
    )


def parameters(**changes: Any) -> dict[str, Any]:
    base: dict[str, Any] = {
        "substeps": 1,
        "plunger_area": 5.6e-4,
        "molar_mass": 28.96e-3,
        "viscosity": 1.82e-5,
        "tube_area": np.pi * 1e-6,
        "tube_diameter": 2e-3,
        "valve_conductance": 2e-9,
        "valve_critical_ratio": 0.3,
        "full_pressure": 12e3,
        "ambient_pressure": AMBIENT,
        "ambient_temperature": TEMPERATURE,
        "volume_per_step": STEP_VOLUME,
        "backlash_volume": 0.0,
        "syringe_volume": SYRINGE,
        "dead_volume": 1.5e-6,
        "start_volume": 0.0,
        "tube_volume": 1.57e-6,
        "tube_resistance": 2.3e7,
        "leak_conductance": 0.0,
        "heat_exchange_time": 0.3,
        "response_time": 0.02,
        "creep_share": [0.0],
        "creep_time": [8.0],
        "play_share": 0.0,
        "play_radius": [500.0, 1500.0, 3000.0],
        "transducer_gain": 10e3,
        "transducer_voltage_at_zero": 0.5,
        "transducer_noise": 0.0,
        "transducer_bow": 0.0,
        "transducer_span": 40e3,
        "transducer_drift": 0.0,
        "adc_reference": 5.0,
        "adc_levels": 1024.0,
        "counts_per_newton": 2e5,
        "load_cell_zero_counts": 1000.0,
        "load_cell_noise_counts": 0.0,
        "load_cell_creep_share": 0.0,
        "load_cell_creep_time": 60.0,
        "load_cell_bow": 0.0,
        "load_cell_span": 20.0,
        "load_cell_drift": 0.0,
        "drift_time": 60.0,
        "load_cell_period": 0.1,
        "bad_word_probability": 0.0,
    }
    return base | changes


def make(seed: int = 1, tables: Tables | None = None, **changes: Any) -> Plant:
    return Plant(parameters(**changes), tables or rigid(), seed)


def push(plant: Plant, volume: float, milliseconds: int) -> None:
    plant.run(milliseconds, steps=round(volume / STEP_VOLUME / milliseconds))
