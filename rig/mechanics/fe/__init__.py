"""Nonlinear finite elements for soft actuators: mixed solids, cavity pressure, rigid parts.

d = discretise(mesh)
solid = Solid(d, NeoHookean(mu), QuadraticVolume(kappa))
wall = PressureSurface(d, d.facets_on("cavity"))
model = Model(d, [solid], supports=[Support.of(d, d.nodes_on("clamp"), (0, 1, 2))], surface=wall)
result = follow(model, [Point(p) for p in pressures])
"""

from rig.mechanics.fe.control import (
    AngleControl,
    Control,
    DisplacementControl,
    PressureControl,
    VolumeControl,
)
from rig.mechanics.fe.discretisation import Discretisation, Kinematics, discretise
from rig.mechanics.fe.errors import FiniteElementError, MeshError
from rig.mechanics.fe.extremes import Extremes, Peak, summarise
from rig.mechanics.fe.fields import Fields, NodalFields, nodal_fields
from rig.mechanics.fe.loads import gravity, traction
from rig.mechanics.fe.model import Model, Support
from rig.mechanics.fe.newton import Options
from rig.mechanics.fe.path import Point, Progress, Result, Solution, follow
from rig.mechanics.fe.pressure import PressureSurface
from rig.mechanics.fe.rigid import RigidBody
from rig.mechanics.fe.rotation import rotation_vector
from rig.mechanics.fe.solid import Solid
from rig.mechanics.fe.state import Pose, State

__all__ = [
    "AngleControl",
    "Control",
    "Discretisation",
    "DisplacementControl",
    "Extremes",
    "Fields",
    "FiniteElementError",
    "Kinematics",
    "MeshError",
    "Model",
    "NodalFields",
    "Options",
    "Peak",
    "Point",
    "Pose",
    "PressureControl",
    "PressureSurface",
    "Progress",
    "Result",
    "RigidBody",
    "Solid",
    "Solution",
    "State",
    "Support",
    "VolumeControl",
    "discretise",
    "follow",
    "gravity",
    "nodal_fields",
    "rotation_vector",
    "summarise",
    "traction",
]
