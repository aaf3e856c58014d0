"""Designs as coded points, by pyDOE and scipy's quasi-Monte Carlo."""

from __future__ import annotations

import numpy as np

from rig.spec.study import (
    BoxBehnkenDesign,
    CentralCompositeDesign,
    Design,
    FractionalFactorialDesign,
    FullFactorialDesign,
)
from rig.study.errors import StudyError
from rig.study.factors import Array

MOST_POINTS = 100_000


def coded_points(design: Design, count: int) -> Array:
    """Points of a design in `count` factors, (n, count); levels are -1 and +1.

    Raises StudyError for designs that are too large or that generators do not make.
    """
    if isinstance(design, FullFactorialDesign) and design.levels**count > MOST_POINTS:
        raise StudyError(
            f"{design.levels} levels of {count} factors are {design.levels**count} points; "
            f"expected at most {MOST_POINTS}. Take a fraction, or a space-filling design."
        )
    import pydoe
    from scipy.stats import qmc

    match design:
        case BoxBehnkenDesign():
            points = pydoe.bbdesign(count, center=design.centre_points)
        case CentralCompositeDesign():
            points = pydoe.ccdesign(count, center=(0, design.centre_points), face=design.face)
        case FullFactorialDesign():
            levels = pydoe.fullfact([design.levels] * count)
            points = 2 * levels / (design.levels - 1) - 1
        case FractionalFactorialDesign():
            points = np.vstack(
                [_fraction(design.generators), np.zeros((design.centre_points, count))]
            )
        case _:
            if design.points > MOST_POINTS:
                raise StudyError(f"{design.points} points are too many; at most {MOST_POINTS}.")
            rng = np.random.default_rng(design.seed)
            if design.kind == "sobol":  # scipy warns of counts that are no power of two
                whole = qmc.Sobol(count, rng=rng).random(power_of_two(design.points))
            else:
                whole = qmc.LatinHypercube(count, rng=rng).random(design.points)
            points = 2 * whole[: design.points] - 1
    return np.asarray(points, dtype=np.float64)


def power_of_two(count: int) -> int:
    """The least one that is not below `count`: so many points of a Sobol sequence are balanced."""
    return 1 << (count - 1).bit_length()


def _fraction(generators: str) -> Array:
    import pydoe

    try:
        return np.asarray(pydoe.fracfact(generators), dtype=np.float64)
    except (ValueError, IndexError, KeyError) as error:
        raise StudyError(
            f"the generators '{generators}' make no design: {error}. Expected single letters for "
            f"the factors that vary freely and words of them for the others, as 'a b c abc'."
        ) from None
