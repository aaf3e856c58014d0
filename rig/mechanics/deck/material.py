"""Our materials as `*HYPERELASTIC`, or `*ELASTIC` and `*PLASTIC`, of Abaqus and CalculiX: N, mm.

Both write U = W(I1, I2 or stretches, isochoric) + sum (J - 1)^2i / Di, so that K = 2 / D1; the
Arruda-Boyce model alone has U(J) = ((J^2 - 1)/2 - ln J) / D, which is our logarithmic function
(Abaqus Theory Guide, Section 4.6.1; CalculiX 2.20, `*HYPERELASTIC`). A volumetric function that
the other program lacks is replaced by the one it has with the same bulk modulus; the deck says so.
"""

from __future__ import annotations

from dataclasses import dataclass

from rig.mechanics.deck.errors import DeckError
from rig.mechanics.hyperelastic import (
    ArrudaBoyce,
    Energy,
    Flowing,
    HenckyVolume,
    LogarithmicVolume,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    QuadraticVolume,
    Volumetric,
    Yeoh,
)
from rig.mechanics.plasticity import J2Plasticity

_MEGAPASCAL = 1e6


Table = tuple[tuple[float, ...], ...]
_PER_LINE = 8
"""Constants of a data line at most, in both programs."""


@dataclass(frozen=True)
class Hyperelasticity:
    """The keyword's parameters and its numbers in MPa and 1/MPa."""

    model: str
    constants: tuple[float, ...]
    remark: str = ""

    @property
    def keywords(self) -> tuple[tuple[str, Table], ...]:
        """The keyword and its data lines."""
        c = self.constants
        lines = tuple(c[i : i + _PER_LINE] for i in range(0, len(c), _PER_LINE))
        return ((f"HYPERELASTIC, {self.model}", lines),)


@dataclass(frozen=True)
class Elastoplasticity:
    """J2 flow with linear hardening; moduli and stress in MPa."""

    young_modulus: float
    poisson_ratio: float
    yield_stress: float
    hardening_modulus: float
    remark: str = (
        "J2 flow beside Hencky's elasticity; other elastic laws are the same at small strains only"
    )

    @property
    def keywords(self) -> tuple[tuple[str, Table], ...]:
        """The keywords and their data lines."""
        virgin: Table = ((self.yield_stress, 0.0),)
        # both programs take the last stress of the table for all strains beyond it
        flowing = (
            ((self.yield_stress + _STRAIN * self.hardening_modulus, _STRAIN),)
            if self.hardening_modulus
            else ()
        )
        return (
            ("ELASTIC", ((self.young_modulus, self.poisson_ratio),)),
            ("PLASTIC", virgin + flowing),
        )


_STRAIN = 10.0
"""Plastic strain to which hardening is written."""


def material_law(
    distortion: Energy | Flowing, volume: Volumetric
) -> Hyperelasticity | Elastoplasticity:
    """What stands for two energies; raises DeckError where nothing does."""
    if isinstance(distortion, J2Plasticity) and isinstance(volume, HenckyVolume):
        g, k = distortion.shear_modulus, volume.bulk_modulus
        return Elastoplasticity(
            9 * k * g / (3 * k + g) / _MEGAPASCAL,
            (3 * k - 2 * g) / (6 * k + 2 * g),
            distortion.yield_stress / _MEGAPASCAL,
            distortion.hardening_modulus / _MEGAPASCAL,
        )
    return hyperelasticity(distortion, volume)


def hyperelasticity(distortion: Energy | Flowing, volume: Volumetric) -> Hyperelasticity:
    """What stands for two energies; raises DeckError where nothing does."""
    if not isinstance(volume, QuadraticVolume | LogarithmicVolume):
        raise DeckError(f"no program's *HYPERELASTIC has the volumetric energy {volume!r}.")
    d = 2 / volume.bulk_modulus * _MEGAPASCAL
    own = LogarithmicVolume if isinstance(distortion, ArrudaBoyce) else QuadraticVolume
    remark = ""
    if not isinstance(volume, own):
        wanted = "((J^2 - 1)/2 - ln J) / D" if own is LogarithmicVolume else "(J - 1)^2 / D1"
        remark = f"{volume!r} is written as {wanted}: equal for small changes of volume"
    model, constants = _constants(distortion, d)
    return Hyperelasticity(model, constants, remark)


def _constants(distortion: Energy | Flowing, d: float) -> tuple[str, tuple[float, ...]]:
    match distortion:
        case NeoHookean():
            return "NEO HOOKE", (distortion.shear_modulus / 2 / _MEGAPASCAL, d)
        case MooneyRivlin(c10, c01, 0.0, 0.0, 0.0):
            return "MOONEY-RIVLIN", (*_megapascals(c10, c01), d)
        case MooneyRivlin(c10, c01, c11, c20, c02):
            return "POLYNOMIAL, N=2", (*_megapascals(c10, c01, c20, c11, c02), d, 0.0)
        case Yeoh(c10, c20, c30):
            return "YEOH", (*_megapascals(c10, c20, c30), d, 0.0, 0.0)
        case Ogden(terms):
            pairs = [v for term in terms for v in (term.mu / _MEGAPASCAL, term.alpha)]
            return f"OGDEN, N={len(terms)}", (*pairs, d, *(0.0,) * (len(terms) - 1))
        case ArrudaBoyce(modulus, locking_stretch):
            return "ARRUDA-BOYCE", (modulus / _MEGAPASCAL, locking_stretch, d)
    raise DeckError(f"no program's *HYPERELASTIC has the energy {distortion!r}.")


def _megapascals(*values: float) -> tuple[float, ...]:
    return tuple(value / _MEGAPASCAL for value in values)
