"""Parameters of the C plant from the specs, part by part; SI units, names as in plant.h."""

from __future__ import annotations

from typing import Any

import numpy as np

from rig.plant.inertia import shape_inertia
from rig.plant.instruments import Instruments
from rig.plant.specimen import Specimen
from rig.spec.bench import (
    BenchSpec,
    SpecimenVariation,
    VirtualDrive,
    VirtualPneumatics,
    VirtualSensors,
)
from rig.spec.physics import Liquid
from rig.spec.quantity import STANDARD_GRAVITY

AIR_MOLAR_MASS = 28.96e-3
"""kg/mol of dry air (CRC Handbook of Chemistry and Physics)."""
GAS_CONSTANT = 8.314462618
REFERENCE_LEAK_PRESSURE = 10e3
"""Gauge pressure in Pa at which a bench spec states its leak."""
PLAY_RADII = (0.05, 0.15, 0.30)
"""Radii of the hysteresis' play operators, relative to the actuator's pressure limit: a guess."""
CREEP_TERMS = 4
_NO_CREEP = (0.0, 1.0)


def fluid_parameters(bench: BenchSpec, pneumatics: VirtualPneumatics) -> dict[str, Any]:
    """What fills the bench, and all that it flows through."""
    tube, ambient = bench.tubing, bench.ambient
    liquid = bench.fluid if isinstance(bench.fluid, Liquid) else None
    area = np.pi * tube.inner_diameter**2 / 4
    return {
        "ambient_pressure": ambient.pressure,
        "ambient_temperature": ambient.temperature,
        "liquid": liquid is not None,
        "molar_mass": AIR_MOLAR_MASS,
        "density": _fluid_density(bench),
        "viscosity": bench.fluid.viscosity,
        "bulk_modulus": liquid.bulk_modulus if liquid else 0.0,
        "entrained_air": liquid.entrained_air if liquid else 0.0,
        "solubility": liquid.solubility if liquid else 0.0,
        "dissolution_time": liquid.dissolution_time if liquid else 1.0,
        "heat_exchange_time": pneumatics.heat_exchange_time,
        "tube_volume": tube.volume,
        "tube_area": area,
        "tube_diameter": tube.inner_diameter,
        "tube_resistance": tube.resistance(bench.fluid.viscosity),
        "minor_loss": pneumatics.minor_loss,
        "tube_length_over_area": tube.length / area if pneumatics.inertia else 0.0,
        "turbulence": pneumatics.turbulence,
        "valve_conductance": pneumatics.valve_conductance,
        "valve_critical_ratio": pneumatics.valve_critical_ratio,
        "leak_conductance": pneumatics.leak / REFERENCE_LEAK_PRESSURE,
    }


def drive_parameters(
    bench: BenchSpec, drive: VirtualDrive, instruments: Instruments
) -> dict[str, Any]:
    """Motor, lead screw, plunger and syringe."""
    friction, torque, screw = drive.friction, drive.torque, bench.lead_screw
    microsteps = bench.stepper.microsteps
    return {
        "volume_per_step": instruments.volume_per_step,
        "backlash_volume": instruments.backlash,
        "syringe_volume": bench.syringe.volume,
        "dead_volume": instruments.dead_volume,
        "start_volume": instruments.start_volume,
        "plunger_area": bench.syringe.area,
        "breakaway_force": friction.breakaway if friction else 0.0,
        "sliding_force": friction.sliding if friction else 0.0,
        "viscous_friction": friction.viscous if friction else 0.0,
        "rod_compliance": friction.rod_compliance if friction else 0.0,
        "holding_torque": torque.holding if torque else 0.0,
        "corner_rate": torque.corner_rate * microsteps if torque else 1.0,
        "start_rate": torque.start_rate * microsteps if torque else 0.0,
        "pulses_per_cycle": 4 * microsteps,
        "torque_per_force": (screw.lead / (2 * np.pi * torque.screw_efficiency) if torque else 0.0),
    }


def actuator_parameters(
    bench: BenchSpec,
    variation: SpecimenVariation,
    specimen: Specimen | None,
    pressure_limit: float,
) -> dict[str, Any]:
    """What time does to the specimen's response; nothing without a specimen.

    `pressure_limit` in Pa scales hysteresis and load cycles.
    """
    terms = [_NO_CREEP] * CREEP_TERMS
    if specimen is not None:
        own = [(term.share, term.time) for term in variation.more_creep]
        terms = [(specimen.creep_share, specimen.creep_time), *own, *terms][:CREEP_TERMS]
    mullins = variation.mullins if specimen else None
    inertia = 0.0
    if specimen is not None and variation.inertia:
        inertia = shape_inertia(specimen, pressure_limit, _fluid_density(bench))
    return {
        "full_pressure": pressure_limit,
        "response_time": variation.response_time,
        "shape_inertia": inertia,
        "creep_share": [share for share, _ in terms],
        "creep_time": [time for _, time in terms],
        "play_share": specimen.hysteresis if specimen else 0.0,
        "play_radius": [r * pressure_limit for r in PLAY_RADII],
        "mullins_share": mullins.softening if mullins else 0.0,
        "mullins_width": mullins.width if mullins else 1.0,
        "mullins_cycles": mullins.cycles if mullins else 0.0,
        "ageing": variation.ageing if specimen else 0.0,
    }


def sensor_parameters(
    bench: BenchSpec, sensors: VirtualSensors, instruments: Instruments
) -> dict[str, Any]:
    """Transducer with converter, and load cell with amplifier."""
    counts_per_newton = instruments.counts_per_gram / (1e-3 * STANDARD_GRAVITY)
    return {
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
            1.0, 1 / (bench.load_cell.sample_rate * sensors.bad_word_interval)
        ),
        "drift_time": sensors.drift_time,
    }


def _fluid_density(bench: BenchSpec) -> float:
    """In kg/m3, at ambient pressure and temperature."""
    if isinstance(bench.fluid, Liquid):
        return bench.fluid.density
    moles = bench.ambient.pressure / (GAS_CONSTANT * bench.ambient.temperature)
    return float(moles * AIR_MOLAR_MASS)
