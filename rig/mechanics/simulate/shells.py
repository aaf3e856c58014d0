"""Round soft cores in slit shells as finite element models: those that bend or lengthen."""

from __future__ import annotations

from rig.mechanics.fe import Discretisation, Options
from rig.mechanics.fe.sliding import Sliding
from rig.mechanics.mesh.slit_shell import ShellResolution, SlitShellMesh, mesh_slit_shell
from rig.mechanics.shells import SlitShell
from rig.mechanics.simulate.bending import BendingModel, bending_model_on
from rig.mechanics.simulate.linear import HeldLinearModel, LinearModel, linear_model_on
from rig.mechanics.simulate.solids import Items, Layer
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
BLOCKED_SHELL_OPTIONS = Options(
    correction=2e-5, iterations=8, first_step=0.35, least_step=1 / 32, alternate=False
)
"""Blocked, rings settle on the core up to a sixth of the pressure: steps that fail there need be
shorter, more or plain iterations do not help."""


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
    body = mesh_slit_shell(SlitShell.of(geometry), resolution)
    return bending_model_on(
        body,
        material,
        layer=_film(geometry, body),
        items=items,
        interfaces=lambda d: [_sliding(d, geometry, material)],
        acceleration=(0.0, 0.0, 0.0),
        arc=arc,
    )


def _film(geometry: ShellReinforcedGeometry, body: SlitShellMesh) -> Layer:
    return Layer.elastic(body.shell, geometry.shell_modulus, geometry.shell_poisson_ratio)


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
    geometry: ShellReinforcedLinearGeometry,
    material: MaterialSpec,
    *,
    resolution: ShellResolution,
    held: bool = False,
) -> LinearModel | HeldLinearModel:
    """A core in a shell that slides all round; without weight.

    Its cap is free along the axis, or `held`.
    """
    body = mesh_slit_shell(SlitShell.of(geometry), resolution, quarter=True)
    return linear_model_on(
        body,
        material,
        layer=_film(geometry, body),
        interfaces=lambda d: [_sliding(d, geometry, material)],
        held=held,
    )
