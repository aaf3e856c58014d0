"""The joint bellow: elongation, permanent set, and histories that survive being stored."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from pydantic import ValidationError

from rig.mechanics.fe import Options, Point, Solution, follow
from rig.mechanics.hyperelastic import material_stability
from rig.mechanics.job import Job
from rig.mechanics.mesh.bellow_joint import JointResolution
from rig.mechanics.simulate.energies import mixed_energies
from rig.mechanics.simulate.inflation import Inflation
from rig.mechanics.simulate.joint import joint_model
from rig.mechanics.store import FolderStore
from rig.spec.actuator import BellowJointGeometry
from rig.spec.material import MaterialSpec
from rig.spec.workspace import Workspace, library_root

LIBRARY = Workspace(library_root(), is_library=True)
EVA = LIBRARY.material("eva-18")
SHORT = BellowJointGeometry(family="bellow-joint", bellow_number=2)
COARSE = JointResolution(wall=1, fifth=1, end=1, end_radius=2)


def weak(yield_stress: float) -> MaterialSpec:
    assert EVA.plasticity is not None
    flow = EVA.plasticity.model_copy(update={"yield_stress": yield_stress})
    return EVA.model_copy(update={"plasticity": flow})


def elongation(yield_stress: float, pressures: list[float]) -> list[float]:
    actuator = joint_model(SHORT, weak(yield_stress), resolution=COARSE)
    result = follow(actuator.model, [Point(p) for p in pressures])
    assert result.failure is None
    return [actuator.measures(s)["displacement"] for s in result.solutions]


def test_what_stays_elastic_returns_and_what_flows_stays_longer() -> None:
    cycle = [50e3, 0.0]
    elastic, plastic = elongation(1e9, cycle), elongation(2.5e6, cycle)
    assert elastic[1] == pytest.approx(0.0, abs=1e-9)
    assert plastic[0] > 1.1 * elastic[0]
    assert plastic[1] > 0.05 * elastic[0]


def test_elongation_is_read_at_the_upper_disc_s_rim() -> None:
    actuator = joint_model(SHORT, EVA, resolution=COARSE)
    rim = actuator.model.discretisation.nodes[actuator.top]
    # a radius of 3 mm and half a wall; two bellows of 3 mm and a disc of 1 mm
    np.testing.assert_allclose(rim, (3.15e-3, 7e-3), rtol=1e-12)


def test_a_stored_plastic_run_goes_on_where_it_ended(tmp_path) -> None:
    """The rungs beyond those stored are computed from the history kept beside them."""
    build = partial(joint_model, SHORT, weak(2.5e6), resolution=COARSE)

    def question(name: str) -> Inflation:
        return Inflation("tip free", build, name, 48e3, Options(extrapolate=False))

    job = Job(store=FolderStore(tmp_path))
    question("in two").curves(40e3, job)
    continued = question("in two").curves(48e3, job)
    _, kept = question("in two").solutions(48e3, job)
    at_once = question("at once").curves(48e3, job)
    np.testing.assert_allclose(
        continued.measured["displacement"], at_once.measured["displacement"], rtol=1e-9
    )
    assert strain(kept[-1]) > strain(kept[-2]) > 0.01


def strain(solution: Solution) -> float:
    history = solution.state.points[0].history
    assert history is not None
    return float(history[9].max())


def test_steps_that_fail_leave_no_flow_behind() -> None:
    """Cut into halves on the way, the path ends like one that was never refused a step."""
    actuator = joint_model(SHORT, weak(2.5e6), resolution=COARSE)
    given = follow(actuator.model, [Point(50e3)], options=Options(iterations=3))
    assert any(not step.converged for step in given.history)
    assert given.failure is None
    easy = follow(actuator.model, [Point(50e3)])
    assert strain(given.solutions[0]) == pytest.approx(strain(easy.solutions[0]), rel=2e-2)
    x, y = (r.solutions[0].state.x[2 * actuator.top + 1] for r in (given, easy))
    assert x == pytest.approx(y, rel=1e-2)


def test_a_material_flows_or_is_rubber_but_not_both() -> None:
    text = EVA.model_dump(mode="json")
    rubber = {"energy": "neo-hookean", "shear_modulus": "1 MPa", "source": "a test"}
    with pytest.raises(ValidationError, match="'hyperelastic' or 'plasticity', not both"):
        MaterialSpec.model_validate({**text, "hyperelastic": rubber})


def test_elastic_constants_of_a_flowing_material_are_its_spec_s() -> None:
    flow, volume = mixed_energies(EVA)
    tangent = flow.since(flow.virgin((1,))).tangent(np.eye(3)[..., None])[..., 0]
    shear = (tangent[0, 1, 0, 1] + tangent[0, 1, 1, 0]) / 2
    bulk = float(volume.stiffness(np.ones(1))[0])
    assert 9 * bulk * shear / (3 * bulk + shear) == pytest.approx(80e6)
    assert (3 * bulk - 2 * shear) / (6 * bulk + 2 * shear) == pytest.approx(0.4)
    assert material_stability(EVA).warning is None
