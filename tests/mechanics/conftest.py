"""Geometries and materials that the mechanics tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

from rig.spec.actuator import ActuatorSpec, BellowBendingGeometry
from rig.spec.material import MaterialSpec

SHARED_DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


@pytest.fixture(scope="session")
def default_geometry() -> BellowBendingGeometry:
    return BellowBendingGeometry(family="bellow-bending")


@pytest.fixture(scope="session")
def agilus30() -> MaterialSpec:
    return MaterialSpec.model_validate(
        {
            "kind": "material",
            "name": "Agilus30",
            "young_modulus": {"value": "450 kPa", "source": "toolbox"},
            "poisson_ratio": {"value": 0.49, "source": "toolbox"},
            "density": {"value": 1160, "source": "toolbox"},
        }
    )


@pytest.fixture(scope="session")
def default_actuator(default_geometry: BellowBendingGeometry) -> ActuatorSpec:
    return ActuatorSpec.model_validate(
        {
            "kind": "actuator",
            "name": "default",
            "geometry": default_geometry,
            "material": "agilus30",
            "limits": {"pressure": "12 kPa"},
        }
    )
