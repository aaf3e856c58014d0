"""The gripper of two axisymmetric bellows: what it takes to pull a rigid object out of it.

Auysakul et al. (Actuators 12 (2023) 300), Section 6.2, measure that force. Here each bellow is
inflated against the object by contact elements without friction; then Coulomb's law is applied to
the pressure between them. Where the object slides as a whole in the direction e, each point with
the normal n resists by mu p along the projection of e on the surface, so that

    F = 2 mu int p sqrt(1 - (n . e)^2) dA,

of two bellows. The pressure's own component along e cancels by symmetry as long as the imprint is
that of an object that was not moved. A bellow that shears aside, peels off or sticks by adhesion is
not in it.

Cubes and spheres keep the axisymmetry of the bellow, the pull alone has a direction. The cylinder
does not: it is pressed by a quarter of the bellow in space, whose top has a small hole on the axis.
The object touches the top's outer face only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ellipe

from rig.mechanics.fe import (
    Model,
    PressureSurface,
    Solid,
    Solution,
    Support,
    discretise,
)
from rig.mechanics.fe.contact import Contact
from rig.mechanics.fe.obstacles import Cylinder, Obstacle, Plane, Sphere
from rig.mechanics.mesh.bellow_axisymmetric import (
    AxisymmetricBellow,
    AxisymmetricResolution,
    mesh_bellow_quarter,
)
from rig.mechanics.simulate.axisymmetric import (
    AxisymmetricModel,
    axisymmetric_model,
    model_against,
    soft_meridian,
    top_contact,
)
from rig.mechanics.simulate.energies import mixed_energies
from rig.spec.actuator import BellowGripperGeometry
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]

FINGERS = 2
_SPACE = AxisymmetricResolution(wall=1, half_arc=2, collar=1, top=1, top_radius=4)
_AROUND = 5
_HOLE = 1e-3


@dataclass(frozen=True)
class GripModel:
    """One bellow against the object."""

    model: Model
    contact: Contact
    friction: float
    share: int
    """Bellows that the model stands for: 1 whole, 4 of a quarter."""
    mirror: None = None
    """Nothing is mirrored."""

    def measures(self, solution: Solution) -> dict[str, float]:
        """Force that pulls the object out in N, force that presses it on one side in N, the area of
        one side in contact in m2, undeformed, and the volume of both bellows."""
        x = solution.state.x
        touch = self.contact.touch(x)
        return {
            "force": FINGERS * self.friction * self.share * self._grip(x),
            "normal_force": -self.share * float(touch.force[-1]),
            "contact_area": self.share * touch.area,
            "volume": FINGERS * self.share * solution.volume,
        }

    def _grip(self, x: Array) -> float:
        """int p sqrt(1 - (n . e)^2) dA in N, e along y: across the bellow's axis."""
        sampling = self.contact.sampling
        places = sampling.places(x).reshape(-1, sampling.place.shape[2])
        gap, normal, _ = self.contact.obstacle.distance(places)
        pressure = self.contact.penalty * np.maximum(-gap, 0.0)
        if places.shape[1] == 3:
            slides = np.sqrt(1 - normal[:, 1] ** 2)
        else:
            # mean over the turn of sqrt(1 - n_r^2 cos^2)
            slides = 2 / np.pi * ellipe(normal[:, 0] ** 2)
        return float(np.sum(sampling.weights.reshape(-1) * pressure * slides))


def finger_model(
    geometry: BellowGripperGeometry,
    material: MaterialSpec,
    *,
    resolution: AxisymmetricResolution | None = None,
) -> AxisymmetricModel:
    """One bellow without an object; the volume is that of both."""
    finger = axisymmetric_model(geometry.finger, material, resolution=resolution)
    return replace(finger, bellows=FINGERS)


def grip_model(
    geometry: BellowGripperGeometry,
    material: MaterialSpec,
    *,
    in_space: bool | None = None,
    resolution: AxisymmetricResolution | None = None,
) -> GripModel:
    """One bellow against the object.

    `in_space` tells whether by a quarter in space; by default only where it must be. Raises
    MechanicsError for a material without a volumetric energy.
    """
    spatial = geometry.held == "cylinder" if in_space is None else in_space
    if spatial:
        return _quarter(geometry, material, resolution or _SPACE)
    return _whole(geometry, material, resolution or AxisymmetricResolution.level(0))


def _whole(
    geometry: BellowGripperGeometry, material: MaterialSpec, resolution: AxisymmetricResolution
) -> GripModel:
    d, soft = soft_meridian(AxisymmetricBellow.of(geometry.finger), material, resolution)
    contact = top_contact(d, _obstacle(geometry, dim=2), geometry.finger, material)
    return GripModel(model_against(d, soft, contact), contact, geometry.friction, share=1)


def _quarter(
    geometry: BellowGripperGeometry, material: MaterialSpec, resolution: AxisymmetricResolution
) -> GripModel:
    mesh = mesh_bellow_quarter(AxisymmetricBellow.of(geometry.finger), resolution, _AROUND, _HOLE)
    d = discretise(mesh)
    contact = top_contact(d, _obstacle(geometry, dim=3), geometry.finger, material)
    model = Model(
        d,
        [Solid(d, *mixed_energies(material))],
        supports=[
            Support.of(d, d.nodes_on("clamped"), (0, 1, 2)),
            Support.of(d, d.nodes_on("y=0"), (1,)),
            Support.of(d, d.nodes_on("x=0"), (0,)),
        ],
        surface=PressureSurface(d, d.facets_on("cavity")),
        items=[contact],
    )
    return GripModel(model, contact, geometry.friction, share=4)


def _obstacle(geometry: BellowGripperGeometry, dim: int) -> Obstacle:
    """The object above the finger's top; a cylinder lies along y, which is upright."""
    face, radius = geometry.finger.height + geometry.clearance, geometry.object_size / 2
    axis = [0.0] * (dim - 1)
    match geometry.held:
        case "cube":
            return Plane((*axis, face), (*axis, -1.0))
        case "sphere":
            return Sphere((*axis, face + radius), radius)
        case "cylinder":
            return Cylinder((0.0, 0.0, face + radius), (0.0, 1.0, 0.0), radius)
