"""Step-response metrics from a trace: rise, settling, overshoot, steady error, noise.

Definitions follow control practice (Ogata, Modern Control Engineering, 5th ed., section 5-3);
settling is into an absolute tolerance, as the experiment itself waits for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.control.errors import ControlError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StepMetrics:
    """One step of a controlled quantity; all in the unit of the trace and in seconds."""

    initial: float
    """Value when the set-point was sent."""
    target: float
    rise_time_s: float | None
    """From 10 to 90 % of the step; None for a step within the tolerance or not completed."""
    settling_time_s: float | None
    """From the set-point until the trace stays within tolerance; None if it never does."""
    overshoot: float
    """Furthest beyond the target in the direction of the step; never negative."""
    overshoot_percent: float | None
    """In per cent of the step; None for a step within the tolerance."""
    steady_error: float
    """Mean of the steady part minus target."""
    noise: float
    """Standard deviation of the steady part."""


def step_metrics(
    time_s: Array,
    value: Array,
    target: float,
    tolerance: float,
    steady_from_s: float,
) -> StepMetrics:
    """Metrics of a trace that begins when the set-point is sent, both arrays (n,).

    The part from `steady_from_s` on is taken as steady. Times of crossings are interpolated
    linearly between samples. Raises ControlError for fewer than two samples, times that do not
    ascend, or a steady part of fewer than two samples.
    """
    if time_s.shape != value.shape or time_s.size < 2 or np.any(np.diff(time_s) <= 0):
        raise ControlError(
            f"a step needs at least two samples in ascending time; there are {time_s.size}. Look "
            f"for gaps in the pressure telemetry."
        )
    steady = value[time_s >= steady_from_s]
    if steady.size < 2:
        raise ControlError(
            f"the step has {steady.size} samples after {steady_from_s:g} s; at least two are "
            f"needed for its steady error and noise."
        )
    initial = float(value[0])
    step = target - initial
    direction = 1.0 if step >= 0 else -1.0
    overshoot = max(0.0, float(np.max(direction * (value - target))))
    is_real = abs(step) > tolerance
    return StepMetrics(
        initial=initial,
        target=target,
        rise_time_s=_rise_time(time_s, value, initial, step) if is_real else None,
        settling_time_s=_settling_time(time_s, value, target, tolerance),
        overshoot=overshoot,
        overshoot_percent=100 * overshoot / abs(step) if is_real else None,
        steady_error=float(steady.mean()) - target,
        noise=float(steady.std(ddof=1)),
    )


def _rise_time(time_s: Array, value: Array, initial: float, step: float) -> float | None:
    progress = (value - initial) / step
    times = [_first_crossing(time_s, progress, level) for level in (0.1, 0.9)]
    if times[0] is None or times[1] is None:
        return None
    return times[1] - times[0]


def _first_crossing(time_s: Array, progress: Array, level: float) -> float | None:
    above = np.flatnonzero(progress >= level)
    if above.size == 0:
        return None
    after = int(above[0])
    if after == 0:
        return float(time_s[0])
    low, high = progress[after - 1], progress[after]
    share = (level - low) / (high - low)
    return float(time_s[after - 1] + share * (time_s[after] - time_s[after - 1]))


def _settling_time(time_s: Array, value: Array, target: float, tolerance: float) -> float | None:
    excess = np.abs(value - target) - tolerance
    outside = np.flatnonzero(excess > 0)
    if outside.size == 0:
        return 0.0
    last = int(outside[-1])
    if last == value.size - 1:
        return None
    share = excess[last] / (excess[last] - excess[last + 1])
    return float(time_s[last] + share * (time_s[last + 1] - time_s[last]) - time_s[0])
