"""The virtual bench's physics, stepped in C at 1 ms; this wraps it and fills its parameters.

The truth it holds is read by `rig.board` for a file of its own and by tests, never by experiments.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rig.plant._plant import ffi, lib
from rig.plant.instruments import Instruments
from rig.plant.specimen import Specimen
from rig.spec.bench import BenchSpec
from rig.spec.quantity import STANDARD_GRAVITY

Array = NDArray[np.float64]
AIR_VISCOSITY = 1.82e-5
"""Pa s at 20 degC (CRC Handbook of Chemistry and Physics)."""
REFERENCE_LEAK_PRESSURE = 10e3
"""Gauge pressure in Pa at which a bench spec states its leak."""
RESPONSE_TIME = 0.02
"""s by which the shape lags the pressure: a guess until the mass and damping are modelled."""
PLAY_RADII = (0.05, 0.15, 0.30)
"""Radii of the hysteresis' play operators, relative to the actuator's pressure limit."""
TABLE_LENGTH = int(lib.PLANT_TABLE)


class Fixture(IntEnum):
    """How the tip is held."""

    FREE = int(lib.PLANT_FREE)
    BLOCKED = int(lib.PLANT_BLOCKED)
    PLUGGED = int(lib.PLANT_PLUGGED)
    """The tube ends in a plug; there is no actuator."""


class Switch(IntEnum):
    """What a limit switch shows."""

    LIVE = int(lib.PLANT_SWITCH_LIVE)
    STUCK_OPEN = int(lib.PLANT_SWITCH_STUCK_OPEN)
    STUCK_CLOSED = int(lib.PLANT_SWITCH_STUCK_CLOSED)


@dataclass(frozen=True)
class Faults:
    """Scripted faults in SI units, as plant.h explains them; the default is healthy."""

    leak_conductance: float = 0.0
    drift_rate: float = 0.0
    spike_voltage: float = 0.0
    lost_steps: float = 0.0
    bad_words: float = 0.0
    sensor_open: bool = False
    sensor_short: bool = False
    sensor_stuck: bool = False
    sensor_reversed: bool = False
    tube_off: bool = False
    tube_blocked: bool = False
    home_switch: Switch = Switch.LIVE
    end_switch: Switch = Switch.LIVE
    load_cell_reversed: bool = False
    hx711_silent: bool = False
    hx711_stuck: bool = False
    hx711_word: int = 0
    emergency_stop: bool = False


@dataclass(frozen=True)
class Truth:
    """What is really so at one instant; SI units, pressures gauge."""

    time: float
    gauge_pressure: float
    angle: float
    force: float
    actuator_volume: float
    pushed_volume: float
    gas_moles: float
    temperature: float
    actuator_pressure: float
    peak_pressure: float
    """The highest anywhere since power-on."""
    valve_opened: float
    """Plant time at which the closed valve was last opened; 0 if never."""
    valve_open: bool


class ResponseTables(Protocol):
    """Quasi-static response over gauge `pressure` (n,) in Pa; SI units, each (n,)."""

    @property
    def pressure(self) -> Array: ...  # noqa: D102
    @property
    def angle(self) -> Array: ...  # noqa: D102
    @property
    def blocked_force(self) -> Array: ...  # noqa: D102
    @property
    def volume_free(self) -> Array: ...  # noqa: D102
    @property
    def volume_blocked(self) -> Array: ...  # noqa: D102


class Plant:
    """One simulated bench with its specimen; advanced by the firmware's host HAL."""

    def __init__(self, parameters: dict[str, Any], tables: ResponseTables, seed: int) -> None:
        self.parameters = dict(parameters)
        self._parameters = ffi.new("plant_parameters *", parameters)
        self._response = ffi.new("plant_response *")
        pressure = tables.pressure
        grid = np.linspace(pressure[0], pressure[-1], TABLE_LENGTH)
        self._response.table_low, self._response.table_high = grid[0], grid[-1]
        for name in ("angle", "blocked_force", "volume_free", "volume_blocked"):
            values = np.interp(grid, pressure, getattr(tables, name))
            ffi.memmove(getattr(self._response, name), ffi.from_buffer(values), values.nbytes)
        self._plant = ffi.gc(lib.plant_new(self._parameters, self._response, seed), lib.plant_free)
        self._truth = ffi.new("plant_truth *")
        self._idle = ffi.new("rig_pins_out *", {"valve_open": 1})
        self._pins = ffi.new("rig_pins_in *")

    @property
    def step_address(self) -> int:
        """Address of the C function that advances the bench by 1 ms (a rig_bench_fn)."""
        return int(ffi.cast("uintptr_t", ffi.addressof(lib, "plant_do_step")))

    @property
    def state_address(self) -> int:
        """Address of the C object to hand to that function."""
        return int(ffi.cast("uintptr_t", self._plant))

    def run(
        self, milliseconds: int, *, steps: int = 0, valve_open: bool = False, enabled: bool = True
    ) -> Any:
        """Advance without firmware: `steps` pulses in each millisecond; returns the input pins."""
        out = ffi.new(
            "rig_pins_out *",
            {"steps": steps, "motor_enabled": enabled, "valve_open": valve_open},
        )
        lib.plant_run(self._plant, out, self._pins, milliseconds)
        return self._pins

    def set_fixture(self, fixture: Fixture) -> None:
        """Free the tip, or block it against the load cell."""
        lib.plant_set_fixture(self._plant, int(fixture))

    def set_cell_load(self, force: float) -> None:
        """Masses on the load cell, as their force in N."""
        lib.plant_set_cell_load(self._plant, force)

    def set_faults(self, faults: Faults) -> None:
        """Break things, or heal them."""
        lib.plant_set_faults(self._plant, ffi.new("plant_faults *", vars(faults)))

    def truth(self) -> Truth:
        """What is really so now."""
        lib.plant_get_truth(self._plant, self._truth)
        t = self._truth
        return Truth(
            t.time,
            t.gauge_pressure,
            t.angle,
            t.force,
            t.actuator_volume,
            t.pushed_volume,
            t.gas_moles,
            t.temperature,
            t.actuator_pressure,
            t.peak_pressure,
            t.valve_opened,
            bool(t.valve_open),
        )

    def save(self) -> bytes:
        """The whole state, random generator included."""
        buffer = ffi.new("char[]", int(lib.plant_state_size()))
        lib.plant_save(self._plant, buffer)
        return bytes(ffi.buffer(buffer))

    def restore(self, state: bytes) -> None:
        """Return to a saved state; raises ValueError if it is not one of this build."""
        if len(state) != lib.plant_state_size():
            raise ValueError(
                f"a plant state has {lib.plant_state_size()} bytes, this has {len(state)}"
            )
        lib.plant_restore(self._plant, ffi.from_buffer(state))


def plant_parameters(
    bench: BenchSpec,
    specimen: Specimen | None,
    instruments: Instruments,
    pressure_limit: float,
) -> dict[str, Any]:
    """Parameters of the C plant from the specs; SI units.

    `pressure_limit` in Pa scales the hysteresis of the specimen. Without a specimen its dynamics
    are none.
    """
    assert bench.virtual is not None
    virtual = bench.virtual
    sensors = virtual.sensors
    radius = bench.tubing.inner_diameter / 2
    tube_resistance = 8 * AIR_VISCOSITY * bench.tubing.length / (np.pi * radius**4)
    counts_per_newton = instruments.counts_per_gram / (1e-3 * STANDARD_GRAVITY)
    return {
        "ambient_pressure": bench.ambient.pressure,
        "ambient_temperature": bench.ambient.temperature,
        "volume_per_step": instruments.volume_per_step,
        "backlash_volume": instruments.backlash,
        "syringe_volume": bench.syringe.volume,
        "dead_volume": instruments.dead_volume,
        "start_volume": instruments.start_volume,
        "tube_volume": bench.tubing.volume,
        "tube_resistance": tube_resistance,
        # the valve vents through a short piece of the same tube (a guess; the paper has no valve)
        "valve_resistance": tube_resistance,
        "leak_conductance": virtual.pneumatics.leak / REFERENCE_LEAK_PRESSURE,
        "heat_exchange_time": virtual.pneumatics.heat_exchange_time,
        "response_time": RESPONSE_TIME,
        "creep_share": specimen.creep_share if specimen else 0.0,
        "creep_time": specimen.creep_time if specimen else 1.0,
        "play_share": specimen.hysteresis if specimen else 0.0,
        "play_radius": [r * pressure_limit for r in PLAY_RADII],
        "transducer_gain": instruments.transducer_gain,
        "transducer_voltage_at_zero": instruments.voltage_at_zero,
        "transducer_noise": sensors.transducer_noise,
        "transducer_bow": instruments.transducer_bow,
        "transducer_span": bench.transducer.pressure_high,
        "transducer_drift": sensors.transducer_drift,
        "adc_reference": bench.adc.reference,
        "adc_levels": 2.0**bench.adc.bits,
        "counts_per_newton": counts_per_newton,
        "load_cell_zero_counts": instruments.load_cell_zero_counts,
        "load_cell_noise_counts": sensors.load_cell_noise * STANDARD_GRAVITY * counts_per_newton,
        "load_cell_creep_share": instruments.load_cell_creep,
        "load_cell_creep_time": sensors.load_cell_creep_time,
        "load_cell_bow": instruments.load_cell_bow * STANDARD_GRAVITY,
        "load_cell_span": bench.load_cell.capacity * STANDARD_GRAVITY,
        "load_cell_drift": sensors.load_cell_drift * STANDARD_GRAVITY,
        "load_cell_period": 1 / bench.load_cell.sample_rate,
        "bad_word_probability": min(
            1.0,
            1 / (bench.load_cell.sample_rate * sensors.bad_word_interval),
        ),
        "drift_time": sensors.drift_time,
    }
