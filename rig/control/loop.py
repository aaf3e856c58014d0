"""The pressure loop as the firmware closes it, linear and in discrete time, with its margins.

    e -> PI -> flow, held for a tick -> 1/s -> plant and delay -> reported pressure

Controller: q(k) = kp e(k) + I(k), I(k+1) = I(k) + ki T e(k), as rig_mega/src/core/pressure_loop.cpp
computes it. Plant: zero-order hold (python-control) of the identified response behind the
integration of flow to volume; the delay is split into whole ticks and a linear interpolation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.control.identify import LevelModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

TICK_S = 0.002
"""Of the firmware (tick.h)."""
REPORT_AHEAD_S = TICK_S
"""The plunger that is reported with a pressure is where it will be at the end of the tick."""
FILTER_TICKS = 4
"""Of the transducer's mean (transducer.h)."""
KNOWN_DELAY_S = REPORT_AHEAD_S + FILTER_TICKS * TICK_S / 2
"""From reported plunger to reported pressure, were the pneumatics at once."""
GAIN_KNOWN_TO = 10 ** (3 / 20)
"""On the nonlinear plant 2 dB were too few: it swung at four fifths of the delay they allow."""


@dataclass(frozen=True)
class Gains:
    """Of the firmware's PI controller."""

    proportional: float
    """mL/s/kPa."""
    integral: float
    """mL/s2/kPa."""


@dataclass(frozen=True)
class Margins:
    """How far a loop is from instability."""

    gain_db: float
    phase_deg: float
    delay_s: float
    """Additional delay at which the loop becomes unstable, its gain known to 3 dB: where |L| is
    flat a little gain moves the crossover far."""
    crossover: float
    """rad/s at which the loop gain is one."""
    phase_crossover: float
    """rad/s at which the loop's phase is -180 degrees; infinite if never."""
    peak_sensitivity: float
    """Largest |1/(1+L)|; the closest approach to -1 is its inverse."""

    @property
    def gain(self) -> float:
        """The gain margin as a factor."""
        return float(10 ** (self.gain_db / 20))


def controller(gains: Gains, tick_s: float = TICK_S) -> Any:
    """The PI controller as a discrete state space of `control`."""
    import control

    return control.ss(1.0, 1.0, gains.integral * tick_s, gains.proportional, tick_s)


@lru_cache(maxsize=256)
def plant(model: LevelModel, tick_s: float = TICK_S) -> Any:
    """From commanded flow in mL/s to reported pressure in kPa: a discrete state space.

    A state space, because polynomials of so many poles near one lose their digits.
    """
    import control

    integrated = model.state_space() * control.ss(0.0, 1.0, 1.0, 0.0)
    discrete = control.c2d(integrated, tick_s, "zoh")
    return _delay(max(model.delay_s - REPORT_AHEAD_S, 0.0), tick_s) * discrete


def _delay(delay_s: float, tick_s: float) -> Any:
    """A chain of ticks whose last two are interpolated between."""
    import control

    ticks = delay_s / tick_s
    whole = math.floor(ticks + 1e-9)
    share = max(ticks - whole, 0.0)
    length = whole + 1
    taps = np.zeros(length + 1)
    taps[whole : whole + 2] = 1 - share, share
    return control.ss(
        np.eye(length, k=-1), np.eye(length, 1), taps[np.newaxis, 1:], taps[0], tick_s
    )


def frequencies(tick_s: float = TICK_S, count: int = 420) -> Array:
    """Logarithmic grid in rad/s, from far below any crossover to the Nyquist frequency."""
    return np.geomspace(0.02, math.pi / tick_s, count)


@lru_cache(maxsize=256)
def plant_response(model: LevelModel, tick_s: float = TICK_S) -> Complex:
    """Frequency response of `plant` at `frequencies`."""
    return np.asarray(plant(model, tick_s)(np.exp(1j * frequencies(tick_s) * tick_s)))


def loop_response(model: LevelModel, gains: Gains, tick_s: float = TICK_S) -> Complex:
    """Frequency response of controller and plant at `frequencies`."""
    z = np.exp(1j * frequencies(tick_s) * tick_s)
    kp, ki = gains.proportional, gains.integral
    return np.asarray(plant_response(model, tick_s) * (kp + ki * tick_s / (z - 1)))


def loop(model: LevelModel, gains: Gains, tick_s: float = TICK_S) -> Any:
    """Controller and plant as a discrete state space of `control`."""
    return plant(model, tick_s) * controller(gains, tick_s)


def _delay_margin(response: Complex, omega: Array) -> float:
    """Least delay that turns the loop to -1 at any frequency where its gain may be one."""
    near = np.abs(np.log(np.abs(response))) <= math.log(GAIN_KNOWN_TO)
    lead = np.pi + np.unwrap(np.angle(response))
    return float(np.min(lead[near] / omega[near]))


def margins(model: LevelModel, gains: Gains, tick_s: float = TICK_S) -> Margins:
    """Gain, phase and delay margin of a loop that integrates, by python-control.

    A loop beyond its stability limit has negative margins.
    """
    return margins_of(loop_response(model, gains, tick_s), frequencies(tick_s))


def margins_of(response: Complex, omega: Array) -> Margins:
    """Margins of a loop with this frequency response (n,) at `omega` in rad/s."""
    import control

    data = control.frd(response, omega, smooth=True)
    gain, phase, _, phase_crossover, crossover, _ = control.stability_margins(data)
    return Margins(
        gain_db=20 * math.log10(gain),
        phase_deg=float(phase),
        delay_s=_delay_margin(response, omega),
        crossover=float(crossover),
        phase_crossover=float(phase_crossover),
        peak_sensitivity=float(np.max(1 / np.abs(1 + response))),
    )


def closed_loop(model: LevelModel, gains: Gains, tick_s: float = TICK_S) -> tuple[Any, Any]:
    """From set-point to pressure, and from a disturbing flow in mL/s to pressure in kPa."""
    import control

    process, regulator = plant(model, tick_s), controller(gains, tick_s)
    return control.feedback(process * regulator, 1), control.feedback(process, regulator)
