"""The latency of a camera, from an actuator that swings: its frames come after its pressure.

Pressure goes up and down between two limits, slowly and fast. The angle is a parabola of the
pressure a delay before the frame, with a drift that may fade, and a loop: hysteresis and most creep
leave the angle behind by as much at any rate, on the other side on the way back. At another rate
the same loop is another delay; that tells the two apart.

What remains is not the camera alone: the tube and the actuator's damping let the angle follow the
pressure late, the transducer's filter makes the pressure late as well, and at rates that a plunger
reaches such a lag is no different from a latency. Each has to be known (`Lag`): the tube's is
worked out from what the plunger pushes, the filter's is the board's own, the damping has to be
told.

Gauss-Newton on the delay; everything else is linear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibrate.errors import CalibrateError
from rig.calibrate.least_squares import LinearFit, least_squares
from rig.spec.bench import BenchSpec
from rig.spec.calibration import CameraLatency, Provenance

Array = NDArray[np.float64]
INNER = 0.6
"""Share of the swing that counts, about its middle: in the rest the pressure turns."""
SMOOTHED_S = 0.05
"""Half the time over which a straight line through pressures gives pressure and rate."""
FIRST_S = 0.05
CONVERGED_S = 1e-6
MOST_STEPS = 30
LONGEST_S = 2.0
MODEL = (
    "angle_deg = offset + slope x + curvature x^2 + drift t + settling t^2 + loop (1 up, -1 down); "
    "x = pressure delay s before a frame arrives, from the swing's middle, over half the swing"
)


@dataclass(frozen=True)
class Swing:
    """Frames (n,) and pressures (m,) in order of bench time; frames' times are of arrival."""

    frame_s: Array
    angle_deg: Array
    pressure_s: Array
    pressure_kpa: Array
    plunger_ml: Array
    """(m,), from home, inwards."""


@dataclass(frozen=True)
class Lag:
    """What makes the angle follow the reported pressure late, s, and how well that is known."""

    cause: str
    value_s: float
    u_s: float


TRANSDUCER = Lag("transducer's filter", -0.004, 0.0006)
"""Four ticks of 2 ms (`firmware/rig_mega/src/core/transducer.h`), each a mean over the 2 ms before
it; a rectangle of 1 ms each way for when in a tick it is reported."""
CREEP = Lag("creep", 0.0, 0.002)
"""What of it is no loop of one width at both rates: 4 % with time constants of 8 to 30 s took 2 ms
off the delay on the virtual bench."""
TUBE_SHARE_U = 0.2
"""Of the tube's lag: gas is between isothermal and adiabatic there, and bores differ."""


@dataclass(frozen=True)
class LatencyFit:
    """What a swing told: all that was fitted, "delay" in s among it."""

    fit: LinearFit
    lags: tuple[Lag, ...]

    @property
    def value_s(self) -> float:
        """The camera's latency."""
        return self.fit["delay"] - sum(lag.value_s for lag in self.lags)

    @property
    def u_s(self) -> float:
        """Its standard uncertainty."""
        return float(np.linalg.norm([self.fit.u({"delay": 1.0}), *(lag.u_s for lag in self.lags)]))

    def latency(self, provenance: Provenance) -> CameraLatency:
        """As the camera's calibration keeps it; raises CalibrateError for one below nothing."""
        if self.value_s < -2 * self.u_s:
            raise CalibrateError(
                f"the frames came {-1e3 * self.value_s:.0f} ms before what they show, after "
                f"{1e3 * (self.fit['delay'] - self.value_s):.0f} ms for the actuator to follow "
                "were taken off. Does it follow faster than that?"
            )
        return CameraLatency(
            value=max(0.0, self.value_s),
            u=self.u_s,
            provenance=provenance,
            fit=self.fit.record(MODEL),
        )


def tube_lag(swing: Swing, bench: BenchSpec, dead_volume: float) -> Lag:
    """The time constant of tube and actuator: resistance times the volume taken up per pressure.

    That is what the plunger pushed per pressure in the swing's middle, less what compresses the gas
    on its side of the tube; `dead_volume` in m3 is the syringe's.
    """
    pushed = np.polynomial.Polynomial.fit(swing.pressure_kpa, swing.plunger_ml, 2)
    middle_kpa = (swing.pressure_kpa.min() + swing.pressure_kpa.max()) / 2
    taken_up = 1e-9 * float(pushed.deriv()(middle_kpa))
    if bench.fluid.kind == "air":
        left = bench.syringe.volume - 1e-6 * float(pushed(middle_kpa))
        gas = left + dead_volume + bench.tubing.volume / 2
        taken_up -= gas / (bench.ambient.pressure + 1e3 * middle_kpa)
    lag_s = bench.tubing.resistance(bench.fluid.viscosity) * max(taken_up, 0.0)
    return Lag("tube", lag_s, TUBE_SHARE_U * lag_s)


def fit_latency(swing: Swing, lags: tuple[Lag, ...]) -> LatencyFit:
    """The latency by the frames of the swing's inner part, less the `lags`.

    Raises CalibrateError where no delay of at most 2 s brings angles and pressures together.
    """
    low, high = swing.pressure_kpa.min(), swing.pressure_kpa.max()
    middle, half = (low + high) / 2, (high - low) / 2
    delay_s = FIRST_S
    for _ in range(MOST_STEPS):
        pressure, rate = _local_lines(swing, swing.frame_s - delay_s)
        inner = np.abs(pressure - middle) < INNER * half
        x, x_rate = (pressure[inner] - middle) / half, rate[inner] / half
        t, angle = swing.frame_s[inner], swing.angle_deg[inner]
        columns = {
            "offset": np.ones_like(x),
            "slope": x,
            "curvature": x**2,
            "drift": t - t.mean(),
            "settling": (t - t.mean()) ** 2,
            "loop": np.sign(x_rate),
        }
        curve = least_squares(columns, angle)
        later = -(curve["slope"] + 2 * curve["curvature"] * x) * x_rate
        fit = least_squares(columns | {"delay": later}, angle)
        step_s = fit["delay"]
        delay_s += step_s
        if abs(step_s) < CONVERGED_S:
            values = np.append(fit.values[:-1], delay_s)
            return LatencyFit(
                LinearFit(fit.names, values, fit.covariance, fit.residuals, fit.dof), lags
            )
        if abs(delay_s) > LONGEST_S:
            break
    raise CalibrateError(
        "no delay brings the angles of the frames and the pressures together. Does the actuator "
        "in the picture hang at this board, and does it move?"
    )


def _local_lines(swing: Swing, time_s: Array) -> tuple[Array, Array]:
    """Pressure (kPa) and its rate (kPa/s) at `time_s`, by a line through the samples around.

    Not a number where there are fewer than three.
    """
    found = np.full((2, time_s.size), np.nan)
    first = np.searchsorted(swing.pressure_s, time_s - SMOOTHED_S)
    last = np.searchsorted(swing.pressure_s, time_s + SMOOTHED_S)
    for i, (begin, end) in enumerate(zip(first, last, strict=True)):
        if end - begin > 2:
            t = swing.pressure_s[begin:end] - time_s[i]
            found[:, i] = np.polyfit(t, swing.pressure_kpa[begin:end], 1)[::-1]
    return found[0], found[1]
