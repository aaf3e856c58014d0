"""The axisymmetric bellow as a finite element model: its meridian, standing on its clamped base.

As in the paper (Auysakul et al., Actuators 12 (2023) 300, Section 3.2): axisymmetric, without
weight, pressure on the whole inner surface, displacement at the centre of the top. The pressure
follows the deforming surface, as air does; the paper's own tables were computed with a load that
does not, see docs/validation/auysakul2023.md.
"""

from __future__ import annotations

from dataclasses import dataclass

from rig.mechanics.fe import (
    Kinematics,
    Model,
    PressureSurface,
    Solid,
    Solution,
    discretise,
)
from rig.mechanics.mesh.bellow_axisymmetric import (
    AxisymmetricBellow,
    AxisymmetricResolution,
    mesh_axisymmetric_bellow,
)
from rig.mechanics.simulate.energies import mixed_energies
from rig.mechanics.simulate.meridian import MeridianModel, supports_of
from rig.spec.actuator import BellowAxisymmetricGeometry
from rig.spec.material import MaterialSpec


@dataclass(frozen=True)
class AxisymmetricModel(MeridianModel):
    """The whole actuator, with what turns its state into elongation."""

    shape: AxisymmetricBellow
    top_centre: int
    """Node in the middle of the top's outer face."""

    def measures(self, solution: Solution) -> dict[str, float]:
        """Displacement (rise of the top's centre) and volume; it does not bend."""
        d = self.model.discretisation
        return {
            "displacement": float(solution.state.x[d.dim * self.top_centre + 1]),
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
    body = mesh_axisymmetric_bellow(shape, resolution or AxisymmetricResolution.level(1))
    d = discretise(body.mesh, Kinematics.AXISYMMETRIC)
    soft = Solid(d, *mixed_energies(material))
    model = Model(
        d,
        [soft],
        supports=supports_of(d),
        surface=PressureSurface(d, d.facets_on("cavity"), follower=follower),
    )
    (top_centre,) = d.nodes_at(r=0.0, z=shape.height)
    return AxisymmetricModel(model, soft, material.density.value, shape, int(top_centre))
