"""Controllers on the virtual bench, judged by the sensors."""

from __future__ import annotations

import numpy as np
import pytest

from rig.board.virtual import VirtualBench
from rig.control.loop import Gains
from rig.control.lqg import LinearQuadraticGaussian
from rig.control.tune import Wanted, tune
from rig.experiment.controllers import (
    CASES,
    HOLD_S,
    Case,
    Controller,
    Outcome,
    compete,
    contenders,
    motor_limited_mae_kpa,
)
from tests.control.families import NOISE_KPA, family_of, realistic
from tests.experiment.test_identification import SEED, loop_request

LEVELS = (4.0, 6.0)
CASE = Case("stairs", lambda t: LEVELS[min(int(t / HOLD_S), 1)], 2 * HOLD_S, LEVELS)


@pytest.fixture(scope="module")
def controllers() -> dict[str, Controller]:
    family = family_of(realistic(2.0), realistic(8.0))
    family = family.model_copy(
        update={
            "parameters": family.parameters
            | {"proportional_ml_s_kpa": 4.0, "integral_ml_s2_kpa": 3.0, "feed_forward": 1.0}
        }
    )
    tuning = tune(family, Wanted(most=Gains(100.0, 200.0)))
    return {one.kind: one for one in contenders(family, tuning)} | {
        one.name: one for one in contenders(family, tuning)
    }


def run(controller: Controller) -> Outcome:
    bench = VirtualBench(loop_request().setup, SEED)
    try:
        outcome = compete(bench, loop_request(), controller, CASE)
    finally:
        bench.close()
    assert bench.plant.truth().valve_open
    return outcome


@pytest.mark.parametrize("which", ["tuned PI + feed-forward", "scheduled", "host"])
def test_every_tuned_controller_is_quick_and_exact(
    controllers: dict[str, Controller], which: str
) -> None:
    outcome = run(controllers[which])
    assert outcome.settling_s is not None
    assert outcome.settling_s < 1.2
    assert outcome.overshoot_percent < 2.5
    assert outcome.steady_rmse_kpa < 0.02
    # the motor leaves 0.16 kPa of it
    assert outcome.mae_kpa < 0.3


def test_the_tuned_controller_beats_the_shipped_one(controllers: dict[str, Controller]) -> None:
    shipped = run(controllers["PI as shipped"])
    tuned = run(controllers["tuned PI + feed-forward"])
    assert tuned.steady_rmse_kpa < shipped.steady_rmse_kpa
    assert (shipped.settling_s or np.inf) > (tuned.settling_s or np.inf)


def test_what_the_motor_leaves_is_half_of_each_move() -> None:
    known = {"max_flow_ml_s": 8.0, "max_flow_acceleration_ml_s2": 40.0}
    case = Case("one", lambda t: 8.0, HOLD_S, (8.0,))
    move_s = 8.0 / 8.0 + 8.0 / 40.0
    assert motor_limited_mae_kpa(case, 1.0, known) == pytest.approx(8.0 * move_s / 2 / HOLD_S)


def test_only_with_the_identified_volume_does_the_model_tell_what_the_motor_leaves() -> None:
    other = {case.name for case in CASES if not case.is_as_identified}
    assert other == {"0 to 8 kPa, plunger in", "staircase, +15 mL", "staircase, +30 mL"}


def test_the_regulator_in_the_host_rejects_a_lasting_disturbance() -> None:
    """Against its own model with a flow that it does not know: the error goes to zero."""
    import control

    model, sample_s = realistic(5.0), 0.02
    regulator = LinearQuadraticGaussian(model, NOISE_KPA, sample_s, 8.0)
    plant = control.c2d(model.state_space() * control.ss(0.0, 1.0, 1.0, 0.0), sample_s, "zoh")
    state, pressure, flow = np.zeros(plant.A.shape[0]), 0.0, 0.0
    course = []
    for index in range(1500):
        state = plant.A @ state + plant.B[:, 0] * (flow - 0.2)
        pressure = float((plant.C @ state)[0])
        course.append(pressure)
        flow = regulator.flow(pressure, 1.0 if index > 50 else 0.0, 0.0)
    assert course[-1] == pytest.approx(1.0, abs=1e-3)
    assert max(course) < 1.5
