"""Round soft cores in slit shells as finite element models: those that bend or lengthen."""

from __future__ import annotations

import numpy as np

from rig.mechanics.fe import (
    Discretisation,
    Model,
    PressureSurface,
    RigidBody,
    Solid,
    Support,
    discretise,
)
from rig.mechanics.fe.sliding import Sliding
from rig.mechanics.hyperelastic import (
    NeoHookean,
    QuadraticVolume,
    bulk_modulus_from,
    shear_modulus_from,
)
from rig.mechanics.mesh.slit_shell import ShellResolution, mesh_slit_shell
from rig.mechanics.shells import SlitShell
from rig.mechanics.simulate.bending import BendingModel, Layer, bending_model_on
from rig.mechanics.simulate.chambers import Items, LinearChamberModel
from rig.mechanics.simulate.energies import mixed_energies
from rig.spec.material import MaterialSpec
from rig.spec.shells import (
    ShellReinforcedBendingGeometry,
    ShellReinforcedGeometry,
    ShellReinforcedLinearGeometry,
)

_PENALTY = 100.0
"""Of the core's modulus over its wall: at 50 kPa the core sinks in by 0.6 % of its wall."""
_SOFTNESS = 1e-6
"""Over which contact sets in, metres: at rest core and shell press each other by 1 kPa."""
_SLIP = 5e-5
"""What sticking points creep, metres: a tenth of how far the core slides under its rings."""
_RIM = 2e-4
"""Over which pressure fades beyond a ring's edge, metres: twice the shell's thickness."""


def shell_bending_model(
    geometry: ShellReinforcedBendingGeometry,
    material: MaterialSpec,
    *,
    resolution: ShellResolution,
    items: Items | None = None,
    arc: bool = True,
) -> BendingModel:
    """A core whose shell is bonded to it along a strip below.

    Without weight, which bends it by 1 deg where it hangs: at rest nothing but the strip would hold
    the rings, and contact would begin open.
    """
    shape = SlitShell.of(geometry)
    body = mesh_slit_shell(shape, resolution)
    return bending_model_on(
        body,
        material,
        layer=Layer(body.shell, *_film(geometry)),
        items=items,
        interfaces=lambda d: [_sliding(d, geometry, material)],
        acceleration=(0.0, 0.0, 0.0),
        arc=arc,
    )


def _film(geometry: ShellReinforcedGeometry) -> tuple[NeoHookean, QuadraticVolume]:
    constants = geometry.shell_modulus, geometry.shell_poisson_ratio
    return NeoHookean(shear_modulus_from(*constants)), QuadraticVolume(
        bulk_modulus_from(*constants)
    )


def _sliding(
    d: Discretisation, geometry: ShellReinforcedGeometry, material: MaterialSpec
) -> Sliding:
    return Sliding(
        d,
        d.facets_on("core"),
        d.facets_on("lining"),
        penalty=_PENALTY * material.young_modulus.value / geometry.wall_thickness,
        friction=geometry.friction,
        direction=(1.0, 0.0, 0.0),
        reach=geometry.slit_width / 2,
        rim=_RIM,
        softness=_SOFTNESS,
        slip=_SLIP,
    )


def shell_linear_model(
    geometry: ShellReinforcedLinearGeometry, material: MaterialSpec, *, resolution: ShellResolution
) -> LinearChamberModel:
    """A core in a shell that slides all round; without weight, its cap free along the axis."""
    shape = SlitShell.of(geometry)
    body = mesh_slit_shell(shape, resolution, quarter=True)
    d = discretise(body.mesh)
    core = Solid(
        d,
        *mixed_energies(material),
        elements=np.setdiff1d(np.arange(len(d.connectivity)), body.shell),
    )
    model = Model(
        d,
        [core, Solid(d, *_film(geometry), elements=body.shell)],
        supports=[
            Support.of(d, d.nodes_on("clamped"), (0, 1, 2)),
            Support.of(d, d.nodes_on("symmetry"), (1,)),
            Support.of(d, d.nodes_on("floor"), (2,)),
        ],
        surface=PressureSurface(d, d.facets_on("cavity")),
        bodies=[RigidBody(d, d.nodes_on("cap"), free=("x",), centre=shape.cap_centre)],
        interfaces=[_sliding(d, geometry, material)],
    )
    return LinearChamberModel(model, material.density.value)
