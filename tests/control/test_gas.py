"""The gas filter on lines that obey its model, and the tests that decide on a leak."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from rig.control.errors import ControlError
from rig.control.gas import STATES, ActuatorVolume, GasFilter, GasLine, Innovation, V
from rig.control.gas_monitor import GasAlarm, GasMonitor
from rig.control.sequential import LeakTest, LossTest, loss_threshold, page_threshold

AMBIENT = 101_325.0
LINE = GasLine(AMBIENT, 63e-6)
ACTUATOR = ActuatorVolume(13e-6, 0.4e-6, 0.3e-9, 0.1e-9, 0.01e-9, 0.01e-9)
DT = 0.2
Array = NDArray[np.float64]


def boyle(plunger: Array | float, volume: float) -> Array:
    """Gauge pressure of an isothermal rigid line that was closed at ambient, in Pa."""
    return AMBIENT * (volume / (volume - np.asarray(plunger)) - 1)


def simulated(
    seed: int,
    leak: Callable[[float], float],
    samples: int = 400,
    actuator: ActuatorVolume = ACTUATOR,
    line: GasLine = LINE,
) -> tuple[list[tuple[float, float]], float, float]:
    """A line drawn from the filter's own prior and noises: samples, gas and actuator's volume.

    Integrated finely, so that it is the model's differential equations and not the filter's steps.
    """
    rng = np.random.default_rng(seed)
    v = actuator.volume + actuator.u_volume * rng.normal()
    c = actuator.compliance + actuator.u_compliance * rng.normal()
    m = actuator.creep + actuator.u_creep * rng.normal()
    gas, w, p = line.line_volume + v, 0.0, 0.0
    readings = [(0.0, line.pressure_noise * rng.normal())]
    fine = 20
    for k in range(1, samples + 1):
        # slow enough that heat, which has a test of its own, does not matter
        for i in range(fine):
            t = (k - 1 + (i + 1) / fine) * DT
            plunger = 11e-6 * min(t / 40, 1.0)
            h = DT / fine
            gas -= leak(t) * p * h
            w += (m * p - w) * h / line.creep_time
            space = line.line_volume - plunger + v + w
            b = space + c * AMBIENT
            p = (-b + math.sqrt(b * b + 4 * c * AMBIENT * (gas - space))) / (2 * c)
        stroke = plunger - readings[-1][0]
        walk = line.volume_walk**2 * DT + line.stroke_error**2 * stroke / 1e-6
        v += math.sqrt(walk) * rng.normal()
        readings.append((plunger, p + line.pressure_noise * rng.normal()))
    return readings, gas, v + c * p + w


def filtered(readings: list[tuple[float, float]], sound: float = 0.0) -> tuple[GasFilter, Array]:
    line = GasLine(AMBIENT, LINE.line_volume, heat_time=1e-12)
    kalman = GasFilter(line, ACTUATOR, sound)
    kalman.close(*readings[0])
    return kalman, np.array([kalman.step(DT, *reading).nis for reading in readings[1:]])


def test_a_rigid_line_follows_boyle() -> None:
    """Without compliance, creep and heat the filter's prediction is Boyle's law to round-off."""
    rigid = ActuatorVolume(13e-6, 1e-12, 1e-20, 1e-22, 0.0, 0.0)
    kalman = GasFilter(GasLine(AMBIENT, 63e-6, heat_time=1e-12), rigid)
    kalman.close(0.0, 0.0)
    for plunger in np.linspace(0.5e-6, 10e-6, 20):
        found = kalman.step(DT, float(plunger), float(boyle(plunger, 76e-6)))
        assert abs(found.value) < 1e-6 * boyle(plunger, 76e-6)


def test_fast_compression_is_adiabatic() -> None:
    """Without time to cool the pressure rises as V^-gamma, to first order in the stroke."""
    rigid = ActuatorVolume(13e-6, 1e-12, 1e-20, 1e-22, 0.0, 0.0)
    kalman = GasFilter(GasLine(AMBIENT, 63e-6, heat_time=1e6, heat_error=1e-9), rigid)
    kalman.close(0.0, 0.0)
    stroke = 0.2e-6
    adiabatic = AMBIENT * ((76e-6 / (76e-6 - stroke)) ** 1.4 - 1)
    assert kalman.step(DT, stroke, adiabatic).value == pytest.approx(0, abs=0.005 * adiabatic)


def test_the_filter_is_consistent_with_its_model() -> None:
    """Mean NIS and the squared errors of gas and volume lie in their 99.8 % chi-square ranges."""
    runs, squares, nis = 25, [], []
    for seed in range(runs):
        readings, gas, volume = simulated(seed, lambda _: 0.0)
        kalman, run_nis = filtered(readings)
        nis.append(run_nis[1:])
        estimate = kalman.estimate
        assert estimate.leak is not None
        squares.append(
            [
                ((estimate.quantity - gas) / estimate.u_quantity) ** 2,
                ((estimate.actuator_volume - volume) / estimate.u_actuator_volume) ** 2,
                (estimate.leak.conductance / estimate.leak.u) ** 2,
            ]
        )
    count = sum(part.size for part in nis)
    low, high = chi2.ppf([0.001, 0.999], count) / count
    assert low < np.concatenate(nis).mean() < high
    low, high = chi2.ppf([0.001, 0.999], runs)
    for errors in np.array(squares).T:
        assert low < errors.sum() < high


def test_a_sound_leak_is_estimated_within_its_uncertainty() -> None:
    true, errors = 0.5e-12, []
    for seed in range(15):
        kalman, _ = filtered(simulated(seed, lambda _: true)[0])
        leak = kalman.leak
        assert leak is not None
        assert leak.u < 0.2 * true
        errors.append((leak.conductance - true) / leak.u)
    low, high = chi2.ppf([0.001, 0.999], len(errors))
    assert low < np.sum(np.square(errors)) < high


def test_the_signature_is_what_a_leak_does_to_the_innovations() -> None:
    """Against two filters that hold slightly different leaks; the volume is well known, as the
    signature is linear."""
    step = 1e-15
    known = ActuatorVolume(13e-6, 1e-8, 0.3e-9, 1e-12, 0.01e-9, 1e-12)
    quiet = replace(LINE, heat_time=1e-12, volume_walk=1e-10, stroke_error=1e-10)
    readings, _, _ = simulated(1, lambda _: 0.0, actuator=known, line=quiet)

    def innovations(held: float) -> list[Innovation]:
        kalman = GasFilter(quiet, known, held)
        kalman.close(*readings[0])
        return [kalman.step(DT, *reading) for reading in readings[1:]]

    for below, at, above in zip(*(innovations(g) for g in (-step, 0.0, step)), strict=True):
        difference = (below.value - above.value) / (2 * step)
        assert at.signature == pytest.approx(difference, rel=0.02, abs=1e9)


def test_backlash_is_no_stroke() -> None:
    slack = 0.01e-6
    kalman = GasFilter(GasLine(AMBIENT, 63e-6, backlash=slack), ACTUATOR)
    kalman.close(5e-6, 0.0)
    before = kalman.step(DT, 5e-6, 0.0).value
    assert kalman.step(DT, 5e-6 - slack, 0.0).value == pytest.approx(before, abs=0.05)


@pytest.mark.parametrize(("jump", "alarms"), [(1.0, False), (8.0, True)])
def test_a_plunger_that_slips_through_its_play_has_lost_no_gas(jump: float, alarms: bool) -> None:
    """The motor has gone back by a play, the seal has stuck; once it lets go, gas pushes the
    plunger after the motor. So large a loss would be told, had the play been closed."""
    slack, quiet = 11e-9, replace(LINE, heat_time=1e-12, pressure_noise=1.0)
    readings, _, _ = simulated(2, lambda _: 0.0, line=quiet)
    monitor = GasMonitor(replace(quiet, backlash=slack), ACTUATOR, 8e-6)
    monitor.close(*readings[0])
    plunger, pressure = readings[-1]
    lost = jump * slack * (AMBIENT + pressure) / 65e-6
    after = [(plunger - slack, pressure)] * 10 + [(plunger - slack, pressure - lost)] * 20
    for reading in readings[1:] + after:
        monitor.step(DT, *reading)
    assert (monitor.open() is not None) == alarms


def test_a_closed_play_hides_nothing() -> None:
    slack = 11e-9
    kalman = GasFilter(replace(LINE, backlash=slack), ACTUATOR)
    kalman.close(5e-6, 0.0)
    sure = kalman.step(DT, 5e-6, 0.0).variance
    pulled = kalman.step(DT, 5e-6 - slack, 0.0).variance
    space = LINE.line_volume - 5e-6 + ACTUATOR.volume + ACTUATOR.compliance * AMBIENT
    assert pulled == pytest.approx(sure + (0.5 * slack * AMBIENT / space) ** 2, rel=0.02)
    kalman.step(DT, 5e-6, 0.0)
    assert kalman.step(DT, 5e-6, 0.0).variance < pulled


def test_what_a_closing_taught_of_the_volume_is_kept() -> None:
    kalman, _ = filtered(simulated(3, lambda _: 0.0)[0])
    u = math.sqrt(kalman.covariance[V, V])
    volume = kalman.state[V]
    kalman.open()
    kalman.close(0.0, 0.0)
    assert kalman.state[V] == pytest.approx(volume)
    assert math.sqrt(kalman.covariance[V, V]) == pytest.approx(u)
    assert kalman.state.shape == (STATES,)


def test_a_line_without_room_is_refused() -> None:
    with pytest.raises(ControlError, match="no room for gas"):
        GasFilter(GasLine(AMBIENT, 10e-6), ACTUATOR).close(30e-6, 0.0)


def test_the_threshold_is_that_of_the_martingale() -> None:
    assert page_threshold(0.01, 18_000, 3) == pytest.approx(math.log(5.4e6))
    with pytest.raises(ControlError, match="between 0 and 1"):
        page_threshold(1.0, 10, 1)


def test_false_alarms_are_as_rare_as_promised() -> None:
    """White innovations with a signature: the share of runs with an alarm is below the bound."""
    rng = np.random.default_rng(0)
    samples, runs, alpha = 100, 400, 0.2
    alarms = 0
    for _ in range(runs):
        test = LeakTest(0.0, (1.0, 3.0), page_threshold(alpha, samples, 2))
        values = rng.normal(size=samples)
        alarms += any(test.add(Innovation(float(v), 1.0, -0.5), DT) is not None for v in values)
    assert alarms / runs < alpha
    lost = LossTest(0.0, 5, loss_threshold(alpha, samples, 5))
    assert not any(lost.add(Innovation(1e3, 1.0, 0.0)) for _ in range(5)), "gas was gained"
    assert lost.add(Innovation(-1e4, 1.0, 0.0))


def test_a_leak_that_begins_is_decided_and_dated() -> None:
    true, begins_s = 8e-12, 60.0
    readings, _, _ = simulated(5, lambda t: true if t >= begins_s else 0.0, samples=500)
    monitor = GasMonitor(GasLine(AMBIENT, LINE.line_volume, heat_time=1e-12), ACTUATOR, 8e-6)
    monitor.close(*readings[0])
    alarms: list[tuple[float, GasAlarm]] = []
    for k, reading in enumerate(readings[1:], start=1):
        alarm = monitor.step(DT, *reading)[1]
        if alarm is not None:
            alarms.append((k * DT, alarm))
    (told_s, alarm), leak = alarms[0], monitor.estimate.leak
    assert len(alarms) == 1
    assert alarm.kind == "leak"
    assert begins_s < told_s < begins_s + 5
    assert told_s - alarm.since_s == pytest.approx(begins_s, abs=1.5)
    assert leak is not None
    assert abs(leak.conductance - true) < 3 * leak.u < 0.2 * true
    assert monitor.open() is None


def test_a_burst_is_told_when_the_valve_opens_on_it() -> None:
    readings, _, _ = simulated(6, lambda _: 0.0)
    monitor = GasMonitor(GasLine(AMBIENT, LINE.line_volume, heat_time=1e-12), ACTUATOR, 8e-6)
    monitor.close(*readings[0])
    assert all(monitor.step(DT, *reading)[1] is None for reading in readings[1:])
    for share in (0.3, 0.1, 0.03):
        told = monitor.step(DT, readings[-1][0], share * readings[-1][1])[1]
        if told is not None:
            break
    alarm = told or monitor.open()
    assert alarm is not None
    assert alarm.kind == "burst"
