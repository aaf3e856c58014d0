"""Watches the gas of a closed line: what is in it, how fast it leaks, and when that is an alarm."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Literal

from rig.control.gas import ActuatorVolume, GasEstimate, GasFilter, GasLine, Innovation
from rig.control.sequential import LeakTest, LossTest, loss_threshold, page_threshold

SAMPLE_S = 0.2
"""A sample is the mean over so long: ten messages of the link, whose noise is then white."""
FALSE_ALARMS = 0.01
ALARM_HOURS = 1.0
"""At most this probability of a false alarm in so long a time; each of the two tests has half."""
LOSS_WINDOW = 5
"""Samples of the chi-square test: one second."""
TOLD_U = 0.2
"""A decided leak is told once its standard uncertainty is below this share of it."""
BURST_SHARE = 0.5
"""The line has burst, too, where so much of the pressure went before the leak could be measured."""


@dataclass(frozen=True)
class LeakLimits:
    """Conductances in m3/(s Pa): what counts as sound, and the leaks that are looked for."""

    sound: float = 1e-12
    """0.01 mL/s at 10 kPa."""
    looked_for: tuple[float, ...] = (3e-12, 10e-12, 100e-12)
    """0.03, 0.1 and 1 mL/s at 10 kPa; a leak between two of them is found by the lower one."""


@dataclass(frozen=True)
class GasAlarm:
    """A leak, decided; it is a burst if the plunger cannot make good what is lost."""

    kind: Literal["leak", "burst"]
    since_s: float
    """How long it has been there, by the reckoning of the test."""
    estimate: GasEstimate
    """Its `leak` is None if the valve opened before it could be measured."""


@dataclass
class _Decision:
    """A leak that is sure but not yet measured; `pressure` is that before it."""

    since_s: float
    pressure: float


class GasMonitor:
    """Samples of plunger and pressure in; innovations, estimates and alarms out.

    After an alarm the estimate is of the time since the decision, and there is no other alarm
    until the valve has been open.
    """

    def __init__(
        self,
        line: GasLine,
        actuator: ActuatorVolume,
        max_flow: float,
        limits: LeakLimits | None = None,
    ) -> None:
        """Begin; `max_flow` is the fastest plunger in m3/s."""
        limits = limits or LeakLimits()
        samples = ALARM_HOURS * 3600 / SAMPLE_S
        self._max_flow = max_flow
        self._filter = GasFilter(line, actuator)
        threshold = page_threshold(FALSE_ALARMS / 2, samples, len(limits.looked_for))
        self._leaks = LeakTest(limits.sound, limits.looked_for, threshold)
        threshold = loss_threshold(FALSE_ALARMS / 2, samples, LOSS_WINDOW)
        self._losses = LossTest(limits.sound, LOSS_WINDOW, threshold)
        self._recent: deque[float] = deque(maxlen=LOSS_WINDOW)
        self._decision: _Decision | None = None
        self._told = False

    def close(self, plunger: float, pressure: float) -> None:
        """The valve has closed: plunger in m3, gauge pressure in Pa."""
        self._filter.close(plunger, pressure)
        self._leaks.reset()
        self._losses.reset()
        self._recent.clear()
        self._decision, self._told = None, False

    def open(self) -> GasAlarm | None:
        """The valve has opened; returns an alarm that could not be told before."""
        if self._decision is None:  # what a leak taught of the actuator is better forgotten
            self._filter.open()
            return None
        return None if self._told else self._tell(self._decision)

    def step(
        self, dt: float, plunger: float, pressure: float
    ) -> tuple[Innovation, GasAlarm | None]:
        """The next sample, `dt` seconds after the last: plunger in m3, gauge pressure in Pa."""
        innovation = self._filter.step(dt, plunger, pressure)
        decision = self._decision
        if decision is None:
            self._decision = self._decide(innovation, dt, pressure)
            return innovation, None
        decision.since_s += dt
        leak = self._filter.leak
        if self._told or leak is None or leak.u > TOLD_U * leak.conductance:
            return innovation, None
        return innovation, self._tell(decision)

    @property
    def filtered_pressure(self) -> float:
        """Gauge pressure in Pa with less noise than the last sample."""
        return self._filter.pressure

    @property
    def evidence(self) -> float:
        """How near the tests are to deciding on a leak, which they do at 1."""
        return max(self._leaks.evidence, self._losses.evidence)

    @property
    def estimate(self) -> GasEstimate:
        """Gas, volume and leak by now."""
        return self._filter.estimate

    def _decide(self, innovation: Innovation, dt: float, pressure: float) -> _Decision | None:
        self._recent.append(pressure)
        lost, since_s = self._losses.add(innovation), self._leaks.add(innovation, dt)
        if since_s is None and not lost:
            return None
        self._filter.expect_leak()
        return _Decision(since_s if since_s is not None else dt, max(self._recent))

    def _tell(self, decision: _Decision) -> GasAlarm:
        self._told = True
        estimate = self._filter.estimate
        burst = (
            self.filtered_pressure < BURST_SHARE * decision.pressure
            if estimate.leak is None or estimate.leak.u > estimate.leak.conductance
            else estimate.leak.conductance * decision.pressure > self._max_flow
        )
        return GasAlarm("burst" if burst else "leak", decision.since_s, estimate)
