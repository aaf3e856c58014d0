"""Geometry families that have a finite element model, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from rig.mechanics.fe import Options
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricResolution
from rig.mechanics.mesh.bellow_bending import BendingResolution
from rig.mechanics.mesh.bellow_joint import JointResolution
from rig.mechanics.mesh.chamber_row import RowResolution
from rig.mechanics.mesh.slit_shell import ShellResolution
from rig.mechanics.simulate.axisymmetric import axisymmetric_model, pressed_model
from rig.mechanics.simulate.bending import FREE_OPTIONS, bending_model
from rig.mechanics.simulate.blocked import BLOCKED_OPTIONS, Blocked
from rig.mechanics.simulate.chambers import (
    multi_chamber_bending_model,
    multi_chamber_linear_model,
    rectangular_bellow_model,
)
from rig.mechanics.simulate.gripper import finger_model, grip_model
from rig.mechanics.simulate.inflation import ActuatorModel
from rig.mechanics.simulate.joint import held_joint_model, joint_model
from rig.mechanics.simulate.shells import (
    BLOCKED_SHELL_OPTIONS,
    shell_bending_model,
    shell_linear_model,
)
from rig.spec.material import MaterialSpec

Build = Callable[[Any, MaterialSpec], ActuatorModel]
"""Geometry and material to the model."""


@dataclass(frozen=True)
class Meshing:
    """The experiments of an actuator on meshes of one fineness."""

    free: Build
    """Tip free."""
    blocked: Build
    """Tip held by a stop, whose force is a measure."""
    free_options: Options = field(default_factory=Options)
    blocked_options: Options = field(default_factory=Options)
    """Newton's method for either."""


@dataclass(frozen=True)
class Family:
    """How the actuators of one geometry family are modelled."""

    model: Meshing
    """As predictions are made."""
    specimen: Meshing
    """Coarser, for the virtual specimen: it must not be the model that is validated."""


def _bending(build: Any, resolution: object, blocked: Options = BLOCKED_OPTIONS) -> Meshing:
    """Free and blocked models of what `build` makes at a resolution."""
    at_resolution = partial(build, resolution=resolution)
    return Meshing(at_resolution, Blocked(at_resolution), FREE_OPTIONS, blocked)


def _linear(build: Any, resolution: object) -> Meshing:
    """The same of an actuator that lengthens, whose cap is held by a keyword."""
    at_resolution = partial(build, resolution=resolution)
    return Meshing(at_resolution, partial(at_resolution, held=True))


def _meridian(build: Any, build_held: Any, resolution: object) -> Meshing:
    """The same of a body of revolution."""
    return Meshing(
        partial(build, resolution=resolution), partial(build_held, resolution=resolution)
    )


_BENDING = BendingResolution(wall=1)
"""Half the time of two elements through the wall, for 0.24 % of the angle at 10 kPa (1 % at 2 kPa):
docs/theory/finite-elements.md, "Refinement and speed"."""
_COARSE_BENDING = BendingResolution(wall=1, crown=4)

_BELLOWS = RowResolution(along=2.5e-3, across=5e-3)
"""0.3 % of one bellow's angle from a mesh of three times as many: docs/validation/chambers.md."""
_COARSE_BELLOWS = RowResolution(along=5e-3, across=7e-3)
_BLOCK = RowResolution(along=3.6e-3, across=3.6e-3)
"""1.5 % of the angle at 12.5 kPa below a mesh of 2.4 mm across, for a fifth of its time."""
_COARSE_BLOCK = RowResolution(along=3.6e-3, across=3.6e-3, through=1)
_QUARTER = RowResolution(along=3.6e-3, across=2.4e-3)
_COARSE_QUARTER = RowResolution(along=3.6e-3, across=3.6e-3)
_MERIDIAN = AxisymmetricResolution.level(1)
_COARSE_MERIDIAN = AxisymmetricResolution.level(0)
_COARSE_GRIP = AxisymmetricResolution(wall=1, half_arc=2, collar=1, top=1, top_radius=3)
_COARSE_JOINT = JointResolution(wall=2, fifth=3)
_COARSE_SHELL = ShellResolution(ring=1, slit=1, around=6, wall=1)

FAMILIES: dict[str, Family] = {
    "bellow-axisymmetric": Family(
        model=_meridian(axisymmetric_model, pressed_model, _MERIDIAN),
        specimen=_meridian(axisymmetric_model, pressed_model, _COARSE_MERIDIAN),
    ),
    "bellow-gripper": Family(
        model=Meshing(finger_model, grip_model),
        specimen=Meshing(
            partial(finger_model, resolution=_COARSE_MERIDIAN),
            partial(grip_model, resolution=_COARSE_GRIP),
        ),
    ),
    "bellow-joint": Family(
        model=_meridian(joint_model, held_joint_model, None),
        specimen=_meridian(joint_model, held_joint_model, _COARSE_JOINT),
    ),
    "bellow-bending": Family(
        model=_bending(bending_model, _BENDING),
        specimen=_bending(bending_model, _COARSE_BENDING),
    ),
    "bellow-rectangular": Family(
        model=_bending(rectangular_bellow_model, _BELLOWS),
        specimen=_bending(rectangular_bellow_model, _COARSE_BELLOWS),
    ),
    "multi-chamber-bending": Family(
        model=_bending(multi_chamber_bending_model, _BLOCK),
        specimen=_bending(multi_chamber_bending_model, _COARSE_BLOCK),
    ),
    "multi-chamber-linear": Family(
        model=_linear(multi_chamber_linear_model, _QUARTER),
        specimen=_linear(multi_chamber_linear_model, _COARSE_QUARTER),
    ),
    "shell-reinforced-bending": Family(
        model=_bending(shell_bending_model, ShellResolution(), BLOCKED_SHELL_OPTIONS),
        specimen=_bending(shell_bending_model, _COARSE_SHELL, BLOCKED_SHELL_OPTIONS),
    ),
    "shell-reinforced-linear": Family(
        model=_linear(shell_linear_model, ShellResolution()),
        specimen=_linear(shell_linear_model, _COARSE_SHELL),
    ),
}
"""Families that have a finite element model, by name."""
