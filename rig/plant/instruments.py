"""The true constants of a simulated bench's instruments and drive.

Drawn around the data sheet and the drawing, never around a calibration: whatever the bench is
calibrated with, the instrument stays the same. No experiment sees them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig.spec.bench import BenchSpec, VirtualBench


@dataclass(frozen=True)
class Instruments:
    """What the instruments of one bench really are; SI units."""

    transducer_gain: float
    """Pa/V, of the straight line through zero and the end of the range."""
    transducer_bow: float
    """Pa that the transducer shows too little in the middle of its range."""
    voltage_at_zero: float
    """V at ambient pressure, apart from drift."""
    counts_per_gram: float
    load_cell_bow: float
    """kg that the load cell shows too little at half its capacity."""
    load_cell_creep: float
    """Share of the load that is shown too much in the end."""
    load_cell_zero_counts: float
    volume_per_step: float
    """m3 of one step pulse."""
    dead_volume: float
    backlash: float
    """m3 swept without effect when the drive turns round."""
    start_volume: float
    """m3 by which the plunger is pushed in at power-on."""

    @staticmethod
    def draw(bench: BenchSpec, virtual: VirtualBench, rng: np.random.Generator) -> Instruments:
        """Draw the instruments of one bench."""
        sensors, drive, sheet = virtual.sensors, virtual.drive, bench.transducer
        nominal = (sheet.pressure_high - sheet.pressure_low) / (
            sheet.voltage_high - sheet.voltage_low
        )
        gain = nominal * (1 + rng.normal(0, sensors.transducer_gain))
        offset = rng.normal(0, sensors.transducer_offset)
        sensitivity = sensors.load_cell_sensitivity
        backlash = bench.syringe.area * bench.lead_screw.backlash
        return Instruments(
            transducer_gain=gain,
            voltage_at_zero=sheet.voltage_low + (offset - sheet.pressure_low) / nominal,
            counts_per_gram=sensitivity * (1 + rng.normal(0, sensors.load_cell_gain)),
            load_cell_zero_counts=rng.normal(0, 20 * sensitivity),
            start_volume=bench.syringe.volume * rng.uniform(0.02, 0.2),
            transducer_bow=rng.normal(0, sensors.transducer_bow),
            load_cell_bow=rng.normal(0, sensors.load_cell_bow),
            load_cell_creep=rng.normal(0, sensors.load_cell_creep),
            volume_per_step=bench.volume_per_step * (1 + rng.normal(0, drive.volume_per_step)),
            dead_volume=bench.syringe.dead_volume * max(0.0, 1 + rng.normal(0, drive.dead_volume)),
            backlash=backlash * max(0.0, 1 + rng.normal(0, drive.backlash)),
        )
