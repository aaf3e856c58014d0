"""The plunger's drive by weighing water, its dead volume and backlash by Boyle's law.

Steps that push water out are compared with what it weighs. Air bears water of the density rho, and
the masses that the balance was adjusted with, so a balance that shows w has on it (OIML D 28)

    m = w (1 - air / 8000) / (1 - air / rho).

With the tube plugged the gas obeys
p V = const (isothermal, after a rest): with the volume V enclosed at ambient pressure a, when the
plunger stands at `start`, it stands at gauge pressure p at

    x = start + V p / (a + p) - backlash [if the drive has turned round].

The board counts x from the home switch, which the plunger reaches pulling; pushing, it stands a
backlash behind x.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibrate.air import AIR_KG_M3, BUOYANCY
from rig.calibrate.errors import CalibrateError
from rig.calibrate.least_squares import LinearFit, least_squares
from rig.calibrate.points import Row, column, of_kind, table
from rig.spec.calibration import (
    Evidence,
    Provenance,
    SyringeCalibration,
    TransducerCalibration,
)

Array = NDArray[np.float64]
COLUMNS = ("plunger_ml", "pressure_kpa", "water_g")
"""`kind` is dispense (water weighed so far), up or down (gas compressed, pushing or pulling)."""


def water_density(temperature_c: float) -> float:
    """Density in g/mL of air-free water at 5 to 40 deg C (Tanaka et al., Metrologia 38 (2001))."""
    t = temperature_c
    return 0.999974950 * (1 - (t - 3.983035) ** 2 * (t + 301.797) / (522528.9 * (t + 69.34881)))


def shown_density(temperature_c: float) -> float:
    """What a balance in air shows of a millilitre of water, in grams."""
    return (water_density(temperature_c) - AIR_KG_M3 / 1e3) / (1 - BUOYANCY)


@dataclass(frozen=True)
class Surroundings:
    """What the evaluation needs to know besides the points."""

    ambient_kpa: float
    ambient_u_kpa: float
    """Standard uncertainty of the ambient pressure, as all below that end in `_u`."""
    temperature_c: float
    """Of the water."""
    temperature_u_c: float
    volume_per_step_ul: float
    """What the board took for one step while the points were taken."""
    syringe_ml: float
    tube_ml: float
    tube_u_ml: float
    balance_u: float
    """Relative standard uncertainty of the balance's scale."""
    transducer: TransducerCalibration
    """What read the pressures; its zero may drift between pushing and pulling."""


@dataclass(frozen=True)
class SyringeFit:
    """What the points say of the drive and of the gas; mL."""

    dispensed: LinearFit
    compressed: LinearFit
    around: Surroundings

    @property
    def scale(self) -> float:
        """Volume really pushed over volume counted."""
        return self.dispensed["slope"] / shown_density(self.around.temperature_c)

    @property
    def scale_u(self) -> float:
        """Relative standard uncertainty of `scale`."""
        fitted = self.dispensed.u({"slope": 1.0}) / self.dispensed["slope"]
        t, u = self.around.temperature_c, self.around.temperature_u_c
        warmth = (water_density(t - u) - water_density(t + u)) / 2 / water_density(t)
        return float(np.linalg.norm([fitted, self.around.balance_u, warmth]))

    @property
    def dead_ml(self) -> float:
        """Volume left with the plunger fully in, without the tube."""
        gas = self.compressed
        at_home = gas["volume"] + gas["start"] - gas["backlash"]
        return self.scale * at_home - self.around.syringe_ml - self.around.tube_ml

    @property
    def dead_u_ml(self) -> float:
        """Standard uncertainty of `dead_ml`: fit, scales, ambient pressure, tube, bow and zero.

        x = V p / (a + p): a relative error e of p makes one of e a / (a + p), nearly e, in V; so
        does one of a.
        """
        enclosed, around = self.scale * self.compressed["volume"], self.around
        return float(
            np.linalg.norm(
                [
                    self.scale * self.compressed.u({"volume": 1.0, "start": 1.0, "backlash": -1.0}),
                    self.scale_u * enclosed,
                    around.transducer.gain_u * enclosed,
                    around.ambient_u_kpa / around.ambient_kpa * enclosed,
                    around.tube_u_ml,
                    self._position_u_ml(around.transducer.linearity_u),
                    self.zero_u_ml,
                ]
            )
        )

    @property
    def zero_u_ml(self) -> float:
        """What a drift of the zero moves the plunger's position by at a given reading."""
        return self._position_u_ml(self.around.transducer.zero_u)

    def _position_u_ml(self, pressure_u: float) -> float:
        """What an error of a reading in Pa makes of the plunger's position."""
        enclosed = self.scale * self.compressed["volume"]
        return enclosed / self.around.ambient_kpa * pressure_u / 1e3

    @property
    def backlash_u_ml(self) -> float:
        """Standard uncertainty of the backlash."""
        fitted = self.scale * self.compressed.u({"backlash": 1.0})
        return float(np.hypot(fitted, self.zero_u_ml))

    def calibration(self, rows: Sequence[Row], provenance: Provenance) -> SyringeCalibration:
        """The calibration of the drive; raises CalibrateError for an impossible dead volume."""
        if self.dead_ml < 0:
            raise CalibrateError(
                f"the dead volume comes out as {self.dead_ml:.3f} mL: check the syringe's and the "
                "tube's volume in the bench, and that the plug is tight."
            )
        backlash = max(0.0, self.scale * self.compressed["backlash"])
        return SyringeCalibration(
            kind="calibration",
            instrument="syringe",
            steps_per_ml=1e3 / (self.around.volume_per_step_ul * self.scale),
            steps_per_ml_u=self.scale_u,
            backlash=backlash,  # bare numbers are in mL
            backlash_u=self.backlash_u_ml,
            dead_volume=self.dead_ml,
            dead_volume_u=self.dead_u_ml,
            provenance=provenance,
            evidence=Evidence(
                columns=("dispense", "down", *COLUMNS),
                rows=table(rows, COLUMNS, ("dispense", "down")),
                fits=(
                    self.dispensed.record("water = offset + slope x; g, x in mL as counted"),
                    self.compressed.record(
                        "x = start + volume p / (a + p) - backlash [down]; mL as counted"
                    ),
                ),
                findings={
                    "scale": self.scale,
                    "ambient_kpa": self.around.ambient_kpa,
                    "ambient_u_kpa": self.around.ambient_u_kpa,
                    "water_c": self.around.temperature_c,
                    "water_u_c": self.around.temperature_u_c,
                },
            ),
        )


def fit_syringe(rows: Sequence[Row], around: Surroundings) -> SyringeFit:
    """Fit points with the columns `COLUMNS`; raises CalibrateError where they do not suffice."""
    poured, pressed = of_kind(rows, "dispense"), of_kind(rows, "up", "down")
    counted = column(poured, "plunger_ml")
    dispensed = least_squares(
        {"offset": np.ones_like(counted), "slope": counted}, column(poured, "water_g")
    )
    pressure = np.array(
        [around.transducer.corrected(1e3 * p) / 1e3 for p in column(pressed, "pressure_kpa")]
    )
    down = np.array([row["kind"] == "down" for row in pressed], dtype=np.float64)
    compressed = least_squares(
        {
            "start": np.ones_like(pressure),
            "volume": pressure / (around.ambient_kpa + pressure),
            "backlash": -down,
        },
        column(pressed, "plunger_ml"),
    )
    return SyringeFit(dispensed, compressed, around)
