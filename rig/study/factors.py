"""Factors, their coding, and the terms of polynomial models in them.

Coded values are -1 at a factor's low level and +1 at its high level, whatever the unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rig.study.errors import StudyError

Array = NDArray[np.float64]
Term = tuple[int, ...]
"""Factors that are multiplied, by index: () is the constant, (0,) linear, (0, 0) a square."""


@dataclass(frozen=True)
class Factor:
    """One factor and its two levels, in any unit."""

    name: str
    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise StudyError(
                f"factor '{self.name}': the low level {self.low:g} is not below the high level "
                f"{self.high:g}; exchange them, or leave the factor out."
            )

    @property
    def centre(self) -> float:
        """Half way between the levels."""
        return (self.low + self.high) / 2

    @property
    def half(self) -> float:
        """Half of the distance between the levels."""
        return (self.high - self.low) / 2


def coded(factors: Sequence[Factor], actual: Array) -> Array:
    """Points (n, k) in the factors' units as coded ones."""
    centre, half = np.array([[f.centre, f.half] for f in factors]).T
    return np.asarray((actual - centre) / half, dtype=np.float64)


def actual(factors: Sequence[Factor], points: Array) -> Array:
    """Coded points (n, k) in the factors' units."""
    centre, half = np.array([[f.centre, f.half] for f in factors]).T
    return np.asarray(centre + half * points, dtype=np.float64)


def linear_terms(count: int) -> tuple[Term, ...]:
    """Constant and linear terms of `count` factors."""
    return ((), *((i,) for i in range(count)))


def interaction_terms(count: int) -> tuple[Term, ...]:
    """The same with all products of two different factors."""
    return (*linear_terms(count), *combinations(range(count), 2))


def quadratic_terms(count: int) -> tuple[Term, ...]:
    """The full second-order model: constant, linear, squares, products."""
    squares = tuple((i, i) for i in range(count))
    return (*linear_terms(count), *squares, *combinations(range(count), 2))


def term_name(term: Term, factors: Sequence[Factor]) -> str:
    """`A`, `A^2`, `A*B`; `constant` for the constant."""
    if not term:
        return "constant"
    if len(term) == 2 and term[0] == term[1]:
        return f"{factors[term[0]].name}^2"
    return "*".join(factors[i].name for i in term)


def model_matrix(points: Array, terms: Sequence[Term]) -> Array:
    """Values of the terms at points (n, k), (n, p)."""
    return np.column_stack(
        [np.prod(points[:, list(term)], axis=1) if term else np.ones(len(points)) for term in terms]
    )


def require_estimable(matrix: Array, names: Sequence[str]) -> None:
    """Raise StudyError, naming the terms, where runs cannot tell terms of a model apart."""
    n, p = matrix.shape
    if n <= p:
        raise StudyError(
            f"{n} runs cannot determine a model of {p} terms and its error; expected more runs "
            f"than terms. Add runs, or leave terms out."
        )
    _, singular, rows = np.linalg.svd(matrix, full_matrices=False)
    lost = rows[singular < 1e-9 * singular[0]]
    if not len(lost):
        return
    groups = [
        ", ".join(name for name, weight in zip(names, row, strict=True) if abs(weight) > 1e-6)
        for row in lost
    ]
    raise StudyError(
        f"the design aliases terms: it cannot tell apart {'; '.join(groups)}. Add runs that vary "
        f"them on their own, or leave all but one of each group out of the model."
    )
