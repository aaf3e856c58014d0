"""An actuator that bends as a finite element model: half by symmetry, hanging from its connector.

The connector's face holds the soft end wall; the end cap is an exact rigid body. Both follow the
toolbox's model of the bending bellow (Yao, He and Maiolino, Section IV-B): neo-Hookean unless the
material says otherwise, mixed in pressure, follower pressure in the cavity, gravity along the axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe import (
    Model,
    Options,
    PressureSurface,
    RigidBody,
    Solid,
    Solution,
    State,
    Support,
    discretise,
    gravity,
)
from rig.mechanics.fe.coordinates import Bending
from rig.mechanics.mesh.bellow_bending import BendingResolution, mesh_bending_bellow
from rig.mechanics.simulate.flanks import Flanks
from rig.mechanics.simulate.shape import BendingBody, BendingShape
from rig.mechanics.simulate.solids import Items, Layer, MakeInterfaces, solids_of
from rig.spec.actuator import BellowBendingGeometry
from rig.spec.material import MaterialSpec
from rig.spec.quantity import STANDARD_GRAVITY

Array = NDArray[np.float64]

HANGING = (STANDARD_GRAVITY, 0.0, 0.0)
"""Gravity of an actuator that hangs from its connector, m/s2: along x, towards the tip."""
FREE_OPTIONS = Options(correction=2e-5, first_step=0.35)
"""The tip moves some 60 mm: corrections below 1 um change its angle by 0.001 deg. The
actuator is softest at first: a short step there leaves something to extrapolate from."""


@dataclass(frozen=True)
class BendingModel:
    """Half of the actuator (y >= 0), with what turns its state into angles and volumes."""

    model: Model
    soft: Solid
    shape: BendingShape
    density: float
    """Of the soft material in kg/m3."""
    acceleration: tuple[float, float, float]
    """Gravity in m/s2."""
    mirror: int = 1
    """The plane of symmetry is y = 0."""

    @property
    def planes(self) -> Mapping[str, int]:
        """Boundaries on planes of symmetry, to the component of displacement that they hold."""
        return {"symmetry": 1}

    def angle(self, state: State) -> float:
        """Bending angle in rad: the end cap against the connector."""
        return float(state.poses[0].angles[1])

    def tip(self, state: State) -> Array:
        """The cap's far lower edge, (2,) as (x, z) in m."""
        body, pose = self.model.bodies[0], state.poses[0]
        edge = np.array([self.shape.tip, 0.0, self.shape.underside])
        moved = body.centre + pose.shift + pose.rotation @ (edge - body.centre)
        return np.asarray(moved[[0, 2]])

    def displacement(self, state: State) -> float:
        """Length difference in m between the fibres under the cavity's roof and at the underside.

        The end faces stay plane, so it is the angle times the distance of these fibres.
        """
        return self.angle(state) * self.shape.fibre_distance

    def volume(self, solution: Solution) -> float:
        """Volume of the whole cavity in m3."""
        return 2 * solution.volume

    @cached_property
    def flanks(self) -> Flanks:
        """What watches the folds of outside and cavity."""
        shape = self.shape
        return Flanks(self.model.discretisation, between=shape.gap, wall=shape.wall)

    def measures(self, solution: Solution) -> dict[str, float]:
        """Angle, displacement and volume, as `Response` has them; the gap between flanks in m."""
        return {
            "angle": self.angle(solution.state),
            "displacement": self.displacement(solution.state),
            "volume": self.volume(solution),
            "flank_gap": self.flanks.gap(solution.state),
        }


def bending_model(
    geometry: BellowBendingGeometry,
    material: MaterialSpec,
    *,
    resolution: BendingResolution | None = None,
    acceleration: tuple[float, float, float] = HANGING,
    cap_density: float | None = None,
    items: Items | None = None,
    arc: bool = True,
) -> BendingModel:
    """Mesh the actuator and put its model together.

    `acceleration` is gravity in m/s2. The paper is silent about the cap's material; its weight is
    that of `cap_density` in kg/m3, by default the soft material's: both are printed photopolymers.
    `items` makes what acts on the model beside pressure and weight, such as a stop for its tip.
    `arc` lets steps follow the cap's rotation, which pays where nothing keeps the tip.
    Raises MechanicsError for a material without a volumetric energy.
    """
    return bending_model_on(
        mesh_bending_bellow(geometry, resolution),
        material,
        acceleration=acceleration,
        cap_density=cap_density,
        items=items,
        arc=arc,
    )


def bending_model_on(
    body: BendingBody,
    material: MaterialSpec,
    *,
    layer: Layer | None = None,
    mixed: bool = True,
    order: int | None = None,
    acceleration: tuple[float, float, float] = HANGING,
    cap_density: float | None = None,
    items: Items | None = None,
    interfaces: MakeInterfaces | None = None,
    arc: bool = True,
) -> BendingModel:
    """The same on a mesh that is there already, where some elements may be of another material.

    `mixed` and `order` as `discretise` takes them.
    """
    d = discretise(body.mesh, mixed=mixed, order=order)
    density = material.density.value
    solids = solids_of(d, material, layer)
    shape = body.shape
    weight = shape.cap_mass(density if cap_density is None else cap_density) / 2
    cap = d.nodes_on("cap")
    end = RigidBody(
        d,
        cap,
        free=("x", "z", "about_y"),
        centre=shape.cap_centre,
        weight=weight * np.array(acceleration),
    )
    model = Model(
        d,
        solids,
        supports=[
            Support.of(d, d.nodes_on("clamped"), (0, 1, 2)),
            Support.of(d, d.nodes_on("symmetry"), (1,)),
        ],
        surface=PressureSurface(d, d.facets_on("cavity")),
        dead_load=sum(
            (gravity(solid, density, np.array(acceleration)) for solid in solids),
            start=np.zeros(d.size),
        ),
        bodies=[end],
        items=items(d, shape) if items is not None else (),
        interfaces=interfaces(d) if interfaces is not None else (),
        coordinates=Bending(d, end, shape.start, shape.end, height=shape.underside)
        if arc
        else None,
    )
    return BendingModel(model, solids[0], shape, density, acceleration)
