"""A linear-quadratic regulator with Kalman filter and integral action, at the host's pace.

Plant: the identified model behind the integration of flow, held for a sample, plus one sample for
the way through link and host. The regulator weighs pressure error, its integral and flow; the
filter takes a random-walk flow (leak, creep) for process noise (python-control's dlqr and dlqe;
Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed., chapters 8 and 9).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.control.errors import ControlError
from rig.control.identify import LevelModel
from rig.control.loop import Margins, frequencies, margins_of, plant

Array = NDArray[np.float64]

ERROR_KPA, INTEGRAL_KPA_S, FLOW_ML_S = 0.05, 0.05, 2.0
"""Deviations that weigh the same (Bryson's rule); less flow where the margins ask for it."""
LEAST_GAIN_DB, LEAST_PHASE_DEG = 6.0, 45.0
"""An LQG has no margins of itself (Doyle, IEEE Trans. Automatic Control 23 (1978) 756)."""
LESS_FLOW = 0.7
LEAST_FLOW_ML_S = 1e-3
WARM_RAD_S = 3.0
"""Frequency of the gain by which a set-point's ramp is fed forward: that of a move of a second."""
DISTURBANCE_ML_S = 0.2
"""Standard deviation of the flow that nobody commanded."""


class LinearQuadraticGaussian:
    """From measured pressure and set-point to a flow of the plunger, one call a sample."""

    def __init__(
        self,
        model: LevelModel,
        noise_kpa: float,
        sample_s: float,
        max_flow_ml_s: float,
        weight_ml_s: float = FLOW_ML_S,
    ) -> None:
        """Design it; `weight_ml_s` is the flow that weighs as much as `ERROR_KPA`."""
        import control

        self.weight_ml_s = weight_ml_s

        held = control.c2d(model.state_space() * control.ss(0.0, 1.0, 1.0, 0.0), sample_s, "zoh")
        late = held * control.ss(0.0, 1.0, 1.0, 0.0, sample_s)
        self._a, self._b = np.asarray(late.A), np.asarray(late.B)[:, 0]
        self._c = np.asarray(late.C)[0]
        self._sample_s, self._most = sample_s, max_flow_ml_s
        self._regulator = _regulator(self._a, self._b, self._c, sample_s, weight_ml_s)
        self._gain = _kalman(control, self._a, self._b, self._c, noise_kpa)
        self._rest = self._rest_for_one_kpa()
        self._compliance = 1 / ramp_gain(model)
        self._state = np.zeros(self._a.shape[0])
        self._integral = 0.0
        self._base: float | None = None
        self._before = 0.0

    def _rest_for_one_kpa(self) -> Array:
        """State in which the plant rests 1 kPa above where it began."""
        size = self._a.shape[0]
        system = np.vstack([self._a - np.eye(size), self._c])
        rest, *_ = np.linalg.lstsq(system, np.append(np.zeros(size), 1.0), rcond=None)
        return np.asarray(rest)

    def flow(self, pressure_kpa: float, setpoint_kpa: float, rate_kpa_s: float) -> float:
        """Flow in mL/s for the next sample; `rate_kpa_s` is how fast the set-point moves."""
        if self._base is None:
            self._base = pressure_kpa
        measured, wanted = pressure_kpa - self._base, setpoint_kpa - self._base
        predicted = self._a @ self._state + self._b * self._before
        self._state = predicted + self._gain * (measured - self._c @ predicted)
        away = np.append(self._state - wanted * self._rest, self._integral)
        ahead = self._compliance * rate_kpa_s
        asked = ahead - float(self._regulator @ away)
        given = min(max(asked, -self._most), self._most)
        if given == asked and rate_kpa_s == 0:
            self._integral += self._sample_s * (measured - wanted)
        self._before = given
        return given

    def margins(self, model: LevelModel) -> Margins:
        """How far the loop around a plant, late by one sample, is from instability."""
        import control

        n = self._a.shape[0]
        regulator, integral = self._regulator[:n], self._regulator[n]
        # of the state that was predicted, and the integral: the filter corrects, then acts
        corrected = np.eye(n) - np.outer(self._gain, self._c)
        acted = np.append(regulator @ corrected, integral)
        at_once = float(regulator @ self._gain)
        a = np.zeros((n + 1, n + 1))
        a[:n, :n] = self._a @ corrected
        a[:n] -= np.outer(self._b, acted)
        a[n, n] = 1.0
        b = np.append(self._a @ self._gain - self._b * at_once, self._sample_s)
        host = control.ss(a, b[:, None], acted[None, :], at_once, self._sample_s)
        omega = frequencies(self._sample_s)
        z = np.exp(1j * omega * self._sample_s)
        return margins_of(np.asarray(host(z) * plant(model, self._sample_s)(z) / z), omega)


def ramp_gain(model: LevelModel) -> float:
    """kPa/mL of a move that a set-point's ramp makes: its gas has not cooled, it has not crept."""
    return float(np.abs(model.response(np.array([WARM_RAD_S])))[0])


def robust_regulator(
    model: LevelModel,
    members: Sequence[LevelModel],
    noise_kpa: float,
    sample_s: float,
    max_flow_ml_s: float,
) -> LinearQuadraticGaussian:
    """The regulator for `model` with the most flow that keeps its margins around all `members`.

    Raises ControlError if none does.
    """
    weight_ml_s = FLOW_ML_S
    while weight_ml_s > LEAST_FLOW_ML_S:
        made = LinearQuadraticGaussian(model, noise_kpa, sample_s, max_flow_ml_s, weight_ml_s)
        found = [made.margins(member) for member in members]
        if (
            min(one.gain_db for one in found) >= LEAST_GAIN_DB
            and min(one.phase_deg for one in found) >= LEAST_PHASE_DEG
        ):
            return made
        weight_ml_s *= LESS_FLOW
    raise ControlError(
        f"no regulator in the host keeps {LEAST_GAIN_DB:g} dB and {LEAST_PHASE_DEG:g} deg for all "
        "levels and volumes. Identify fewer levels, or closer ones."
    )


def _regulator(a: Array, b: Array, c: Array, sample_s: float, weight_ml_s: float) -> Array:
    import control

    size = a.shape[0]
    augmented = np.block([[a, np.zeros((size, 1))], [sample_s * c[None, :], np.ones((1, 1))]])
    inputs = np.append(b, 0.0)[:, None]
    weight = np.zeros((size + 1, size + 1))
    weight[:size, :size] = np.outer(c, c) / ERROR_KPA**2
    weight[size, size] = 1 / INTEGRAL_KPA_S**2
    gain, _, _ = control.dlqr(augmented, inputs, weight, np.array([[1 / weight_ml_s**2]]))
    return np.asarray(gain, dtype=np.float64).ravel()


def _kalman(control: Any, a: Array, b: Array, c: Array, noise_kpa: float) -> Array:
    """Gain of the filter's correction: dlqe's is that of the one-step predictor, a times it."""
    _, covariance, _ = control.dlqe(
        a,
        np.eye(a.shape[0]),
        c[None, :],
        DISTURBANCE_ML_S**2 * np.outer(b, b) + 1e-12 * np.eye(a.shape[0]),
        np.array([[noise_kpa**2]]),
    )
    p = np.asarray(covariance)
    return np.asarray(p @ c / (c @ p @ c + noise_kpa**2))
