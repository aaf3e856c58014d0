"""Two designs beside each other: what was typed differently, and what comes of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig.studio.curves import Array, Curve
from rig.studio.design import LIMIT, Draft, form_fields

NONE = "-"


@dataclass(frozen=True)
class Design:
    """A draft and what a model says of it."""

    draft: Draft
    curve: Curve
    mass_g: float | None
    """Of the soft part; None where nothing knows it."""


@dataclass(frozen=True)
class Row:
    """One line of the comparison."""

    what: str
    pinned: str
    now: str


def compared(pinned: Design, now: Design) -> tuple[Row, ...]:
    """Parameters that differ, then figures at the highest pressure that both curves reach."""
    return (*_typed(pinned.draft, now.draft), *_figures(pinned, now))


def _typed(pinned: Draft, now: Draft) -> Iterator[Row]:
    if pinned.family != now.family:
        yield Row("family", pinned.family, now.family)
    if pinned.material != now.material:
        yield Row("material", pinned.material, now.material)
    shown = {LIMIT: ("pressure limit", "kPa")}
    for family in (pinned.family, now.family):
        shown |= {item.name: (item.label, item.unit) for item in form_fields(family)}
    for name, (label, unit) in shown.items():
        before, after = (_value(draft.values.get(name, NONE), unit) for draft in (pinned, now))
        if before != after:
            yield Row(label, before, after)


def _value(text: str, unit: str) -> str:
    """What was typed, a bare number with the unit that it is taken in."""
    text = text.strip()
    try:
        float(text)
    except ValueError:
        return text
    return f"{text} {unit}".strip()


def _figures(pinned: Design, now: Design) -> Iterator[Row]:
    one, other = pinned.curve, now.curve
    top = min(float(one.pressure_kpa[-1]), float(other.pressure_kpa[-1]))
    at = f"at {top:.3g} kPa"
    for what, first, second, unit in (
        ("bending angle", one.angle_deg, other.angle_deg, "deg"),
        ("blocked force", one.force_g, other.force_g, "g"),
        ("displacement", one.displacement_mm, other.displacement_mm, "mm"),
    ):
        yield Row(f"{what} {at}", _at(one, first, top, unit), _at(other, second, top, unit))
    yield Row(
        "highest pressure",
        f"{one.pressure_kpa[-1]:.3g} kPa",
        f"{other.pressure_kpa[-1]:.3g} kPa",
    )
    yield Row("mass of the soft part", _mass(pinned), _mass(now))


def _at(curve: Curve, values: Array | None, pressure_kpa: float, unit: str) -> str:
    if values is None:
        return NONE
    return f"{float(np.interp(pressure_kpa, curve.pressure_kpa, values)):.1f} {unit}"


def _mass(design: Design) -> str:
    return NONE if design.mass_g is None else f"{design.mass_g:.1f} g"
