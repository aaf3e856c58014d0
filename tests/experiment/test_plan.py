"""Plans: order and number of points, and what may not be done."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from rig.experiment.errors import LimitError
from rig.experiment.plan import make_plan
from rig.spec.workspace import Workspace
from tests.benches import BEAM_ACTUATOR

from .conftest import ROOT, SHORT, make_request


def changed(section: str, **fields: Any) -> dict[str, Any]:
    protocol = copy.deepcopy(SHORT)
    assert isinstance(protocol[section], dict)
    protocol[section].update(fields)
    return protocol


def test_the_default_plan_is_that_of_the_paper() -> None:
    setup = Workspace(ROOT).setup(BEAM_ACTUATOR, "virtual-beam")
    plan = make_plan(setup.protocol, setup.actuator, setup.bench)
    up = [k for k in plan.keys if k.direction == "up"]
    assert {k.target_kpa for k in up} == {float(p) for p in range(11)}
    assert sum(k.experiment == "deformation" for k in up) == 5 * 11
    assert sum(k.experiment == "blocked_force" for k in up) == 5 * 11
    assert 75 < plan.duration_s / 60 < 95


def test_the_descending_leg_mirrors_the_ascending_one() -> None:
    sweep = make_request().plan.sweeps[0]
    assert [k.target_kpa for k in sweep.keys] == [0.0, 5.0, 10.0, 5.0, 0.0]


@pytest.mark.parametrize("section", ["deformation", "blocked_force"])
def test_a_pressure_above_the_actuators_limit_is_refused(section: str) -> None:
    with pytest.raises(LimitError, match=r"above\s+12 kPa, limits\.pressure of the actuator"):
        make_request(changed(section, pressures={"start": 0, "stop": 14, "step": 2}))


def test_a_pressure_above_the_benchs_limit_is_refused() -> None:
    setup = make_request().setup
    bench = setup.bench.model_copy(
        update={"safety": setup.bench.safety.model_copy(update={"pressure": 8e3})}
    )
    with pytest.raises(LimitError, match=r"safety\.pressure of the bench"):
        make_plan(setup.protocol, setup.actuator, bench)
