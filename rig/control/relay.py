"""Frequency response at the one frequency where a relay makes the plant oscillate.

Astrom and Hagglund, Automatica 20 (1984). The plunger is recorded as well as the pressure, so the
ratio of their first harmonics is the response itself: no describing function is assumed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.control.errors import ControlError
from rig.control.identify import Recording, play

Array = NDArray[np.float64]
LEAST_PERIODS = 3
SETTLING_PERIODS = 2
"""At the beginning, left out: the oscillation is not steady yet."""


@dataclass(frozen=True)
class FrequencyPoint:
    """Measured response at one frequency."""

    omega: float
    """rad/s."""
    response: complex
    """kPa/mL, from reported plunger position to reported pressure."""
    deviation: float
    """Standard deviation of the mean of |response| over the periods."""
    periods: int


def relay_point(recording: Recording, backlash_ml: float = 0.0) -> FrequencyPoint:
    """The response at the frequency of a relay's limit cycle, behind a known backlash.

    Raises ControlError if fewer than three whole periods are left after the first two.
    """
    recording = replace(recording, plunger_ml=play(recording.plunger_ml, backlash_ml))
    starts = _upward_crossings(recording)[SETTLING_PERIODS:]
    if starts.size < LEAST_PERIODS + 1:
        raise ControlError(
            f"the relay made {max(starts.size - 1, 0)} steady oscillations; expected at least "
            f"{LEAST_PERIODS}. Let it run longer, or give it a larger amplitude."
        )
    ratios = [_ratio(recording, begin, end) for begin, end in pairwise(starts)]
    period_s = float(starts[-1] - starts[0]) / len(ratios)
    sizes = np.abs(ratios)
    return FrequencyPoint(
        omega=2 * np.pi / period_s,
        response=complex(np.mean(ratios)),
        deviation=float(sizes.std(ddof=1) / np.sqrt(sizes.size)),
        periods=len(ratios),
    )


def _upward_crossings(recording: Recording) -> Array:
    """Times at which the plunger passes its mean inwards; it has no noise, the pressure does."""
    x = recording.plunger_ml - _trend(recording.time_s, recording.plunger_ml)
    rising = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    share = -x[rising] / (x[rising + 1] - x[rising])
    t = recording.time_s
    return np.asarray(t[rising] + share * (t[rising + 1] - t[rising]))


def _trend(time_s: Array, values: Array) -> Array:
    slope, offset = np.polyfit(time_s, values, 1)
    return np.asarray(slope * time_s + offset)


def _ratio(recording: Recording, begin_s: float, end_s: float) -> complex:
    """First harmonic of the pressure over that of the plunger, in one period."""
    grid = np.linspace(begin_s, end_s, 200, endpoint=False)
    turn = np.exp(-2j * np.pi * (grid - begin_s) / (end_s - begin_s))

    def harmonic(values: Array) -> complex:
        level = np.interp(grid, recording.time_s, values)
        # what runs away over the period (leak) would leak into the harmonic
        steady = level - np.interp(
            grid, [begin_s, end_s], np.interp([begin_s, end_s], recording.time_s, values)
        )
        return complex(np.sum(steady * turn))

    return harmonic(recording.pressure_kpa) / harmonic(recording.plunger_ml)
