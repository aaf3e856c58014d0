"""Standard and expanded uncertainty after the GUM (JCGM 100:2008).

Type A from repeats (4.2), type B from calibrations (4.3), combined by root sum of squares (5.1),
expanded with Student's t at the effective degrees of freedom of Welch and Satterthwaite (G.4). The
same budget propagated by random numbers is `rig.validate.monte_carlo`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from rig.validate.errors import ValidateError

CONFIDENCE = 0.95

Kind = Literal["A", "B"]
Distribution = Literal["normal", "rectangular"]


@dataclass(frozen=True)
class Component:
    """One line of an uncertainty budget: an input quantity, and what it does to the result."""

    name: str
    u: float
    """Standard uncertainty of the input, in `unit`."""
    dof: float = math.inf
    """Degrees of freedom; infinite for an uncertainty taken as exactly known."""
    sensitivity: float = 1.0
    """Sensitivity coefficient: change of the result by a change of the input."""
    unit: str = ""
    """Of the input; empty if it is that of the result."""
    kind: Kind = "B"
    distribution: Distribution = "normal"

    @property
    def contribution(self) -> float:
        """Part of the standard uncertainty of the result, in its unit: |c| u."""
        return abs(self.sensitivity) * self.u


@dataclass(frozen=True)
class Estimate:
    """A value with its combined standard uncertainty."""

    value: float
    u: float
    dof: float = math.inf

    @property
    def u95(self) -> float:
        """Expanded uncertainty for a level of confidence of 95 %."""
        return coverage_factor(self.dof) * self.u


def coverage_factor(dof: float, confidence: float = CONFIDENCE) -> float:
    """Student's t for a two-sided interval; below one degree of freedom that of one is used."""
    return float(stdtrit(max(1.0, dof), 0.5 + confidence / 2))


def effective_dof(components: Iterable[Component]) -> float:
    """Welch-Satterthwaite formula, GUM eq. (G.2b); infinite if all components are exact."""
    parts = [component for component in components if component.contribution > 0]
    whole = math.hypot(*(part.contribution for part in parts))
    # In shares of the whole, so that no fourth power of a tiny uncertainty underflows.
    loss = sum((part.contribution / whole) ** 4 / part.dof for part in parts)
    return 1.0 / loss if loss > 0 else math.inf


def combine(value: float, components: Sequence[Component]) -> Estimate:
    """Estimate of `value` with uncorrelated `components`; GUM eqs. (10) and (G.2b)."""
    u = math.hypot(*(component.contribution for component in components))
    return Estimate(value, u, effective_dof(components))


def mean_of_repeats(values: ArrayLike) -> Estimate:
    """Arithmetic mean with its type A uncertainty s / sqrt(n) and n - 1 degrees of freedom.

    Raises ValidateError for fewer than two values: one says nothing about its spread.
    """
    repeats = np.asarray(values, dtype=np.float64)
    if repeats.ndim != 1 or repeats.size < 2:
        raise ValidateError(
            f"a type A uncertainty needs at least two repeats; there are {repeats.size}. Take more "
            f"repeats, or state the uncertainty from the readings of the single one."
        )
    u = float(repeats.std(ddof=1)) / math.sqrt(repeats.size)
    return Estimate(float(repeats.mean()), u, repeats.size - 1)
