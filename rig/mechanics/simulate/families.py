"""Geometry families that have a finite element model, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rig.mechanics.simulate.axisymmetric import axisymmetric_model
from rig.mechanics.simulate.bending import bending_model
from rig.mechanics.simulate.free import ActuatorModel
from rig.spec.material import MaterialSpec

MODELS: dict[str, Callable[[Any, MaterialSpec], ActuatorModel]] = {
    "bellow-axisymmetric": axisymmetric_model,
    "bellow-bending": bending_model,
}
"""Geometry and material to the model, by family."""
