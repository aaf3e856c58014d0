"""What the camera measures of an actuator whose tip is free: how far it bends, or lengthens."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Deformation = Literal["bending", "elongation"]
"""What an actuator does under pressure; every geometry family says which."""
DeformationUnit = Literal["deg", "mm"]


@dataclass(frozen=True)
class Measurand:
    """A deformation as labs speak of it."""

    quantity: str
    """In prose."""
    unit: DeformationUnit
    per_si: float
    """Units per rad or metre."""
    decimals: int
    """That are worth showing while somebody watches."""


MEASURANDS: dict[Deformation, Measurand] = {
    "bending": Measurand("bending angle", "deg", 180 / math.pi, 1),
    "elongation": Measurand("elongation", "mm", 1e3, 2),
}
