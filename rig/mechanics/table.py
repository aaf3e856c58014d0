"""Responses as the table that `rig predict` prints and writes: field units, one row a pressure."""

from __future__ import annotations

import numpy as np

from rig.mechanics.response import Array, Response
from rig.spec.quantity import STANDARD_GRAVITY

COLUMNS = (
    "model",
    "pressure_kpa",
    "angle_deg",
    "displacement_mm",
    "blocked_force_g",
    "volume_ml",
    "max_von_mises_kpa",
)

GRAM_FORCE = 1e-3 * STANDARD_GRAVITY
"""Newtons in a gram-force."""

_ROUND = (1, 2, 3, 4, 5, 6, 8)
"""Steps that people count in, up to a power of ten."""

Row = tuple[str, *tuple[float | None, ...]]
"""Model name and its figures, in the order of `COLUMNS`."""


def round_pressures(limit: float) -> Array:
    """Ten equal round steps from zero to `limit` in Pa or a little below, (11,)."""
    decade = 10 ** np.floor(np.log10(limit / 10))
    step = max(n * decade for n in _ROUND if n * decade <= limit / 10 * (1 + 1e-9))
    return np.asarray(step * np.arange(11.0))


def rows(response: Response) -> list[Row]:
    """One row a pressure in the order of `COLUMNS`; None where the model has no such quantity."""
    columns = (
        response.pressure / 1e3,
        _scaled(response.angle, float(np.degrees(1.0))),
        response.displacement * 1e3,
        _scaled(response.blocked_force, 1 / GRAM_FORCE),
        response.volume * 1e6,
        _scaled(response.max_von_mises, 1e-3),
    )
    return [
        (response.model, *(None if column is None else float(column[i]) for column in columns))
        for i in range(response.pressure.size)
    ]


def _scaled(values: Array | None, factor: float) -> Array | None:
    return None if values is None else values * factor
