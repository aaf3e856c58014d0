"""Published tables of Auysakul et al. (Actuators 12 (2023) 300), read where the data are."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.mechanics.fe import Point, follow
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricResolution
from rig.mechanics.simulate.axisymmetric import axisymmetric_model
from rig.spec.actuator import BellowAxisymmetricGeometry
from rig.spec.workspace import Workspace, library_root

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "auysakul2023"
PRESSURES = np.arange(5e3, 51e3, 5e3)
"""Of Table 5, in Pa; Table 2 is at the last one."""


@dataclass(frozen=True)
class Design:
    """A row of Table 2."""

    geometry: BellowAxisymmetricGeometry
    displacement: float
    """mm, at 50 kPa."""

    @property
    def name(self) -> str:
        g = self.geometry
        return f"t={g.wall_thickness * 1e3:g} N={g.bellow_number} d={g.divided_ratio:g}"


def table_2() -> list[Design]:
    """The distinct designs of the Box-Behnken plan, in the table's order."""
    rows = dict.fromkeys(tuple(row.values()) for row in _rows("table2.csv"))
    return [
        Design(
            BellowAxisymmetricGeometry.model_validate(
                {
                    "family": "bellow-axisymmetric",
                    "wall_thickness": f"{wall} mm",
                    "bellow_number": int(layers),
                    "divided_ratio": float(ratio),
                }
            ),
            float(displacement),
        )
        for wall, layers, ratio, displacement, _ in rows
    ]


def table_5() -> tuple[np.ndarray, np.ndarray]:
    """Measured and simulated displacement in mm at PRESSURES."""
    rows = _rows("table5.csv")
    np.testing.assert_allclose([float(row["pressure_kpa"]) * 1e3 for row in rows], PRESSURES)
    return tuple(
        np.array([float(row[name]) for row in rows]) for name in ("experiment_mm", "simulation_mm")
    )


def displacements(
    geometry: BellowAxisymmetricGeometry,
    *,
    follower: bool,
    pressures: np.ndarray = PRESSURES[1::2],
    level: int = 1,
) -> np.ndarray:
    """Rise of the top's centre in mm, our figures."""
    material = Workspace(library_root(), is_library=True).material("dragon-skin-30")
    resolution = AxisymmetricResolution.level(level)
    actuator = axisymmetric_model(geometry, material, resolution=resolution, follower=follower)
    result = follow(actuator.model, [Point(p) for p in pressures])
    assert result.failure is None, result.failure
    return 1e3 * np.array([actuator.measures(s)["displacement"] for s in result.solutions])


def _rows(name: str) -> list[dict[str, str]]:
    with (FOLDER / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))
