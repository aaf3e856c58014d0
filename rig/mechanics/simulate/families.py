"""Geometry families that have a finite element model, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from rig.mechanics.fe import Options
from rig.mechanics.mesh.bellow_bending import BendingResolution
from rig.mechanics.simulate.axisymmetric import axisymmetric_model
from rig.mechanics.simulate.bending import FREE_OPTIONS, bending_model
from rig.mechanics.simulate.blocked import BLOCKED_OPTIONS, blocked_bending_model
from rig.mechanics.simulate.gripper import finger_model, grip_model
from rig.mechanics.simulate.inflation import ActuatorModel
from rig.mechanics.simulate.joint import joint_model
from rig.spec.material import MaterialSpec

Build = Callable[[Any, MaterialSpec], ActuatorModel]
"""Geometry and material to the model."""


@dataclass(frozen=True)
class Meshing:
    """The experiments of an actuator on meshes of one fineness."""

    free: Build
    """Tip free."""
    blocked: Build | None = None
    """Tip held by a stop, whose force is a measure; None where the family has no such thing."""
    free_options: Options = field(default_factory=Options)
    blocked_options: Options = field(default_factory=Options)
    """Newton's method for either."""


@dataclass(frozen=True)
class Family:
    """How the actuators of one geometry family are modelled."""

    model: Meshing
    """As predictions are made."""
    specimen: Meshing | None = None
    """Coarser, for the virtual specimen: it must not be the model that is validated. None of a
    family that no bench measures yet."""


_BENDING = BendingResolution(wall=1)
"""Half the time of two elements through the wall, for 0.24 % of the angle at 10 kPa (1 % at 2 kPa):
docs/theory/finite-elements.md, "Refinement and speed"."""
_COARSE_BENDING = BendingResolution(wall=1, crown=4)

FAMILIES: dict[str, Family] = {
    "bellow-axisymmetric": Family(model=Meshing(axisymmetric_model)),
    "bellow-gripper": Family(model=Meshing(finger_model, grip_model)),
    "bellow-joint": Family(model=Meshing(joint_model)),
    "bellow-bending": Family(
        model=Meshing(
            partial(bending_model, resolution=_BENDING),
            partial(blocked_bending_model, resolution=_BENDING),
            FREE_OPTIONS,
            BLOCKED_OPTIONS,
        ),
        specimen=Meshing(
            partial(bending_model, resolution=_COARSE_BENDING),
            partial(blocked_bending_model, resolution=_COARSE_BENDING),
            FREE_OPTIONS,
            BLOCKED_OPTIONS,
        ),
    ),
}
"""Families that have a finite element model, by name."""
