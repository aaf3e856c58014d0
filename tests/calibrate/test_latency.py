"""A delay recovered from swings made of formulas."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from rig.calibrate.errors import CalibrateError
from rig.calibrate.latency import Array, Lag, Swing, fit_latency, tube_lag
from rig.spec.calibration import Provenance
from rig.spec.workspace import Workspace

PROVENANCE = Provenance(date=date(2025, 1, 1), method="swing", instrument="formulas")
KNOWN = (Lag("damping", 0.015, 0.012), Lag("tube", 0.005, 0.0))
CORNERS_S = np.array([0, 4, 8, 9, 10, 14, 18, 19, 20.0])
CORNERS_KPA = np.array([2, 8, 2, 8, 2, 8, 2, 8, 2.0])


def swing(delay_s: float, loop_kpa: float = 0.0, noise_deg: float = 0.0) -> Swing:
    """Angles 1 + 6 p + p^2 / 4 of pressures on straight lines, `loop_kpa` behind each way."""
    rng = np.random.default_rng(3)
    pressure_s = np.arange(0, 20, 0.02)
    shown_s = np.sort(rng.uniform(0.1, 19.9, 400))

    def pressure(time_s: Array) -> Array:
        return np.interp(time_s, CORNERS_S, CORNERS_KPA)

    way = np.sign(pressure(shown_s + 1e-3) - pressure(shown_s))
    felt = pressure(shown_s) - loop_kpa * way
    angle = 1 + 6 * felt + felt**2 / 4 + 0.01 * shown_s + rng.normal(0, noise_deg, 400)
    pressed = pressure(pressure_s)
    return Swing(shown_s + delay_s, angle, pressure_s, pressed, pressed)


@pytest.mark.parametrize("delay_s", [0.0, 0.08, 0.4])
def test_a_delay_is_found_whatever_it_is(delay_s: float) -> None:
    fit = fit_latency(swing(delay_s), KNOWN)
    assert fit.fit["delay"] == pytest.approx(delay_s, abs=1e-5)
    assert fit.value_s == pytest.approx(delay_s - 0.02, abs=1e-5)


def test_hysteresis_is_no_delay() -> None:
    plain, wide = (fit_latency(swing(0.08, loop), KNOWN).fit for loop in (0.0, 0.05))
    assert wide["delay"] == pytest.approx(plain["delay"], abs=1e-3)
    assert wide["loop"] < -0.3 < plain["loop"]


def test_noise_and_the_lag_of_the_actuator_make_the_uncertainty() -> None:
    exact, noisy = (fit_latency(swing(0.08, 0.02, sd), KNOWN) for sd in (0.0, 0.3))
    own = noisy.fit.u({"delay": 1.0})
    assert 5e-4 < own < 5e-3
    assert abs(noisy.fit["delay"] - 0.08) < 2 * own
    assert noisy.u_s == pytest.approx(np.hypot(own, 0.012))
    assert exact.u_s == pytest.approx(0.012, abs=1e-4)


def test_an_actuator_that_does_not_hang_there_tells_no_latency() -> None:
    seen = swing(0.08)
    other = replace(seen, angle_deg=np.full_like(seen.angle_deg, 30))
    with pytest.raises(CalibrateError):
        fit_latency(other, KNOWN)


@pytest.mark.parametrize("delay_s", [0.0, 0.08])
def test_a_latency_is_never_below_nothing(delay_s: float) -> None:
    kept = fit_latency(swing(delay_s), KNOWN).latency(PROVENANCE)
    assert kept.value == pytest.approx(max(0.0, delay_s - 0.02), abs=1e-5)
    assert kept.u == pytest.approx(0.012, abs=1e-4)


def test_frames_before_what_they_show_are_refused() -> None:
    slow = fit_latency(swing(0.0), (Lag("damping", 0.03, 0.012),))
    with pytest.raises(CalibrateError, match="came 30 ms before"):
        slow.latency(PROVENANCE)


def test_the_lag_of_the_tube_is_its_resistance_times_what_the_actuator_takes_up() -> None:
    """Boyle's law for a cavity of 10 mL that grows by 0.3 mL/kPa, at the other end of the tube."""
    bench = Workspace(Path(__file__).parents[2]).bench("virtual-beam")
    dead, cavity, growth = 2e-6, 10e-6, 0.3e-9
    line = bench.syringe.volume + dead + bench.tubing.volume
    ambient = bench.ambient.pressure
    seen = swing(0.08)
    gauge = 1e3 * seen.pressure_kpa
    shrunk = (ambient + gauge) / ambient
    # what is left of the line and the grown cavity hold what both held at ambient pressure
    pushed = line + cavity + growth * gauge - (line + cavity) / shrunk
    told = tube_lag(replace(seen, plunger_ml=1e6 * pushed), bench, dead)
    middle = 5e3
    taken_up = growth + (cavity + growth * middle) / (ambient + middle)
    resistance = 128 * 1.82e-5 * 0.5 / (np.pi * 2e-3**4)
    assert told.value_s == pytest.approx(resistance * taken_up, rel=0.05)
    assert 0 < told.u_s < told.value_s
