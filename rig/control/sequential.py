"""When is a drift of the innovations a leak? Page's test with a false alarm rate that is derived.

Each hypothetical leak g_j has its running log-likelihood ratio against g_0, the largest that counts
as sound. The innovation nu of a filter that holds g is normal with variance S around what a leak
shifts it by, its signature rho times the excess over g, so with nu_j = nu - (g_j - g) rho

    llr = (nu_0^2 - nu_j^2) / (2 S),       T_j <- max(0, T_j + llr),

and the alarm is T_j > h: Page, Continuous inspection schemes, Biometrika 41 (1954) 100. Under the
sound model exp(sum of llr) is a martingale with mean 1, whatever the dependence, so within m
samples P(false alarm) <= m exp(-h) for each j (Lai, Information bounds and quick detection of
parameter changes in stochastic systems, IEEE Trans. Information Theory 44 (1998) 2917, eq. 20 ff.).
For J hypotheses and a probability alpha in m samples therefore h = ln(m J / alpha).

What is lost at once needs no drift: the squares of the innovations over a short window exceed their
chi-square quantile (Bar-Shalom, Li and Kirubarajan, Estimation with Applications (2001), 5.4.2).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from rig.control.errors import ControlError
from rig.control.gas import Innovation


def page_threshold(false_alarms: float, samples: float, hypotheses: int) -> float:
    """h so that within `samples` a false alarm has at most the probability `false_alarms`.

    Raises ControlError for a probability outside (0, 1) or fewer than one sample or hypothesis.
    """
    if not 0 < false_alarms < 1 or samples < 1 or hypotheses < 1:
        raise ControlError(
            f"no threshold for a false alarm probability of {false_alarms:g} in {samples:g} "
            f"samples with {hypotheses} hypotheses; expected a probability between 0 and 1, and "
            "at least one of the others."
        )
    return math.log(samples * hypotheses / false_alarms)


@lru_cache(maxsize=8)
def loss_threshold(false_alarms: float, samples: float, window: int) -> float:
    """Sum of `window` normalised innovations squared that is exceeded with that probability.

    Bonferroni over `samples` windows: the chi-square quantile at 1 - false_alarms / samples.
    """
    from scipy.stats import chi2

    return float(chi2.isf(false_alarms / samples, window))


class LeakTest:
    """Page's test on the innovations of a `GasFilter`.

    `sound` is the largest conductance that counts as sound, `leaks` those to be found, all in
    m3/(s Pa) above what the filter holds; `threshold` as of `page_threshold`.
    """

    def __init__(self, sound: float, leaks: Sequence[float], threshold: float) -> None:
        if not leaks or min(leaks) <= sound:
            raise ControlError("every leak to be found must be larger than the sound one.")
        self._sound = sound
        self._leaks = tuple(leaks)
        self._threshold = threshold
        self.reset()

    def reset(self) -> None:
        """Begin anew: the valve was opened."""
        self._sums = [_Sum() for _ in self._leaks]

    def add(self, innovation: Innovation, dt: float) -> float | None:
        """Take the next innovation, `dt` seconds after the last; once a leak is sure, returns since
        how many seconds.

        That is the last time its statistic was zero: the maximum-likelihood time of the change.
        """
        sound = innovation.if_leaking(self._sound) ** 2
        ages = [
            total.add((sound - innovation.if_leaking(leak) ** 2) / (2 * innovation.variance), dt)
            for leak, total in zip(self._leaks, self._sums, strict=True)
        ]
        sure = [
            age
            for age, total in zip(ages, self._sums, strict=True)
            if total.ratio > self._threshold
        ]
        return min(sure, default=None)

    @property
    def evidence(self) -> float:
        """The largest statistic as a share of the threshold."""
        return max(total.ratio for total in self._sums) / self._threshold


@dataclass
class _Sum:
    """Page's statistic for one leak, and for how many seconds it has been above zero."""

    ratio: float = 0.0
    age: float = 0.0

    def add(self, increment: float, dt: float) -> float:
        self.ratio += increment
        self.age += dt
        if self.ratio <= 0:
            self.ratio, self.age = 0.0, 0.0
        return self.age


class LossTest:
    """Gas that is lost at once: a chi-square test on a window of innovations that run low.

    `sound` as of `LeakTest`; `threshold` as of `loss_threshold`.
    """

    def __init__(self, sound: float, window: int, threshold: float) -> None:
        self._sound = sound
        self._threshold = threshold
        self._recent: deque[float] = deque(maxlen=window)

    def reset(self) -> None:
        """Begin anew: the valve was opened."""
        self._recent.clear()

    def add(self, innovation: Innovation) -> bool:
        """Take the next innovation; returns whether gas has gone."""
        value = innovation.if_leaking(self._sound)
        self._recent.append(value / math.sqrt(innovation.variance))
        return self.evidence > 1

    @property
    def evidence(self) -> float:
        """The sum of squares as a share of the threshold; 0 if the innovations run high."""
        if sum(self._recent) >= 0:
            return 0.0
        return sum(z * z for z in self._recent) / self._threshold
