"""What the finite elements say of stress and strain: the 3D view and how far it is from tearing."""

from __future__ import annotations

from dataclasses import dataclass

from rig.mechanics.fe import Extremes, Kinematics
from rig.mechanics.job import Job
from rig.mechanics.simulate.prediction import free_inflation
from rig.mechanics.strength import Criterion, safety
from rig.report.view3d import View, scene_of, view_of
from rig.spec.actuator import ActuatorSpec
from rig.spec.material import MaterialSpec


@dataclass(frozen=True)
class StrengthRow:
    """Largest stresses and strains at one pressure, in the units people read.

    A safety factor is a pair, for the low and the high end of the data sheet's range.
    """

    pressure_kpa: float
    von_mises_kpa: float
    bulk_von_mises_kpa: float
    nominal_kpa: float
    strain_percent: float
    factors: dict[Criterion, tuple[float, float]]
    governing: Criterion | None


@dataclass(frozen=True)
class StrengthSection:
    """Stress and strain of an actuator as calculated."""

    view: View | None
    """None of models in the plane, which have no surface to turn."""
    rows: tuple[StrengthRow, ...]
    material: str
    sources: tuple[str, ...]
    """Where strength and elongation at break come from; empty where the spec has neither."""

    @property
    def criteria(self) -> tuple[Criterion, ...]:
        """What the material's data allow to check."""
        return tuple(self.rows[-1].factors)


def strength_section(
    actuator: ActuatorSpec, material: MaterialSpec, top: float, job: Job
) -> StrengthSection:
    """The finite element model up to `top` in Pa, tip free.

    Raises MechanicsError where the family has no such model or it reached no pressure.
    """
    inflation = free_inflation(actuator, material)
    found, solutions = inflation.solutions(top, job)
    extremes = inflation.curves(top, job).extremes
    view: View | None = None
    if found.model.discretisation.kinematics is Kinematics.SOLID:
        view = view_of(scene_of(found.model, solutions, extremes, found.mirror))
    ranges = [material.tensile_strength, material.elongation_at_break]
    return StrengthSection(
        view=view,
        rows=tuple(_row(at_pressure, material) for at_pressure in extremes),
        material=material.name,
        sources=tuple(dict.fromkeys(r.source for r in ranges if r is not None)),
    )


def _row(extremes: Extremes, material: MaterialSpec) -> StrengthRow:
    found = safety(extremes, material)
    governing = found.governing
    return StrengthRow(
        pressure_kpa=extremes.pressure / 1e3,
        von_mises_kpa=extremes.von_mises.value / 1e3,
        bulk_von_mises_kpa=extremes.von_mises.bulk / 1e3,
        nominal_kpa=extremes.nominal_stress.value / 1e3,
        strain_percent=100 * extremes.principal_strain.value,
        factors={m.criterion: (m.factor, m.factor_high) for m in found.margins},
        governing=None if governing is None else governing.criterion,
    )
