"""Numbers in words of the report: digits that match the uncertainty, units, names."""

from __future__ import annotations

import math

MODEL_NAMES = {"beam": "beam theory", "fe": "finite elements"}
NO_BREAK = "\N{NO-BREAK SPACE}"
MINUS = "\N{MINUS SIGN}"
MANY_DEGREES_OF_FREEDOM = 1000
"""Student's factor is then that of the normal distribution to two parts in a thousand."""
PLUS_MINUS = "\N{PLUS-MINUS SIGN}"


def model_name(model: str) -> str:
    """A model's name in prose."""
    return MODEL_NAMES.get(model, model)


def number(value: float | None, decimals: int) -> str:
    """Fixed decimals with a true minus sign; a dash for None."""
    if value is None:
        return "\N{EN DASH}"
    text = f"{value:.{decimals}f}"
    if float(text) == 0:
        text = text.removeprefix("-")
    return text.replace("-", MINUS)


def decimals_for(u: float) -> int:
    """Decimals that show two significant digits of an uncertainty; 2 if there is none."""
    if not u > 0:
        return 2
    return min(6, max(0, 1 - math.floor(math.log10(u))))


def uncertain(value: float, u95: float, unit: str = "") -> str:
    """`9.12 ± 0.28 deg`: two digits of uncertainty, the value to the same decimals."""
    decimals = decimals_for(u95)
    parts = [number(value, decimals), PLUS_MINUS, number(u95, decimals), unit]
    return NO_BREAK.join(part for part in parts if part)


def significant(value: float, digits: int = 3) -> str:
    """A number with so many significant digits and no exponent in the common range."""
    if value == 0:
        return "0"
    if not 1e-4 <= abs(value) < 1e6:
        return f"{value:.{digits - 1}e}".replace("-", MINUS)
    return number(value, max(0, digits - 1 - math.floor(math.log10(abs(value)))))


def freedom(dof: float | None) -> str:
    """Degrees of freedom, rounded down as tables of t want it; infinite for None or very many."""
    if dof is None or dof > MANY_DEGREES_OF_FREEDOM:
        return "\N{INFINITY}"
    return str(math.floor(dof + 1e-9))


def duration(seconds: float) -> str:
    """Bench time in minutes, or hours from two on."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 120 else f"{minutes / 60:.1f} h"


def count(how_many: int, noun: str) -> str:
    """`1 point`, `2 points`."""
    return f"{how_many} {noun}" if how_many == 1 else f"{how_many} {noun}s"
