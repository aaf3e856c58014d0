"""Propagation of distributions by random numbers, after GUM Supplement 1 (JCGM 101:2008).

It needs neither a linear model nor effective degrees of freedom, and is how a budget is checked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.validate.errors import ValidateError
from rig.validate.uncertainty import CONFIDENCE, Component

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Propagated:
    """What the distribution of a result says."""

    mean: float
    sd: float
    low: float
    high: float
    """Probabilistically symmetric coverage interval (7.7)."""

    @property
    def half_width(self) -> float:
        """Half of the interval's length, to compare with an expanded uncertainty."""
        return (self.high - self.low) / 2


def deviates(component: Component, trials: int, rng: np.random.Generator) -> Array:
    """Errors (trials,) of the input that a component describes, in its unit (6.4).

    An uncertainty known by `dof` degrees of freedom is that of a scaled and shifted t (6.4.9);
    a rectangle has its half-width at u sqrt(3) (6.4.2).
    """
    if component.distribution == "rectangular":
        half = component.u * math.sqrt(3)
        return rng.uniform(-half, half, trials)
    if math.isfinite(component.dof):
        return component.u * rng.standard_t(component.dof, trials)
    return component.u * rng.standard_normal(trials)


def propagate(
    model: Callable[[Mapping[str, Array]], Array],
    components: Sequence[Component],
    trials: int,
    rng: np.random.Generator,
    confidence: float = CONFIDENCE,
) -> Propagated:
    """Distribution of `model` over the errors (trials,) of its inputs, by component name.

    Raises ValidateError for components of one name: which input would be which is not known.
    """
    names = [component.name for component in components]
    if len(set(names)) < len(names):
        raise ValidateError(f"the components of a budget need names of their own; got {names}.")
    result = model({c.name: deviates(c, trials, rng) for c in components})
    low, high = np.quantile(result, [(1 - confidence) / 2, (1 + confidence) / 2])
    return Propagated(float(result.mean()), float(result.std(ddof=1)), float(low), float(high))
