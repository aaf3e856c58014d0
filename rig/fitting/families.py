"""The energies that can be fitted: their coefficients, and what makes them Drucker-stable.

Every family is linear in its moduli once its shape parameters (exponents, locking stretch) are
chosen; fits make use of that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rig.fitting.specimen import Array
from rig.mechanics.hyperelastic import (
    ArrudaBoyce,
    Energy,
    Hyperelastic,
    LinearElastic,
    Mode,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    OgdenTerm,
    SaintVenantKirchhoff,
    Yeoh,
    incompressible_response,
    response,
)
from rig.spec.hyperelastic import (
    ArrudaBoyceEnergy,
    ElasticEnergy,
    HyperelasticSpec,
    MooneyRivlinEnergy,
    NeoHookeanEnergy,
    OgdenEnergy,
    OgdenTermSpec,
    YeohEnergy,
)

Values = Mapping[str, float]
"""Coefficient to value, moduli in Pa."""


@dataclass(frozen=True)
class Shape:
    """A coefficient in which the energy is not linear, and where it is looked for."""

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class Family:
    """One energy as a fit sees it."""

    name: str
    moduli: tuple[str, ...]
    """Coefficients in Pa in which the stress is linear."""
    build: Callable[[Values], Energy]
    section: Callable[[Values, str], HyperelasticSpec]
    """Values and their source to the section of a material's file."""
    shapes: tuple[Shape, ...] = ()
    positive: bool = False
    """Whether the energy is stable (Drucker) for moduli at or above zero, and they are held so.

    A sum of energies that are convex in the logarithmic strains is convex. Where False, stability
    is a condition on all moduli together.
    """
    compressible: bool = False
    """Whether the energy knows the cost of a change of volume, so that a test's free directions
    follow from it; all others are taken as incompressible."""

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Moduli, then shapes."""
        return self.moduli + tuple(shape.name for shape in self.shapes)

    def stress(self, values: Values, mode: Mode, stretch: Array) -> Array:
        """Nominal stress in Pa of a test, (n,); raises MechanicsError where there is none."""
        energy = self.build(values)
        test = response if self.compressible else incompressible_response
        return test(energy, mode, stretch).nominal_stress


def families(poisson_ratio: float) -> dict[str, Family]:
    """All energies by name; the ratio is used by the two that are not isochoric."""
    return {
        family.name: family
        for family in (
            Family(
                "neo-hookean",
                ("shear_modulus",),
                lambda v: NeoHookean(v["shear_modulus"]),
                lambda v, source: NeoHookeanEnergy(energy="neo-hookean", source=source, **v),
                positive=True,
            ),
            _mooney_rivlin("mooney-rivlin-2", "c10", "c01"),
            _mooney_rivlin("mooney-rivlin-3", "c10", "c01", "c11"),
            _mooney_rivlin("mooney-rivlin-5", "c10", "c01", "c11", "c20", "c02"),
            Family(
                "yeoh",
                ("c10", "c20", "c30"),
                lambda v: Yeoh(**v),
                lambda v, source: YeohEnergy(energy="yeoh", source=source, **v),
            ),
            _ogden(1),
            _ogden(2),
            _ogden(3),
            Family(
                "arruda-boyce",
                ("modulus",),
                lambda v: ArrudaBoyce(v["modulus"], v["locking_stretch"]),
                lambda v, source: ArrudaBoyceEnergy(energy="arruda-boyce", source=source, **v),
                shapes=(Shape("locking_stretch", 1.05, 30.0),),
                positive=True,
            ),
            Family(
                "saint-venant-kirchhoff",
                ("young_modulus",),
                lambda v: Hyperelastic(
                    SaintVenantKirchhoff(v["young_modulus"], poisson_ratio), None
                ),
                lambda _v, _source: ElasticEnergy(energy="saint-venant-kirchhoff"),
                positive=True,
                compressible=True,
            ),
            Family(
                "linear",
                ("young_modulus",),
                lambda v: Hyperelastic(LinearElastic(v["young_modulus"], poisson_ratio), None),
                lambda _v, _source: ElasticEnergy(energy="linear"),
                positive=True,
                compressible=True,
            ),
        )
    }


def _mooney_rivlin(name: str, *moduli: str) -> Family:
    return Family(
        name,
        moduli,
        lambda v: MooneyRivlin(v["c10"], v["c01"], *(v.get(c, 0.0) for c in ("c11", "c20", "c02"))),
        lambda v, source: MooneyRivlinEnergy(energy="mooney-rivlin", source=source, **v),
    )


def _ogden(count: int) -> Family:
    terms = range(1, count + 1)

    def energy(v: Values) -> Energy:
        return Ogden(tuple(OgdenTerm(v[f"mu_{i}"], v[f"alpha_{i}"]) for i in terms))

    def section(v: Values, source: str) -> HyperelasticSpec:
        pairs = (OgdenTermSpec(mu=v[f"mu_{i}"], alpha=v[f"alpha_{i}"]) for i in terms)
        return OgdenEnergy(energy="ogden", convention="abaqus", source=source, terms=tuple(pairs))

    return Family(
        f"ogden-{count}",
        tuple(f"mu_{i}" for i in terms),
        energy,
        section,
        shapes=tuple(Shape(f"alpha_{i}", -12.0, 20.0) for i in terms),
        positive=True,
    )
