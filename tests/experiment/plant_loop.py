"""The firmware's loop around the nonlinear plant, with a gain and a delay that nobody would flash.

Ticks, converter, filter and controller are those of the firmware, in Python: parameters of the
board end before the stability limit does, and it has none for delay.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from rig.board.virtual import VirtualBench
from rig.control.loop import FILTER_TICKS, TICK_S, Gains
from rig.spec.workspace import Setup

CONVERSIONS = 9
"""Of the converter in a millisecond."""
FLOW_LIMIT = 100.0
"""mL/s, far above the drive's: a limit cycle within that would hide an instability."""


class PlantLoop:
    """A virtual bench's plant, regulated; its sensors are all that the controller sees."""

    def __init__(self, setup: Setup, seed: int) -> None:
        bench = VirtualBench(setup, seed)
        self.plant = bench.plant
        self._keep = bench
        calibration = setup.calibrations.transducer
        self._gain_kpa_v = calibration.gain / 1e3
        self._volts = setup.bench.adc.reference / 2**setup.bench.adc.bits
        self._step_ml = setup.bench.volume_per_step * 1e6
        self._recent: deque[float] = deque(maxlen=FILTER_TICKS)
        self._zero_v = 0.0
        self._owed = 0.0
        self._integral = 0.0
        rest = [self._tick(0.0, valve_open=True) for _ in range(500)]
        self._zero_v = float(np.mean(rest[FILTER_TICKS:])) / self._gain_kpa_v

    def _tick(self, flow_ml_s: float, *, valve_open: bool = False) -> float:
        """Two milliseconds at a flow; the filtered pressure in kPa."""
        self._owed += flow_ml_s * TICK_S / self._step_ml
        steps = int(self._owed)
        self._owed -= steps
        first = steps // 2
        sums = 0.0
        for part in (first, steps - first):
            pins = self.plant.run(1, steps=part, valve_open=valve_open)
            sums += sum(pins.adc[i] for i in range(CONVERSIONS)) / CONVERSIONS
        self._recent.append((sums / 2 + 0.5) * self._volts)
        return self._pressure()

    def _pressure(self) -> float:
        return self._gain_kpa_v * (float(np.mean(self._recent)) - self._zero_v)

    def regulate(
        self, target_kpa: float, gains: Gains, duration_s: float, delay_s: float = 0.0
    ) -> np.ndarray:
        """Measured pressures of every tick; `delay_s` more than the firmware has."""
        late: deque[float] = deque([0.0] * round(delay_s / TICK_S))
        pressure, measured = self._pressure(), []
        for _ in range(round(duration_s / TICK_S)):
            error = target_kpa - pressure
            flow = gains.proportional * error + self._integral
            self._integral += gains.integral * TICK_S * error
            late.append(min(max(flow, -FLOW_LIMIT), FLOW_LIMIT))
            pressure = self._tick(late.popleft())
            measured.append(pressure)
        return np.array(measured)

    def keep(self) -> None:
        """This is where `begin` goes back to."""
        self._kept = (self.plant.save(), list(self._recent), self._integral)

    def begin(self) -> None:
        """Back to what was kept, noise and all."""
        state, recent, self._integral = self._kept
        self.plant.restore(state)
        self._recent.extend(recent)
        self._owed = 0.0
