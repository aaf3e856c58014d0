"""Controllers on the virtual bench, judged by the sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rig.board.virtual import VirtualBench
from rig.control.identify import LevelModel, Mode
from rig.control.loop import Gains
from rig.control.lqg import LinearQuadraticGaussian, robust_regulator
from rig.control.tune import Wanted, tune
from rig.experiment.controllers import (
    GAS_CASES,
    LIQUID_CASES,
    VOLUMES,
    Controller,
    Outcome,
    StatedMargins,
    compete,
    contenders,
    motor_limited_mae_kpa,
    setup_of,
    staircase,
    standings,
)
from rig.spec.physics import Liquid
from rig.spec.workspace import Workspace
from tests.benches import BEAM_ACTUATOR, ROOT
from tests.control.families import NOISE_KPA, family_of, integrator, realistic
from tests.experiment.test_identification import SEED, loop_request

LEVELS = (4.0, 6.0)
CASE = staircase("stairs", LEVELS, 5.0)


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
    case = staircase("one", (8.0,), 5.0)
    move_s = 8.0 / 8.0 + 8.0 / 40.0
    limit = motor_limited_mae_kpa(case, family_of(integrator(1.0, 0.006)))
    assert limit == pytest.approx(8.0 * move_s / 2 / 5.0, rel=1e-4)


def test_a_plant_that_gives_way_later_leaves_less_of_a_move() -> None:
    """Until the gas has cooled it takes less of the plunger to get there."""
    case = staircase("one", (8.0,), 5.0)
    warm = LevelModel(4.0, 4.0, 1.4, (-0.4,), (0.35,), 0.006, 0.0)
    limits = [motor_limited_mae_kpa(case, family_of(one)) for one in (warm, integrator(1.0, 0.0))]
    assert 0.7 * limits[1] < limits[0] < 0.98 * limits[1]


def test_only_with_the_identified_volume_does_the_model_tell_what_the_motor_leaves() -> None:
    volumes = {"staircase, volume -30 %", "staircase, volume +30 %"}
    other = {case.name for case in GAS_CASES if not case.is_as_identified}
    assert other == volumes | {"0 to 8 kPa, plunger in"}
    assert {case.name for case in LIQUID_CASES if not case.is_as_identified} == volumes


def test_a_case_changes_the_gas_on_the_bench_and_nothing_else() -> None:
    gas = loop_request().setup
    more, same, less = (
        setup_of(gas, staircase("", (1.0,), 1.0, volume=v), 80.0) for v in (1.3, 1.0, 0.7)
    )
    added = more.bench.syringe.dead_volume - gas.bench.syringe.dead_volume
    assert added == pytest.approx(24e-6)
    assert same.bench == less.bench == gas.bench, "less gas is the plunger further in"
    water = Workspace(ROOT).setup(BEAM_ACTUATOR, "virtual-water")
    airier = setup_of(water, staircase("", (1.0,), 1.0, volume=1.3), 80.0).bench
    assert isinstance(airier.fluid, Liquid)
    assert isinstance(water.bench.fluid, Liquid)
    assert airier.fluid.entrained_air == pytest.approx(1.3 * water.bench.fluid.entrained_air)


def test_robustness_is_the_worst_of_the_volumes() -> None:
    def outcome(case: str, mae: float) -> Outcome:
        nothing = np.zeros(0)
        return Outcome("PI", case, nothing, nothing, nothing, 0.5, 1.0, 0.005, mae, 1.0)

    controller = Controller("PI", "board", {}, StatedMargins(8.0, 70.0))
    names = [case.name for case in GAS_CASES if case.name.startswith("staircase")]
    assert len(names) == len(VOLUMES)
    runs = [outcome(name, 0.1 + 0.05 * ("+30" in name)) for name in names]
    assert standings([controller], runs) == [], "the sines are missing"
    (standing,) = standings([controller], [*runs, outcome("sines", 0.2)])
    assert standing.worst_volume == pytest.approx(1.5)
    assert (standing.mae_kpa, standing.sine_mae_kpa) == (0.1, 0.2)
    assert (standing.gain_db, standing.phase_deg) == (8.0, 70.0)


def test_a_regulator_for_a_swing_uses_less_flow_until_it_keeps_its_margins() -> None:
    def swinging(gain: float) -> LevelModel:
        return LevelModel(
            5.0, 3.0, 40.0 * gain, (), (), 0.006, 0.0, modes=(Mode(-37.0 * gain, 26.0, 0.09),)
        )

    members = [swinging(gain) for gain in (0.8, 1.0, 1.3)]
    bold = LinearQuadraticGaussian(swinging(1.0), 0.02, 0.02, 4.0)
    assert min(bold.margins(one).gain_db for one in members) < 6
    found = robust_regulator(swinging(1.0), members, 0.02, 0.02, 4.0)
    assert found.weight_ml_s < bold.weight_ml_s
    assert min(found.margins(one).gain_db for one in members) >= 6
    assert min(found.margins(one).phase_deg for one in members) >= 45
    calm = robust_regulator(realistic(5.0), [realistic(5.0)], NOISE_KPA, 0.02, 8.0)
    assert calm.weight_ml_s == bold.weight_ml_s


@pytest.mark.parametrize(("share", "quiet"), [(0.9, True), (1.1, False)])
def test_the_margins_of_the_regulator_in_the_host_are_those_of_its_loop(
    share: float, quiet: bool
) -> None:
    import control

    model, sample_s = realistic(5.0), 0.02
    regulator = LinearQuadraticGaussian(model, NOISE_KPA, sample_s, 1e6)
    plant = control.c2d(model.state_space() * control.ss(0.0, 1.0, 1.0, 0.0), sample_s, "zoh")
    late = replace(model, delay_s=0.002)  # whole samples only, as the simulation has them
    gain = share * regulator.margins(late).gain
    state, pressure, flow, course = np.zeros(plant.A.shape[0]), 0.1, 0.0, []
    regulator.flow(0.0, 0.0, 0.0)
    for _ in range(1500):
        given = regulator.flow(pressure, 0.0, 0.0)
        state = plant.A @ state + gain * plant.B[:, 0] * flow
        pressure, flow = float((plant.C @ state)[0]) + 0.1 * (not course), given
        course.append(pressure)
    assert (np.ptp(course[-100:]) < np.ptp(course[100:200])) == quiet


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
