"""The plant beside closed forms: each case is a small bench, a figure of it, and what theory says.

Tests hold every case to its tolerance; `python -m tests.bench plant` prints them as a table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import erf

from rig.plant.plant import Faults, Fixture, Plant
from tests.plant.idealised import (
    AMBIENT,
    CAVITY,
    DEAD_AND_TUBE,
    GAMMA,
    GAS_CONSTANT,
    STEP_VOLUME,
    SYRINGE,
    TEMPERATURE,
    Tables,
    make,
    push,
    rigid,
)

NEVER = 1e12
"""s; of what is switched off."""
VAST = 1e4
"""m3; so large that nothing changes its pressure."""
AREA = 5.6e-4
TUBE_LENGTH, TUBE_DIAMETER = 0.5, 2e-3
TUBE_AREA = np.pi * TUBE_DIAMETER**2 / 4
AIR, WATER = 1.82e-5, 1.002e-3
MOLAR_MASS = 28.96e-3
COMPLIANCE = 3e-10
"""m3/Pa of the yielding actuator."""


@dataclass(frozen=True)
class Comparison:
    """What the plant does and what theory says, in one unit."""

    plant: float
    theory: float
    tolerance: float
    """Relative to `theory`."""


WET = {
    "liquid": 1,
    "density": 998.2,
    "viscosity": WATER,
    "bulk_modulus": 2.18e9,
    "entrained_air": 0.005,
    "solubility": 0.02,
    "dissolution_time": NEVER,
}
"""Water with bubbles."""

CASES: dict[str, Callable[[], Comparison]] = {}


def case(what: str) -> Callable[[Callable[[], Comparison]], Callable[[], Comparison]]:
    """Enter a function among the cases, under what it compares."""

    def enter(function: Callable[[], Comparison]) -> Callable[[], Comparison]:
        CASES[what] = function
        return function

    return enter


def yielding() -> Tables:
    """A cavity that grows in proportion to pressure."""
    pressure = np.linspace(-5e3, 40e3, 200)
    volume = CAVITY + COMPLIANCE * pressure
    return Tables(pressure, pressure * 1e-4, pressure * 3e-5, volume, volume)


def plugged(**changes: object) -> Plant:
    """The syringe alone."""
    plant = make(**changes)
    plant.set_fixture(Fixture.PLUGGED)
    return plant


def held(pressure: float, **changes: object) -> Plant:
    """An actuator that a vast volume of gas keeps at `pressure`, from time 0 on; rigid.

    The tube is blocked meanwhile, and lets the pressure pass at once afterwards.
    """
    plant = make(
        dead_volume=VAST,
        syringe_volume=VAST,
        heat_exchange_time=1e-4,
        tube_resistance=1e3,
        volume_per_step=1.0,
        **changes,
    )
    set_vast_pressure(plant, pressure)
    return plant


def set_vast_pressure(plant: Plant, pressure: float) -> None:
    """Bring the vast volume of `held` to a gauge pressure; the actuator sees it afterwards."""
    plant.set_faults(Faults(tube_blocked=True))
    whole = 2 * VAST + 1.57e-6
    wanted = whole * pressure / (AMBIENT + pressure)
    plant.do_step(plant.truth().time, 1e-3, pulses=wanted - plant.truth().pushed_volume)
    for _ in range(3):
        plant.do_step(plant.truth().time, 1e-3)
    plant.set_faults(Faults())


def load(plant: Plant, *pressures: float) -> None:
    """Let the actuator of `held` feel one pressure after the other."""
    for pressure in pressures:
        for between in np.linspace(plant.truth().gauge_pressure, pressure, 40)[1:]:
            set_vast_pressure(plant, between)
            plant.run(2)
        plant.run(20)


def pressure_after(volume: float, pushed: float) -> float:
    """Boyle: gauge pressure in a volume of gas at ambient pressure after a push."""
    return AMBIENT * pushed / (volume - pushed)


# gas


@case("Boyle: slow compression, both volumes, Pa")
def boyle() -> Comparison:
    plant = make()
    push(plant, 6e-6, 10_000)
    plant.run(5_000)
    theory = pressure_after(SYRINGE + DEAD_AND_TUBE + CAVITY, plant.truth().pushed_volume)
    return Comparison(plant.truth().gauge_pressure, theory, 1e-6)


@case("adiabatic compression, temperature rise, K")
def adiabatic_rise() -> Comparison:
    plant = plugged(heat_exchange_time=NEVER)
    push(plant, 6e-6, 100)
    volume = SYRINGE + DEAD_AND_TUBE
    ratio = volume / (volume - plant.truth().pushed_volume)
    theory = TEMPERATURE * (ratio ** (GAMMA - 1) - 1)
    return Comparison(plant.truth().temperature - TEMPERATURE, theory, 1e-9)


@case("adiabatic compression, pressure, Pa")
def adiabatic_pressure() -> Comparison:
    plant = plugged(heat_exchange_time=NEVER)
    push(plant, 6e-6, 100)
    volume = SYRINGE + DEAD_AND_TUBE
    ratio = volume / (volume - plant.truth().pushed_volume)
    return Comparison(plant.truth().gauge_pressure, AMBIENT * (ratio**GAMMA - 1), 1e-9)


@case("cooling in one time constant, share of the heat left")
def cooling() -> Comparison:
    plant = plugged(heat_exchange_time=0.5)
    push(plant, 6e-6, 10)
    hot = plant.truth().temperature - TEMPERATURE
    plant.run(500)
    return Comparison((plant.truth().temperature - TEMPERATURE) / hot, np.exp(-1.0), 1e-9)


def polytropic() -> complex:
    """Relative change of pressure over that of volume in small oscillations, omega tau = 1."""
    time_constant, steps = 0.2, 500
    omega = 1 / time_constant
    step = 2 * np.pi / omega / steps
    plant = plugged(heat_exchange_time=time_constant, start_volume=SYRINGE / 2)
    volume = SYRINGE / 2 + DEAD_AND_TUBE
    amplitude = 1e-4 * volume
    signal = []
    for k in range(8 * steps):
        change = amplitude * (np.sin(omega * (k + 1) * step) - np.sin(omega * k * step))
        plant.do_step(plant.truth().time, step, pulses=-change / STEP_VOLUME)
        signal.append(plant.truth().gauge_pressure / AMBIENT)
    last = np.array(signal[-steps:])
    phase = np.exp(-1j * omega * step * np.arange(len(signal) - steps + 1, len(signal) + 1))
    return complex(2j * np.mean(last * phase) / (amplitude / volume))


@case("polytropic exponent at omega tau = 1")
def polytropic_exponent() -> Comparison:
    return Comparison(abs(polytropic()), abs((1 + GAMMA * 1j) / (1 + 1j)), 1e-3)


@case("polytropic lead of pressure at omega tau = 1, deg")
def polytropic_lead() -> Comparison:
    theory = np.angle((1 + GAMMA * 1j) / (1 + 1j), deg=True)
    return Comparison(float(np.angle(-polytropic(), deg=True)), theory, 2e-3)


def uneven(**changes: object) -> Plant:
    """A little more pressure in the syringe than in a rigid actuator, adiabatic."""
    plant = make(heat_exchange_time=NEVER, start_volume=SYRINGE / 2, **changes)
    plant.set_faults(Faults(tube_blocked=True))
    push(plant, 0.035e-6, 10)
    plant.set_faults(Faults())
    return plant


def difference(plant: Plant) -> float:
    """Of pressure along the tube."""
    return plant.truth().gauge_pressure - plant.truth().actuator_pressure


def tube_stiffness(plant: Plant) -> float:
    """Pa/m3 by which the difference falls with the volume that goes through."""
    truth = plant.truth()
    mean = AMBIENT + 0.5 * (truth.gauge_pressure + truth.actuator_pressure)
    syringe = SYRINGE + DEAD_AND_TUBE - truth.pushed_volume
    return GAMMA * mean * (1 / syringe + 1 / CAVITY)


@case("tube, laminar: equalisation in 10 ms, share left")
def laminar_equalisation() -> Comparison:
    plant = uneven(tube_resistance=1e8)
    before, stiffness = difference(plant), tube_stiffness(plant)
    for _ in range(100):
        plant.do_step(plant.truth().time, 1e-4)
    return Comparison(difference(plant) / before, np.exp(-stiffness / 1e8 * 10e-3), 1e-3)


@case("tube, mass of the air: first maximum of the actuator's pressure, Pa")
def tube_resonance() -> Comparison:
    length_over_area = TUBE_LENGTH / TUBE_AREA
    plant = uneven(tube_resistance=5e6, tube_length_over_area=length_over_area)
    before, stiffness = difference(plant), tube_stiffness(plant)
    inertance = AMBIENT * MOLAR_MASS / (GAS_CONSTANT * TEMPERATURE) * length_over_area
    omega = np.sqrt(stiffness / inertance)
    damping = 5e6 / (2 * inertance * omega)
    lowest = min(difference_after(plant, 2e-4) for _ in range(150))
    theory = -before * np.exp(-np.pi * damping / np.sqrt(1 - damping**2))
    return Comparison(lowest, theory, 5e-3)


def difference_after(plant: Plant, step: float) -> float:
    """The difference after one more step."""
    plant.do_step(plant.truth().time, step)
    return difference(plant)


def steady_flow(pressure: float, **changes: object) -> tuple[float, float]:
    """Flow between two vast volumes, and the density of the air in the tube."""
    vast = rigid()
    volume = np.full_like(vast.pressure, VAST)
    tables = Tables(vast.pressure, vast.deformation, vast.blocked_force, volume, volume)
    plant = make(
        tables=tables,
        dead_volume=VAST,
        syringe_volume=VAST,
        volume_per_step=1.0,
        heat_exchange_time=1e-4,
        **changes,
    )
    set_vast_pressure(plant, pressure)
    plant.run(200)
    mean = AMBIENT + 0.5 * pressure
    return plant.truth().tube_flow, mean * MOLAR_MASS / (GAS_CONSTANT * TEMPERATURE)


@case("tube, Hagen-Poiseuille: flow at 500 Pa, mL/s")
def poiseuille() -> Comparison:
    resistance = 128 * AIR * TUBE_LENGTH / (np.pi * TUBE_DIAMETER**4)
    flow, _ = steady_flow(500.0, tube_resistance=resistance, turbulence=1)
    return Comparison(flow * 1e6, 500 / resistance * 1e6, 1e-6)


@case("tube, Blasius: flow at 10 kPa, mL/s")
def blasius() -> Comparison:
    resistance = 128 * AIR * TUBE_LENGTH / (np.pi * TUBE_DIAMETER**4)
    flow, rho = steady_flow(10e3, tube_resistance=resistance, turbulence=1)
    # 0.3164 Re^-1/4 (L/D) rho u^2 / 2 = dp, solved for u
    factor = 0.3164 * (AIR / (rho * TUBE_DIAMETER)) ** 0.25 * TUBE_LENGTH / TUBE_DIAMETER
    speed = (2 * 10e3 / (factor * rho)) ** (1 / 1.75)
    assert rho * speed * TUBE_DIAMETER / AIR > 4000
    return Comparison(flow * 1e6, speed * TUBE_AREA * 1e6, 1e-5)


@case("tube, laminar with minor losses: flow at 1 kPa, mL/s")
def minor_losses() -> Comparison:
    resistance = 128 * AIR * TUBE_LENGTH / (np.pi * TUBE_DIAMETER**4)
    flow, rho = steady_flow(1e3, tube_resistance=resistance, minor_loss=20.0)
    loss = 20 * rho / (2 * TUBE_AREA**2)
    theory = (np.sqrt(resistance**2 + 4 * loss * 1e3) - resistance) / (2 * loss)
    return Comparison(flow * 1e6, theory * 1e6, 1e-5)


def valve_flow(pressure: float, critical_ratio: float) -> float:
    """Flow out of a vast volume, mol/s."""
    plant = held(pressure, valve_critical_ratio=critical_ratio)
    plant.set_fixture(Fixture.PLUGGED)
    before = plant.truth()
    plant.run(100, valve_open=True)
    return (plant.truth().moles_out - before.moles_out) / 0.1


SONIC_MOLES = 2e-9 * 100e3 / (GAS_CONSTANT * 293.15) * np.sqrt(293.15 / TEMPERATURE)
"""mol/s per Pa of upstream pressure."""


@case("valve, ISO 6358: sonic flow at 90 kPa, mol/s")
def choked() -> Comparison:
    return Comparison(valve_flow(90e3, 0.6), SONIC_MOLES * (AMBIENT + 90e3), 1e-5)


@case("valve, ISO 6358: subsonic flow at 10 kPa, mol/s")
def subsonic() -> Comparison:
    ratio = AMBIENT / (AMBIENT + 10e3)
    phi = np.sqrt(1 - ((ratio - 0.3) / 0.7) ** 2)
    return Comparison(valve_flow(10e3, 0.3), SONIC_MOLES * (AMBIENT + 10e3) * phi, 1e-5)


@case("valve, ISO 6358: flow into a vessel cooled by expansion, mol/s")
def drawn_in() -> Comparison:
    plant = plugged(
        dead_volume=VAST,
        syringe_volume=VAST,
        start_volume=VAST / 2,
        volume_per_step=1.0,
        heat_exchange_time=NEVER,
    )
    plant.do_step(0.0, 1e-3, pulses=-0.1 * VAST)
    start = plant.truth()
    assert start.temperature < TEMPERATURE - 5
    plant.run(100, valve_open=True)
    # upstream is the air of the room, whatever the vessel's temperature
    ratio = (AMBIENT + start.gauge_pressure) / AMBIENT
    phi = np.sqrt(1 - ((ratio - 0.3) / 0.7) ** 2)
    return Comparison(-plant.truth().moles_out / 0.1, SONIC_MOLES * AMBIENT * phi, 1e-5)


@case("adiabatic emptying to ambient, temperature fall, K")
def emptying() -> Comparison:
    plant = plugged(heat_exchange_time=1e-4)
    push(plant, 6e-6, 1_000)
    plant.run(1_000)
    high = AMBIENT + plant.truth().gauge_pressure
    state = plant.save()
    adiabatic = plugged(heat_exchange_time=NEVER)
    adiabatic.restore(state)
    adiabatic.run(2_000, valve_open=True)
    theory = TEMPERATURE * ((AMBIENT / high) ** (1 - 1 / GAMMA) - 1)
    return Comparison(adiabatic.truth().temperature - TEMPERATURE, theory, 2e-3)


@case("leak: decay of pressure in 0.5 s, share left")
def leak() -> Comparison:
    conductance = 1e-9
    plant = make(leak_conductance=conductance, heat_exchange_time=1e-4, tube_resistance=1e5)
    push(plant, 0.7e-6, 1_000)
    plant.run(200)
    before = plant.truth().gauge_pressure
    for _ in range(5_000):
        plant.do_step(plant.truth().time, 1e-4)
    volume = SYRINGE + DEAD_AND_TUBE + CAVITY - plant.truth().pushed_volume
    theory = np.exp(-conductance * AMBIENT / volume * 0.5)
    return Comparison(plant.truth().gauge_pressure / before, theory, 1e-3)


def busy_day() -> Plant:
    """Everything that moves gas, work and heat, one after the other."""
    plant = make(tables=yielding(), leak_conductance=1e-10, turbulence=1, minor_loss=1.5)
    for direction in (1, -1, 1):
        push(plant, direction * 5e-6, 1_000)
    plant.run(100, valve_open=True)
    plant.set_faults(Faults(tube_off=True))
    push(plant, -2e-6, 500)
    plant.set_faults(Faults())
    plant.run(100)
    return plant


@case("mass balance of gas, mol")
def mass_balance() -> Comparison:
    volume = SYRINGE + DEAD_AND_TUBE + CAVITY
    start = AMBIENT * volume / (GAS_CONSTANT * TEMPERATURE)
    truth = busy_day().truth()
    assert abs(truth.moles_out) > 1e-3 * start
    return Comparison(truth.gas_moles + truth.moles_out, start, 1e-12)


@case("energy balance of gas, J")
def energy_balance() -> Comparison:
    start = AMBIENT * (SYRINGE + DEAD_AND_TUBE + CAVITY) / (GAMMA - 1)
    truth = busy_day().truth()
    assert min(abs(truth.work), abs(truth.heat), abs(truth.enthalpy_out)) > 1e-4 * start
    return Comparison(truth.energy, start + truth.work + truth.heat - truth.enthalpy_out, 1e-12)


@case("work of an isothermal compression, J")
def isothermal_work() -> Comparison:
    plant = plugged(heat_exchange_time=1e-4)
    push(plant, 7e-6, 10_000)
    volume = SYRINGE + DEAD_AND_TUBE
    theory = AMBIENT * volume * np.log(volume / (volume - plant.truth().pushed_volume))
    return Comparison(plant.truth().work, theory, 1e-4)


# drive


@case("backlash: lost at a reversal, mm3")
def backlash() -> Comparison:
    plant = make(backlash_volume=11e-9)
    push(plant, 2e-6, 1_000)
    forward = plant.truth().pushed_volume
    push(plant, -1.05e-6, 1_000)
    lost = 3_000 * STEP_VOLUME - (forward - plant.truth().pushed_volume)
    return Comparison(lost * 1e9, 11.0, 1e-9)


RUBBED = {
    "breakaway_force": 8.0,
    "sliding_force": 5.0,
    "rod_compliance": 1e-6,
    "plunger_area": AREA,
}


@case("friction and rod: lost at a reversal without pressure, mm3")
def rod_wind_up() -> Comparison:
    plant = make(dead_volume=VAST, **RUBBED)
    plant.run(2_000, steps=2)
    forward = plant.truth().pushed_volume
    plant.run(1_000, steps=-2)
    lost = 2_000 * STEP_VOLUME - (forward - plant.truth().pushed_volume)
    # the seal trails the nut by compliance times friction, first behind, then before it
    return Comparison(lost * 1e9, 2 * 5.0 * 1e-6 * AREA * 1e9, 1e-3)


@case("friction and rod: travel before the seal breaks away, mm3")
def breakaway() -> Comparison:
    fine = 1e-12
    plant = make(dead_volume=VAST, volume_per_step=fine, **RUBBED)
    pulses = 0
    while plant.truth().pushed_volume == 0.0:
        plant.run(1, steps=1)
        pulses += 1
    return Comparison(pulses * fine * 1e9, 8.0 * 1e-6 * AREA * 1e9, 1e-3)


@case("viscous friction: lag at 7 mL/s, mm3")
def viscous_lag() -> Comparison:
    plant = make(dead_volume=VAST, viscous_friction=100.0, **RUBBED)
    plant.run(1_000, steps=20)
    lag = 20_000 * STEP_VOLUME - plant.truth().pushed_volume
    speed = 20e3 * STEP_VOLUME / AREA
    return Comparison(lag * 1e9, (5.0 + 100 * speed) * 1e-6 * AREA * 1e9, 1e-2)


def leans(pushed: float) -> tuple[bool, float]:
    """Whether pressure takes the seal along when the nut goes back, and the pressure, Pa."""
    plant = plugged(
        breakaway_force=4.0,
        sliding_force=2.0,
        plunger_area=AREA,
        backlash_volume=0.2e-6,
        heat_exchange_time=1e-4,
    )
    plant.run(1_000, steps=round(pushed / STEP_VOLUME / 1_000))
    plant.run(5)
    there = plant.truth()
    plant.run(100, steps=-1)
    return plant.truth().pushed_volume < there.pushed_volume, there.gauge_pressure


@case("pressure from which a plunger leans on the nut behind it, kPa")
def leaning() -> Comparison:
    # 4 N on the seal's area; pushes of 1000 times 10, 11, ... pulses
    found = next(p for p in (leans(1e-6 * 0.35 * n) for n in range(1, 40)) if p[0])
    return Comparison(found[1] / 1e3, 4.0 / AREA / 1e3, 0.1)


TORQUE = {
    "holding_torque": 0.02,
    "corner_rate": 9_600.0,
    "start_rate": 4_800.0,
    "pulses_per_cycle": 64.0,
    "torque_per_force": 1e-3,
    "plunger_area": AREA,
}


@case("pressure at which the motor stalls at 10 kHz, kPa")
def stalling() -> Comparison:
    plant = plugged(heat_exchange_time=1e-4, **TORQUE)
    while plant.truth().missed_pulses == 0:
        plant.run(1, steps=10)
    torque = 0.02 / np.sqrt(1 + (10e3 / 9_600) ** 2)
    return Comparison(plant.truth().gauge_pressure / 1e3, torque / 1e-3 / AREA / 1e3, 2e-3)


@case("pulses lost by a stall, as electrical cycles of 64")
def lost_cycles() -> Comparison:
    plant = plugged(heat_exchange_time=1e-4, **TORQUE)
    while plant.truth().missed_pulses == 0:
        plant.run(1, steps=10)
    pulses = round(plant.truth().pushed_volume / STEP_VOLUME)
    plant.run(50, steps=10)
    pulses += 510
    plant.run(200, steps=-1)  # back, slowly enough to start
    pulses -= 200
    lost = pulses - plant.truth().pushed_volume / STEP_VOLUME
    # 510 pulses were not followed
    return Comparison(lost / 64, round(510 / 64), 1e-9)


# wall


def shape_over_pressure(plant: Plant) -> float:
    """How far the shape has come, as share of the pressure's."""
    truth = plant.truth()
    return truth.shape_pressure / truth.actuator_pressure


@case("creep, three Prony terms: shape after 2 s, share")
def creep() -> Comparison:
    terms = ((0.1, 0.5), (0.05, 4.0), (0.08, 60.0))
    plant = held(
        8e3,
        response_time=0.0,
        creep_share=[share for share, _ in terms],
        creep_time=[time for _, time in terms],
    )
    plant.run(2_000)
    theory = 1 - sum(share * np.exp(-2.0 / time) for share, time in terms)
    return Comparison(shape_over_pressure(plant), theory, 1e-3)


@case("creep and recovery: shape left 4 s after 8 s of load, share")
def recovery() -> Comparison:
    plant = held(8e3, response_time=0.0, creep_share=[0.2], creep_time=[4.0])
    plant.run(8_000)
    set_vast_pressure(plant, 0.0)
    plant.run(4_000)
    theory = 0.2 * (1 - np.exp(-2.0)) * np.exp(-1.0)
    return Comparison(plant.truth().shape_pressure / 8e3, theory, 5e-3)


@case("relaxation at a held shape after 1 s, share of the first pressure")
def relaxation() -> Comparison:
    share, time = 0.3, 2.0
    nearly_stiff = WET | {"entrained_air": 1e-4}
    plant = make(
        tables=yielding(),
        response_time=0.0,
        creep_share=[share],
        creep_time=[time],
        tube_resistance=1e7,
        **nearly_stiff,
    )
    push(plant, 1.05e-6, 100)
    plant.run(100)
    start = plant.truth()
    plant.run(1_000)
    end = plant.truth()
    # held from t0: p = s + (p0 - s) exp(-t / ((1 - g) tau)), as c goes to s
    left = (start.gauge_pressure - start.shape_pressure) * np.exp(-1.0 / ((1 - share) * time))
    theory = (start.shape_pressure + left) / start.gauge_pressure
    return Comparison(end.gauge_pressure / start.gauge_pressure, theory, 2e-3)


@case("hysteresis: shape on the way back at half pressure, over that on the way up")
def hysteresis() -> Comparison:
    radii, share = np.array([500.0, 1500.0, 3000.0]), 0.06
    plant = held(0.0, response_time=0.0, play_share=share)
    load(plant, 4e3)
    up = plant.truth().shape_pressure
    load(plant, 8e3, 4e3)
    played_up = np.maximum(4e3 - radii, 0)
    played_down = np.minimum(8e3 - radii, 4e3 + radii)
    theory = ((1 - share) * 4e3 + share * played_down.mean()) / (
        (1 - share) * 4e3 + share * played_up.mean()
    )
    return Comparison(plant.truth().shape_pressure / up, theory, 1e-6)


def softened(pressure: float, depth: float, width: float, highest: float) -> float:
    """The virgin pressure of Ogden and Roxburgh's wall at `pressure`, by bisection."""

    def missing(w: float) -> float:
        eta = 1 - depth * erf((1 - (w / highest) ** 2) / width)
        return float(w * eta - pressure)

    return float(brentq(missing, 0.0, highest, xtol=1e-9))


@case("Mullins: shape at 4 kPa on the way back from 8 kPa, over that of the virgin wall")
def mullins() -> Comparison:
    plant = held(0.0, response_time=0.0, mullins_share=0.2, mullins_width=0.6)
    load(plant, 8e3, 4e3)
    theory = softened(4e3, 0.2, 0.6, 8e3) / 4e3
    return Comparison(shape_over_pressure(plant), theory, 1e-6)


RADIUS = 300.0
"""Pa; of the first play operator, within which ups and downs are no load cycles."""


def cycles_of(*pressures: float) -> float:
    """Load cycles of 12 kPa that a wall counts which goes from 0 to one pressure after another."""
    play = path = 0.0
    for pressure in pressures:
        moved = min(max(play, pressure - RADIUS), pressure + RADIUS)
        path += abs(moved - play)
        play = moved
    return path / 24e3


@case("Mullins: shape at 2 kPa after 3 load cycles, over that of the virgin wall")
def mullins_cycles() -> Comparison:
    cycles_to_63 = 2.0
    plant = held(
        0.0,
        response_time=0.0,
        mullins_share=0.2,
        mullins_width=0.6,
        mullins_cycles=cycles_to_63,
        play_radius=[RADIUS, 0.0, 0.0],
    )
    pressures = (12e3, 0.0, 12e3, 0.0, 12e3, 0.0, 2e3)
    load(plant, *pressures)
    depth = 0.2 * (1 - np.exp(-cycles_of(*pressures) / cycles_to_63))
    theory = softened(2e3, depth, 0.6, 12e3) / 2e3
    return Comparison(shape_over_pressure(plant), theory, 1e-6)


@case("ageing by 3 % a decade: shape after 9 load cycles, over that of the new wall")
def ageing() -> Comparison:
    plant = held(0.0, response_time=0.0, ageing=0.03, play_radius=[RADIUS, 0.0, 0.0])
    pressures = (12e3, 0.0) * 9 + (4e3,)
    load(plant, *pressures)
    theory = 1 + 0.03 * np.log10(1 + cycles_of(*pressures))
    return Comparison(shape_over_pressure(plant), theory, 1e-6)


FREQUENCY, DAMPING = 10.0, 0.3
OMEGA = 2 * np.pi * FREQUENCY
BENDING = {"shape_inertia": 1 / OMEGA**2, "response_time": 2 * DAMPING / OMEGA}


@case("bending after a step of pressure: overshoot, %")
def overshoot() -> Comparison:
    plant = held(5e3, **BENDING)
    highest = 0.0
    for _ in range(100):
        plant.run(1)
        highest = max(highest, shape_over_pressure(plant))
    theory = 100 * np.exp(-np.pi * DAMPING / np.sqrt(1 - DAMPING**2))
    return Comparison(100 * (highest - 1), theory, 1e-2)


@case("bending of a closed actuator: frequency, Hz")
def closed_frequency() -> Comparison:
    plant = make(
        tables=yielding(),
        heat_exchange_time=NEVER,
        shape_inertia=1 / OMEGA**2,
        response_time=0.0,
        tube_resistance=1e3,
    )
    push(plant, 0.35e-6, 10)
    plant.set_faults(Faults(tube_blocked=True))
    middle, step, times = plant.truth().shape_pressure, 2e-4, []
    # the gas shuttles between wall and volume for ever: mean first, then crossings of it
    state = plant.save()
    samples = [shape_after(plant, step) for _ in range(2_000)]
    middle = 0.5 * (max(samples) + min(samples))
    plant.restore(state)
    previous = middle
    for k in range(2_000):
        now = shape_after(plant, step)
        if previous < middle <= now:
            times.append(step * (k + (middle - previous) / (now - previous)))
        previous = now
    volume = plant.truth().actuator_volume
    pressure = AMBIENT + plant.truth().actuator_pressure
    theory = FREQUENCY * np.sqrt(1 + GAMMA * pressure * COMPLIANCE / volume)
    return Comparison((len(times) - 1) / (times[-1] - times[0]), theory, 5e-3)


def shape_after(plant: Plant, step: float) -> float:
    """The shape after one more step."""
    plant.do_step(plant.truth().time, step)
    return plant.truth().shape_pressure


# liquid


@case("liquid with bubbles: pressure after a push of 0.105 mL, kPa")
def bubbles() -> Comparison:
    plant = plugged(**WET)
    push(plant, 0.105e-6, 100)
    volume = SYRINGE + DEAD_AND_TUBE
    left = volume - plant.truth().pushed_volume

    def missing(p: float) -> float:
        liquid = volume * 0.995 * (1 - (p - AMBIENT) / 2.18e9)
        return liquid + volume * 0.005 * AMBIENT / p - left

    theory = brentq(missing, AMBIENT, 1e7, xtol=1e-6) - AMBIENT
    return Comparison(plant.truth().gauge_pressure / 1e3, theory / 1e3, 1e-9)


@case("air going into solution: share left to go after one time constant")
def dissolution() -> Comparison:
    # so little liquid that the pressure stays
    plant = plugged(**(WET | {"entrained_air": 0.9999, "dissolution_time": 0.5}))
    push(plant, 7e-6, 2)
    start = plant.truth()
    plant.run(500)
    end = plant.truth()
    # the actuator's share stays in equilibrium at ambient pressure
    moles = 0.02 * 1e-4 / (GAS_CONSTANT * TEMPERATURE)
    goal = moles * ((SYRINGE + DEAD_AND_TUBE) * (AMBIENT + end.gauge_pressure) + CAVITY * AMBIENT)
    left = (goal - end.dissolved_moles) / (goal - start.dissolved_moles)
    return Comparison(left, np.exp(-1.0), 1e-4)


@case("air gone into solution in the end: pressure, kPa")
def henry() -> Comparison:
    plant = plugged(**(WET | {"dissolution_time": 0.2}))
    push(plant, 0.105e-6, 100)
    plant.run(10_000)
    volume = SYRINGE + DEAD_AND_TUBE
    left = volume - plant.truth().pushed_volume
    liquid, air = 0.995 * volume, (0.005 + 0.02 * 0.995) * volume * AMBIENT

    def missing(p: float) -> float:
        bubbles = (air - 0.02 * liquid * p) / p
        return liquid * (1 - (p - AMBIENT) / 2.18e9) + bubbles - left

    theory = brentq(missing, AMBIENT, 1e6, xtol=1e-6) - AMBIENT
    return Comparison(plant.truth().gauge_pressure / 1e3, theory / 1e3, 1e-6)


@case("mass balance of liquid, mL")
def liquid_balance() -> Comparison:
    plant = make(tables=yielding(), **(WET | {"dissolution_time": 0.5}))
    for direction in (1, -1, 1):
        push(plant, direction * 2.1e-6, 1_000)
    return Comparison(
        plant.truth().liquid_volume * 1e6, 0.995 * (SYRINGE + DEAD_AND_TUBE + CAVITY) * 1e6, 1e-12
    )


@case("mass balance of air in a liquid, mol")
def air_in_liquid_balance() -> Comparison:
    plant = make(tables=yielding(), **(WET | {"dissolution_time": 0.5}))
    for direction in (1, -1, 1):
        push(plant, direction * 2.1e-6, 1_000)
    volume = SYRINGE + DEAD_AND_TUBE + CAVITY
    share = 0.005 + 0.02 * 0.995
    start = share * volume * AMBIENT / (GAS_CONSTANT * TEMPERATURE)
    return Comparison(plant.truth().gas_moles, start, 1e-12)


@case("water in the tube: the actuator's pressure 0.3 s after a step, share")
def water_column() -> Comparison:
    resistance = 128 * WATER * TUBE_LENGTH / (np.pi * TUBE_DIAMETER**4)
    length_over_area = TUBE_LENGTH / TUBE_AREA
    plant = make(
        tables=yielding(),
        dead_volume=VAST,
        syringe_volume=VAST,
        volume_per_step=1.0,
        response_time=0.0,
        tube_resistance=resistance,
        tube_length_over_area=length_over_area,
        **WET,
    )
    plant.do_step(0.0, 1e-6, pulses=1e-2)
    plant.run(300)
    inertance = 998.2 * length_over_area
    damping = resistance / (2 * inertance)
    omega = np.sqrt(1 / (inertance * COMPLIANCE) - damping**2)
    swing = np.cos(0.3 * omega) + damping / omega * np.sin(0.3 * omega)
    truth = plant.truth()
    theory = 1 - np.exp(-0.3 * damping) * swing
    return Comparison(truth.actuator_pressure / truth.gauge_pressure, theory, 1e-2)
