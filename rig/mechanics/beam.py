"""Beam theory of the bellow, Section IV-A of the paper, equations (2) to (9), in closed form.

Each half convolution is a guided cantilever of unit width under the pressure on its flank and the
axial load F_A. Along the middle surface from crest A to trough D the lever X is the distance from
the crest across the axis, and all three moments (2) to (4) read

    M = M_A + p X^2 / 2 - F_A X,

so that Castigliano's conditions (6) and (7) need only the integrals J_n of X^n along the beam:

    M_A = (F_A J1 - p J2 / 2) / J0
    dx  = [F_A (J2 - J1^2 / J0) - p / 2 (J3 - J1 J2 / J0)] / (E I),    I = t^3 / 12.

Everything is linear in p. What the free parameter b hides is told in docs/theory/beam.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.mechanics.bellow import BellowShape
from rig.mechanics.convolution import Unfolded, unfold
from rig.mechanics.errors import MechanicsError
from rig.spec.actuator import BellowBendingGeometry
from rig.spec.material import MaterialSpec

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LeverIntegrals:
    """J_n, integrals of the lever X^n along the middle surface of a half convolution, m^(n+1)."""

    j0: float
    j1: float
    j2: float
    j3: float


def lever_integrals(crest_radius: float, flank: float, trough_radius: float) -> LeverIntegrals:
    """Integrate X = R1 (1 - cos), R1 + s, R1 + f + R2 sin over arc AB, flank BC and arc CD."""
    r1, r2, a = crest_radius, trough_radius, crest_radius + flank
    return LeverIntegrals(
        j0=pi / 2 * (r1 + r2) + flank,
        j1=r1**2 * (pi / 2 - 1) + (a**2 - r1**2) / 2 + r2 * (pi / 2 * a + r2),
        j2=r1**3 * (3 * pi / 4 - 2)
        + (a**3 - r1**3) / 3
        + r2 * (pi / 2 * a**2 + 2 * a * r2 + pi / 4 * r2**2),
        j3=r1**4 * (5 * pi / 4 - 11 / 3)
        + (a**4 - r1**4) / 4
        + r2 * (pi / 2 * a**3 + 3 * a**2 * r2 + 3 * pi / 4 * a * r2**2 + 2 / 3 * r2**3),
    )


def published_free_parameter(geometry: BellowBendingGeometry, young_modulus: float) -> float:
    """b = 1.6082e4 lambda^0.3 / (N^0.9 E^0.6), E in Pa, as the toolbox has it."""
    shape_factor = geometry.radius_ratio**0.3 / geometry.bellow_number**0.9
    return float(1.6082e4 * shape_factor / young_modulus**0.6)


@dataclass(frozen=True)
class BeamTheory:
    """Beam model of one bellow of one material; pressures in Pa, vectorised over them."""

    geometry: BellowBendingGeometry
    young_modulus: float
    """E in Pa."""
    free_parameter: float
    """b of Section IV-A, a plain number here: dx / b is the elongation of a whole convolution."""

    @classmethod
    def of(
        cls,
        geometry: BellowBendingGeometry,
        material: MaterialSpec,
        free_parameter: float | None = None,
    ) -> BeamTheory:
        """Take E from the material and b from the toolbox's formula unless it is given."""
        modulus = material.young_modulus.value
        if free_parameter is None:
            free_parameter = published_free_parameter(geometry, modulus)
        return cls(geometry, modulus, free_parameter)

    @property
    def shape(self) -> BellowShape:
        """Derived dimensions."""
        return BellowShape.of(self.geometry)

    def axial_load(self, pressure: ArrayLike) -> Array:
        """F_A of eq. (8), N per metre of width.

        The paper writes p (R1 + f + R2) / 2 + p ri / 2, the toolbox p (ro - ri) / 2 + p ri / 2;
        they are the same number since R1 + R2 = r1 + r2.
        """
        half = self.shape.middle_surface
        depth = half.crest_radius + half.flank + half.trough_radius
        return np.asarray(pressure, dtype=float) * (depth + self.shape.inner_radius) / 2

    def crest_moment(self, pressure: ArrayLike) -> Array:
        """M_A that keeps the crest from rotating, eq. (6), N m per metre of width."""
        j = self._levers
        pressure = np.asarray(pressure, dtype=float)
        return np.asarray((self.axial_load(pressure) * j.j1 - pressure * j.j2 / 2) / j.j0)

    def axial_displacement(self, pressure: ArrayLike) -> Array:
        """Displacement dx of eq. (7) as printed: a half convolution, before b, metres."""
        j = self._levers
        pressure = np.asarray(pressure, dtype=float)
        rigidity = self.young_modulus * self.shape.wall**3 / 12
        by_load = self.axial_load(pressure) * (j.j2 - j.j1**2 / j.j0)
        by_pressure = pressure / 2 * (j.j3 - j.j1 * j.j2 / j.j0)
        return np.asarray((by_load - by_pressure) / rigidity)

    def length_difference(self, pressure: ArrayLike) -> Array:
        """Delta L = N dx / b between bellow and bottom layer, metres."""
        count = self.shape.bellow_number
        return np.asarray(count * self.axial_displacement(pressure) / self.free_parameter)

    def angle(self, pressure: ArrayLike) -> Array:
        """Bending angle Theta = Delta L / (2 ro + tb) of eq. (9), rad."""
        return np.asarray(self.length_difference(pressure) / self._height)

    def deformed_convolution(self, pressure: ArrayLike) -> Unfolded:
        """R1', R2', phi1', phi2', f' of the straight bellow at each pressure.

        The half convolution grows by dx / (2 b), so that N convolutions grow by Delta L.
        Raises MechanicsError beyond `unfolding_pressure`.
        """
        pressure = np.asarray(pressure, dtype=float)
        if np.any(pressure > self.unfolding_pressure * (1 + 1e-12)):
            raise MechanicsError(
                f"the convolutions are completely unfolded at "
                f"{self.unfolding_pressure / 1e3:.4g} kPa in the beam model; "
                f"{float(np.max(pressure)) / 1e3:.4g} kPa has no deformed profile. "
                f"Ask for lower pressures."
            )
        half = self.shape.middle_surface
        growth = self.length_difference(pressure) / (2 * self.shape.bellow_number)
        return unfold(half, half.half_length + growth)

    @property
    def unfolding_pressure(self) -> float:
        """Pressure in Pa at which the arcs of the straight bellow have nothing left to unfold."""
        per_pascal = float(self.length_difference(1.0)) / (2 * self.shape.bellow_number)
        return self.shape.middle_surface.max_elongation / per_pascal

    @property
    def half_turn_pressure(self) -> float:
        """Pressure in Pa at which the end cap faces the connector (180 deg)."""
        return pi / float(self.angle(1.0))

    @property
    def limit_pressure(self) -> float:
        """Pressure in Pa where geometry runs out: unfolded or bent by a half turn."""
        return min(self.unfolding_pressure, self.half_turn_pressure)

    @property
    def _height(self) -> float:
        return 2 * self.shape.outer_radius + self.shape.bottom_thickness

    @property
    def _levers(self) -> LeverIntegrals:
        half = self.shape.middle_surface
        return lever_integrals(half.crest_radius, half.flank, half.trough_radius)


@dataclass(frozen=True)
class FreeParameterFit:
    """Free parameter b fitted to measured angles."""

    value: float
    standard_uncertainty: float
    offset: float
    """Angle at zero pressure in rad (0 unless it was fitted)."""
    residual_rms: float
    """Root mean square of the remaining angle differences in rad."""


def fit_free_parameter(
    geometry: BellowBendingGeometry,
    material: MaterialSpec,
    pressures: ArrayLike,
    angles: ArrayLike,
    *,
    with_offset: bool = False,
) -> FreeParameterFit:
    """Least squares of Theta = offset + Theta_1 / b over measured angles.

    `pressures` in Pa and `angles` in rad are (n,); Theta_1 is the angle at b = 1. The fit is
    linear in 1 / b; its standard uncertainty comes from the residuals (Type A) and is propagated
    to b. With `with_offset` a constant angle (gravity) is fitted too. Raises MechanicsError when
    the data cannot determine b.
    """
    pressure, angle = np.asarray(pressures, dtype=float), np.asarray(angles, dtype=float)
    unknowns = 2 if with_offset else 1
    if pressure.shape != angle.shape or pressure.ndim != 1 or pressure.size <= unknowns:
        raise MechanicsError(
            f"the free parameter needs more than {unknowns} pairs of pressure and angle; "
            f"got {pressure.shape} pressures and {angle.shape} angles. Give equally many of both."
        )
    unit = BeamTheory.of(geometry, material, free_parameter=1.0).angle(pressure)
    columns = [unit, np.ones_like(unit)] if with_offset else [unit]
    design = np.column_stack(columns)
    solution, _, rank, _ = np.linalg.lstsq(design, angle, rcond=None)
    if rank < unknowns or solution[0] <= 0:
        raise MechanicsError(
            "the measured angles do not grow with pressure, so they do not determine the free "
            "parameter b. Check that pressures differ and that bending is positive."
        )
    residual = angle - design @ solution
    variance = float(residual @ residual) / (angle.size - unknowns)
    covariance = variance * np.linalg.inv(design.T @ design)
    inverse = float(solution[0])
    return FreeParameterFit(
        value=1 / inverse,
        standard_uncertainty=float(np.sqrt(covariance[0, 0])) / inverse**2,
        offset=float(solution[1]) if with_offset else 0.0,
        residual_rms=float(np.sqrt(np.mean(residual**2))),
    )
