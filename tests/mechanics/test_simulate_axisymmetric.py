"""The axisymmetric bellow against the tables of Auysakul et al., and what only it lacks."""

from __future__ import annotations

import numpy as np
import pytest
from auysakul import (
    FOLDER,
    PRESSURES,
    displacements,
    table_2,
    table_5,
)

from rig.mechanics.bellow import bending_geometry
from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import Point, follow
from rig.mechanics.mesh.bellow_axisymmetric import AxisymmetricResolution
from rig.mechanics.model import available_models, predict
from rig.mechanics.response import Response
from rig.mechanics.simulate.axisymmetric import axisymmetric_model
from rig.mechanics.table import COLUMNS, rows
from rig.spec.actuator import BellowAxisymmetricGeometry
from rig.spec.workspace import Workspace, library_root

LIBRARY = Workspace(library_root(), is_library=True)
needs_tables = pytest.mark.skipif(not FOLDER.exists(), reason="published tables are not here")


@pytest.fixture(scope="module")
def response() -> Response:
    actuator = LIBRARY.actuator("bellow-axisymmetric")
    return predict(actuator, LIBRARY.material("dragon-skin-30"), "fe", [0.0, 4e3, 8e3])


def test_elements_are_the_family_s_only_model_and_it_lengthens(response: Response) -> None:
    assert available_models("bellow-axisymmetric") == ("fe",)
    assert response.displacement[0] == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.diff(response.displacement) > 1e-3)
    assert np.all(np.diff(response.volume) > 0)


def test_what_the_family_does_not_have_is_an_empty_column(response: Response) -> None:
    assert response.angle is None
    assert response.at([2e3]).angle is None
    row = dict(zip(COLUMNS, rows(response)[0], strict=True))
    assert row["angle_deg"] is None
    assert row["blocked_force_g"] == 0.0
    with pytest.raises(MechanicsError, match="gives no angle"):
        response.pressure_for("angle", [0.1])


def test_an_energy_that_is_unstable_within_its_elongation_is_a_caution(response: Response) -> None:
    assert response.cautions == ()
    sound = LIBRARY.material("dragon-skin-30")
    unsound = sound.model_copy(
        update={"hyperelastic": sound.hyperelastic.model_copy(update={"c01": -0.02e6, "c11": 0.0})}
    )
    found = predict(LIBRARY.actuator("bellow-axisymmetric"), unsound, "fe", [0.0, 1e3])
    (caution,) = found.at([5e2]).cautions
    assert "unstable (Drucker)" in caution
    assert "tension above a stretch of" in caution


def test_what_is_for_bending_bellows_refuses_the_family_by_name() -> None:
    actuator = LIBRARY.actuator("bellow-axisymmetric")
    with pytest.raises(MechanicsError, match="The virtual bench is for the family 'bellow-bending"):
        bending_geometry(actuator, "The virtual bench")


def test_base_and_pressure_are_in_equilibrium() -> None:
    """Dead pressure lifts with p times the base's bore, whatever the shape above it."""
    geometry = BellowAxisymmetricGeometry(family="bellow-axisymmetric", divided_ratio=3)
    actuator = axisymmetric_model(
        geometry,
        LIBRARY.material("dragon-skin-30"),
        resolution=AxisymmetricResolution.level(0),
        follower=False,
    )
    pressure = 5e3
    (solution,) = follow(actuator.model, [Point(pressure)]).solutions
    d = actuator.model.discretisation
    lift = -solution.residual[2 * d.nodes_on("clamped") + 1].sum()
    assert lift == pytest.approx(pressure * np.pi * 0.017**2, rel=1e-5)


@needs_tables
@pytest.mark.parametrize("row", [1, 3, 7])
def test_designs_of_table_2_come_out_under_dead_pressure(row: int) -> None:
    """The thick ones: a coarse mesh is enough, and follower pressure 0.4 mm away."""
    design = table_2()[row]
    dead = displacements(design.geometry, follower=False, level=0)[-1]
    assert dead == pytest.approx(design.displacement, abs=0.06)


@needs_tables
def test_follower_pressure_is_not_what_the_paper_computed_with() -> None:
    design = table_2()[1]
    assert displacements(design.geometry, follower=True, level=0)[-1] < design.displacement - 0.4


@needs_tables
@pytest.mark.slow
def test_table_2_is_reproduced_by_dead_pressure_and_not_by_follower_pressure() -> None:
    designs = table_2()
    assert len(designs) == 13
    published = np.array([d.displacement for d in designs])

    def rmse(follower: bool) -> float:
        ours = [displacements(d.geometry, follower=follower, level=2)[-1] for d in designs]
        return float(np.sqrt(np.mean((ours - published) ** 2)))

    assert rmse(follower=False) < 0.05
    assert rmse(follower=True) > 1.0


@needs_tables
@pytest.mark.slow
def test_table_5_is_reproduced_by_dead_pressure_within_a_percent() -> None:
    _, simulated = table_5()
    geometry = LIBRARY.actuator("bellow-axisymmetric").geometry
    assert isinstance(geometry, BellowAxisymmetricGeometry)
    dead = displacements(geometry, follower=False, pressures=PRESSURES, level=3)
    np.testing.assert_allclose(dead, simulated, rtol=0.01)
