"""The virtual bench's physics, stepped in C; this wraps it and fills its parameters.

The truth it holds is read by `rig.board` for a file of its own and by tests, never by experiments.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rig.plant._plant import ffi, lib
from rig.plant.instruments import Instruments
from rig.plant.parameters import (
    actuator_parameters,
    drive_parameters,
    fluid_parameters,
    sensor_parameters,
)
from rig.plant.specimen import Specimen
from rig.spec.bench import BenchSpec

Array = NDArray[np.float64]
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
    deformation: float
    """Bending angle in rad or elongation in m."""
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
    tube_flow: float
    """m3/s, to the actuator."""
    shape_pressure: float
    """Gauge pressure at which the quasi-static actuator has the shape of now."""
    load_cycles: float
    """How often the actuator's pressure limit was gone to and back, or as much in smaller parts."""
    missed_pulses: float
    """Of the stepper, for want of torque."""
    dissolved_moles: float
    liquid_volume: float
    """As at ambient pressure."""
    energy: float
    """Internal energy of the air, J; here and below 0 with a liquid."""
    work: float
    """Done on the air since power-on, J."""
    heat: float
    """Taken up by the air from the walls since power-on, J."""
    enthalpy_out: float
    """Gone to ambient since power-on, J."""
    moles_out: float
    """Gone to ambient since power-on, also in solution."""


_TRUTHS = tuple(field.name for field in fields(Truth) if field.name != "valve_open")


class ResponseTables(Protocol):
    """Quasi-static response over gauge `pressure` (n,) in Pa; SI units, each (n,)."""

    @property
    def pressure(self) -> Array: ...  # noqa: D102
    @property
    def deformation(self) -> Array: ...  # noqa: D102
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
        for name in ("deformation", "blocked_force", "volume_free", "volume_blocked"):
            values = np.interp(grid, pressure, getattr(tables, name))
            ffi.memmove(getattr(self._response, name), ffi.from_buffer(values), values.nbytes)
        self._plant = ffi.gc(lib.plant_new(self._parameters, self._response, seed), lib.plant_free)
        self._truth = ffi.new("plant_truth *")
        self._step_pins = ffi.new("rig_pins_out *", {"motor_enabled": 1})
        self._pins = ffi.new("rig_pins_in *")

    @property
    def step_address(self) -> int:
        """Address of the C function that advances the bench by 1 ms (a rig_bench_fn)."""
        return int(ffi.cast("uintptr_t", ffi.addressof(lib, "plant_tick")))

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

    def do_step(
        self, time: float, step: float, *, pulses: float = 0.0, valve_open: bool = False
    ) -> None:
        """Advance the physics alone by `step` s from `time` s, which must be now, as an FMU does.

        The `pulses`, evenly spread, need not be whole. Raises ValueError for another time, or for a
        step that is not above 0 and at most 5 ms.
        """
        out = self._step_pins
        out.valve_open = valve_open
        if not lib.plant_do_step(self._plant, time, step, pulses, out):
            raise ValueError(
                f"a step of {step:g} s from {time:g} s was asked of a plant that is at "
                f"{self.truth().time:g} s; expected a step of at most 5 ms from there"
            )

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
        return Truth(valve_open=bool(t.valve_open), **{name: getattr(t, name) for name in _TRUTHS})

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
    return (
        fluid_parameters(bench, virtual.pneumatics)
        | drive_parameters(bench, virtual.drive, instruments)
        | actuator_parameters(bench, virtual.specimen, specimen, pressure_limit)
        | sensor_parameters(bench, virtual.sensors, instruments)
        | {"substeps": virtual.substeps}
    )
