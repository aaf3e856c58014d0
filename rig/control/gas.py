"""The gas between plunger and actuator as a state-space model, and an extended Kalman filter on it.

What the link tells is the plunger's volume x and the gauge pressure p. The gas obeys

    (p_a + p) V = p_a n (1 + theta),        V = V_s - x + v + c p + w,

with n the gas quantity as its volume at ambient pressure and temperature, V_s the volume between
plunger at home and tube's end, v the actuator's volume at 0 kPa, c its compliance, w what creep
adds, theta the relative rise of temperature. Between two samples a leak of conductance g takes
dn = -g p dt, creep follows one Prony term, w' = (m p - w) / tau, and compression warms the gas,
theta' = (gamma - 1) (-V'/V) - theta / tau_h. The state is (n, v, c, m, w, theta, g).

Filter: Jazwinski, Stochastic Processes and Filtering Theory (1970), ch. 8, as filterpy has it. As
long as the line counts as sound g is held, so that the volume's slow wander is not taken for a
leak; what the innovations say of g is then read off them as of a bias (Friedland, Treatment of bias
in recursive filtering, IEEE Trans. Automatic Control 14 (1969) 359). Everything is in SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.control.errors import ControlError
from rig.control.physics import ADIABATIC_EXPONENT

Array = NDArray[np.float64]
N, V, C, M, W, THETA, G = range(7)
STATES = 7
ANY_LEAK = 1e-8
"""m3/(s Pa), 100 mL/s at 10 kPa: how uncertain a leak is that has only just been decided on."""
NEAR = 1e-3
"""A state so strange that no pressure solves the model's equation is taken for one beside it."""


@dataclass(frozen=True)
class GasLine:
    """What is known of the line from its drawing, and how far reality may be from this model.

    The noise figures are ours; `docs/theory/estimator.md` says how consistent they made the filter.
    """

    ambient_pressure: float
    line_volume: float
    """m3 from the plunger at home to the tube's end."""
    backlash: float = 0.0
    """m3 that the motor turns before the plunger follows it back."""
    heat_time: float = 0.3
    """s in which compressed gas comes back to ambient temperature (a guess: a thin syringe)."""
    creep_time: float = 8.0
    """s; one Prony term stands for the creep of the first minute."""
    pressure_noise: float = 2.0
    """Pa; standard deviation of one sample as the filter gets it."""
    volume_walk: float = 2e-9
    """m3/s^0.5 by which the volume wanders: slower creep than that of `creep_time`."""
    stroke_error: float = 50e-9
    """m3 by which the volume may be off after a stroke of 1 mL, growing with its square root:
    the actuator's volume is not quite linear in the pressure."""
    heat_error: float = 0.3
    """Share of the heat of compression that the model may be wrong about."""


@dataclass(frozen=True)
class ActuatorVolume:
    """What is known of the actuator's volume; each with its standard uncertainty."""

    volume: float
    u_volume: float
    """m3 at 0 kPa; the uncertainty is to cover that of the line, too."""
    compliance: float
    u_compliance: float
    """m3/Pa."""
    creep: float
    u_creep: float
    """m3/Pa that creep adds in the long run."""

    @classmethod
    def of_cavity(cls, volume: float, u_volume: float) -> ActuatorVolume:
        """The little that a drawing tells: some compliance, which the first ramp will show.

        A bellow bends open by some 2 % of its volume for each kPa; a twentieth of that creeps.
        """
        compliance = 0.02e-3 * volume
        creep = 0.05 * compliance
        return cls(volume, u_volume, compliance, compliance, creep, creep)


@dataclass(frozen=True)
class Innovation:
    """What one sample told."""

    value: float
    """Measured minus predicted pressure, Pa."""
    variance: float
    signature: float
    """Change of `value` by a leak larger by one unit of conductance, Pa per m3/(s Pa)."""

    def if_leaking(self, excess: float) -> float:
        """What `value` were had the filter held a leak larger by `excess`, m3/(s Pa)."""
        return self.value - excess * self.signature

    @property
    def nis(self) -> float:
        """Normalised innovation squared; its mean is 1 if the filter is consistent."""
        return self.value**2 / self.variance


@dataclass(frozen=True)
class Leak:
    """Conductance of a leak in m3/(s Pa), of gas at ambient conditions."""

    conductance: float
    u: float
    """Standard uncertainty."""


class GasFilter:
    """Follows the gas from the moment the valve closes until it opens.

    `leak` is the conductance that is held until a leak is expected, m3/(s Pa).
    """

    def __init__(self, line: GasLine, actuator: ActuatorVolume, leak: float = 0.0) -> None:
        from filterpy.kalman import ExtendedKalmanFilter  # 1.5 s: only where it is used

        self._line = line
        self._held = leak
        self._known = actuator
        self._filter = ExtendedKalmanFilter(dim_x=STATES, dim_z=1)
        self._filter.R = np.array([[line.pressure_noise**2]])
        self._x = self._p = self._play = 0.0
        self._expected = False
        self._bias = np.zeros(STATES)
        self._information = self._score = 0.0

    def close(self, plunger: float, pressure: float) -> None:
        """The valve has closed: plunger at `plunger` (m3), pushed in last; `pressure` in Pa gauge.

        Raises ControlError if there is no room for gas.
        """
        line, known = self._line, self._known
        self._x, self._p, self._play = plunger, pressure, 0.0
        space = line.line_volume - plunger + known.volume + known.compliance * pressure
        if space <= 0:
            raise ControlError(
                f"there is no room for gas: {space * 1e6:.3g} mL. Check syringe.volume, "
                "syringe.dead_volume and tubing of the bench."
            )
        density = 1 + pressure / line.ambient_pressure
        x = np.array([density * space, known.volume, known.compliance, known.creep, 0, 0, 0])
        x[G] = self._held
        # what is not known of the volume is not known of the gas in it either
        shape = np.zeros((STATES, 3))
        shape[V, 0], shape[N, 0] = known.u_volume, density * known.u_volume
        shape[C, 1], shape[N, 1] = known.u_compliance, density * known.u_compliance * pressure
        shape[N, 2] = space * line.pressure_noise / line.ambient_pressure
        p = shape @ shape.T
        p[M, M] = known.u_creep**2
        p[THETA, THETA] = 1e-10  # it had the time to cool while the valve was open
        self._filter.x, self._filter.P = x[:, None], p
        self._expected = False
        self._bias = np.eye(STATES)[G]
        self._information = self._score = 0.0

    def open(self) -> None:
        """The valve has opened; what was learned of the actuator is kept for the next closing."""
        x, p = self.state, np.sqrt(np.diag(self._filter.P))
        self._known = ActuatorVolume(x[V], p[V], x[C], p[C], x[M], p[M])

    def expect_leak(self) -> None:
        """A leak has begun some time ago: from now on it is one of the states.

        What was lost until now must not count as its rate, as nobody knows since when.
        """
        self._expected = True
        self._filter.P[N, N] += self._line.line_volume**2
        self._filter.P[G, G] = ANY_LEAK**2

    def step(self, dt: float, plunger: float, pressure: float) -> Innovation:
        """The next sample, `dt` seconds after the last one: motor in m3, gauge pressure in Pa."""
        kalman = self._filter
        # the nut pushes at the motor's position and pulls one backlash later
        motor, plunger = plunger, min(max(self._x, plunger), plunger + self._line.backlash)
        transition, drive, noise = self._transition(dt, plunger, 0.5 * (self._p + pressure))
        # a seal that sticks lets go at a pressure that nobody knows: the plunger is at this end of
        # what is open of the play or has jumped to the other
        noise[V, V] += (0.5 * max(plunger - motor, self._play)) ** 2
        self._play = plunger - motor
        kalman.F, kalman.Q = transition, noise
        kalman.B = np.eye(STATES)
        kalman.predict(drive[:, None])
        self._bias = transition @ self._bias
        self._x, self._p = plunger, pressure
        kalman.update(np.array([[pressure]]), self._jacobian, self._pressure)
        row = self._jacobian(kalman.x_prior)[0]
        signature = float(row @ self._bias)
        self._bias = self._bias - kalman.K[:, 0] * signature
        found = Innovation(float(kalman.y[0, 0]), float(kalman.S[0, 0]), signature)
        self._information += signature**2 / found.variance
        self._score += signature * found.value / found.variance
        return found

    @property
    def state(self) -> Array:
        """Estimate (7,) of (n, v, c, m, w, theta, g)."""
        return np.asarray(self._filter.x[:, 0], dtype=float)

    @property
    def covariance(self) -> Array:
        """Covariance (7, 7) of `state`."""
        return np.asarray(self._filter.P, dtype=float)

    @property
    def pressure(self) -> float:
        """Gauge pressure in Pa after the last sample: the reading with less noise."""
        return float(self._pressure(self._filter.x)[0, 0])

    @property
    def leak(self) -> Leak | None:
        """The leak since the valve closed, or since it was expected.

        None until there is pressure that would show one.
        """
        if self._expected:
            return Leak(float(self.state[G]), math.sqrt(self.covariance[G, G]))
        if self._information <= 0:
            return None
        return Leak(self._held + self._score / self._information, self._information**-0.5)

    @property
    def estimate(self) -> GasEstimate:
        """Gas and volume with the leak as found; see `GasEstimate`."""
        x, p = self.state, self.covariance
        leak = self.leak
        # Friedland, eq. 24: the bias moves the state along its sensitivity, and widens it
        if leak is not None and not self._expected:
            x = x + self._bias * (leak.conductance - self._held)
            p = p + np.outer(self._bias, self._bias) * leak.u**2
        volume = np.zeros(STATES)
        volume[[V, W]], volume[C] = 1.0, self._p
        return GasEstimate(
            quantity=float(x[N]),
            u_quantity=math.sqrt(p[N, N]),
            actuator_volume=float(volume @ x),
            u_actuator_volume=math.sqrt(volume @ p @ volume),
            leak=leak,
        )

    def _transition(self, dt: float, plunger: float, p: float) -> tuple[Array, Array, Array]:
        """Transition matrix, known drive and process noise of a step at gauge pressure `p`."""
        line, x = self._line, self.state
        kept, warm = math.exp(-dt / line.creep_time), math.exp(-dt / line.heat_time)
        stroke = plunger - self._x
        space = line.line_volume - plunger + x[V] + x[W] + x[C] * p
        # heat given evenly over the step, of which some is lost before its end
        heat = (ADIABATIC_EXPONENT - 1) * (1 - warm) * line.heat_time / dt / space
        transition = np.eye(STATES)
        transition[W, W], transition[W, M] = kept, (1 - kept) * p
        transition[THETA, THETA] = warm
        transition[N, G] = -p * dt
        drive = np.zeros(STATES)
        drive[THETA] = heat * stroke
        noise = np.zeros((STATES, STATES))
        noise[V, V] = line.volume_walk**2 * dt + line.stroke_error**2 * abs(stroke) / 1e-6
        noise[THETA, THETA] = (line.heat_error * heat * stroke) ** 2
        return transition, drive, noise

    def _quadratic(self, x: Array) -> tuple[float, float]:
        """Pressure q that solves c q^2 + b q + p_a (a - n) = 0, and 2 c q + b."""
        ambient = self._line.ambient_pressure
        n = x[N, 0] * (1 + x[THETA, 0])
        a = self._line.line_volume - self._x + x[V, 0] + x[W, 0]
        b = a + x[C, 0] * ambient
        root = math.sqrt(max(b * b - 4 * x[C, 0] * ambient * (a - n), (NEAR * b) ** 2))
        return 2 * ambient * (n - a) / (b + root), root

    def _pressure(self, x: Array) -> Array:
        return np.array([[self._quadratic(x)[0]]])

    def _jacobian(self, x: Array) -> Array:
        ambient = self._line.ambient_pressure
        q, slope = self._quadratic(x)
        row = np.zeros((1, STATES))
        row[0, N] = ambient * (1 + x[THETA, 0])
        row[0, [V, W]] = -(ambient + q)
        row[0, C] = -(ambient + q) * q
        row[0, THETA] = ambient * x[N, 0]
        return row / slope


@dataclass(frozen=True)
class GasEstimate:
    """What the filter makes of plunger and pressure; SI units, standard uncertainties."""

    quantity: float
    u_quantity: float
    """Gas in the closed line as its volume at ambient pressure and temperature, m3."""
    actuator_volume: float
    u_actuator_volume: float
    """m3 at the present pressure; what the line's own volume is off by counts into it."""
    leak: Leak | None
