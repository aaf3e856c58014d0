"""The axisymmetric bellow as a finite element model: its meridian, standing on its clamped base.

As in the paper (Auysakul et al., Actuators 12 (2023) 300, Section 3.2): axisymmetric, without
weight, pressure on the whole inner surface, displacement at the centre of the top. The pressure
follows the deforming surface, as air does; the paper's own tables were computed with a load that
does not, see docs/validation/auysakul2023.md.
"""

from __future__ import annotations

from dataclasses import dataclass

from rig.mechanics.fe import (
    Discretisation,
    Kinematics,
    Model,
    PressureSurface,
    Solid,
    Solution,
    discretise,
)
from rig.mechanics.fe.contact import Contact, Sampling
from rig.mechanics.fe.obstacles import Obstacle, Plane
from rig.mechanics.mesh.bellow_axisymmetric import (
    AxisymmetricBellow,
    AxisymmetricResolution,
    mesh_axisymmetric_bellow,
)
from rig.mechanics.simulate.energies import mixed_energies
from rig.mechanics.simulate.meridian import MeridianModel, supports_of
from rig.spec.actuator import BellowAxisymmetricGeometry
from rig.spec.material import MaterialSpec

_PENALTY = 25.0
"""Of Young's modulus over the top's radius: at 40 kPa the object sinks in by 0.1 mm where the
bellow moves by 15. Multipliers would hold it off at several times the time."""
_TOLERANCE = 1e-5


@dataclass(frozen=True)
class AxisymmetricModel(MeridianModel):
    """The whole actuator, with what turns its state into elongation."""

    shape: AxisymmetricBellow
    top_centre: int
    """Node in the middle of the top's outer face."""
    bellows: int = 1
    """So many of them are inflated together."""

    def measures(self, solution: Solution) -> dict[str, float]:
        """Displacement (rise of the top's centre) and volume; it does not bend."""
        d = self.model.discretisation
        return {
            "displacement": float(solution.state.x[d.dim * self.top_centre + 1]),
            "volume": self.bellows * solution.volume,
        }


@dataclass(frozen=True)
class PressedModel(MeridianModel):
    """The whole actuator under a rigid, smooth plate that touches its top at rest."""

    contact: Contact

    def measures(self, solution: Solution) -> dict[str, float]:
        """Force on the plate in N and volume."""
        return {
            "force": -float(self.contact.touch(solution.state.x).force[-1]),
            "volume": solution.volume,
        }


def axisymmetric_model(
    geometry: BellowAxisymmetricGeometry,
    material: MaterialSpec,
    *,
    resolution: AxisymmetricResolution | None = None,
    follower: bool = True,
) -> AxisymmetricModel:
    """Mesh the meridian and put its model together.

    The default resolution is `level(1)`: about 0.6 % from the limit of refinement with half
    circles at 50 kPa, less with flatter arcs. `follower` false keeps the pressure's forces as
    they are on the undeformed surface. Raises MechanicsError for a material without a volumetric
    energy.
    """
    shape = AxisymmetricBellow.of(geometry)
    d, soft = soft_meridian(shape, material, resolution or AxisymmetricResolution.level(1))
    model = Model(
        d,
        [soft],
        supports=supports_of(d),
        surface=PressureSurface(d, d.facets_on("cavity"), follower=follower),
    )
    (top_centre,) = d.nodes_at(r=0.0, z=shape.height)
    return AxisymmetricModel(model, soft, material.density.value, shape, int(top_centre))


def pressed_model(
    geometry: BellowAxisymmetricGeometry,
    material: MaterialSpec,
    *,
    resolution: AxisymmetricResolution | None = None,
) -> PressedModel:
    """The model with a plate over its top; arguments and errors as in `axisymmetric_model`."""
    shape = AxisymmetricBellow.of(geometry)
    d, soft = soft_meridian(shape, material, resolution or AxisymmetricResolution.level(1))
    contact = top_contact(d, Plane((0.0, shape.height), (0.0, -1.0)), geometry, material)
    return PressedModel(model_against(d, soft, contact), soft, material.density.value, contact)


def soft_meridian(
    shape: AxisymmetricBellow, material: MaterialSpec, resolution: AxisymmetricResolution
) -> tuple[Discretisation, Solid]:
    """The meshed meridian; raises MechanicsError for a material without a volumetric energy."""
    d = discretise(mesh_axisymmetric_bellow(shape, resolution).mesh, Kinematics.AXISYMMETRIC)
    return d, Solid(d, *mixed_energies(material))


def top_contact(
    d: Discretisation,
    obstacle: Obstacle,
    geometry: BellowAxisymmetricGeometry,
    material: MaterialSpec,
) -> Contact:
    """Contact without friction of the top's outer face with an obstacle, by a penalty."""
    return Contact(
        Sampling.of_facets(d, d.facets_on("top")),
        obstacle,
        penalty=_PENALTY * material.young_modulus.value / (geometry.top_diameter / 2),
        tolerance=_TOLERANCE,
    )


def model_against(d: Discretisation, soft: Solid, contact: Contact) -> Model:
    """The meridian, inflated against what is in contact with it."""
    return Model(
        d,
        [soft],
        supports=supports_of(d),
        surface=PressureSurface(d, d.facets_on("cavity")),
        items=[contact],
    )
