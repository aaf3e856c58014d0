"""How far a model's inputs move its prediction: the law of scaling, and the beam's own answers."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_run import library_setup

from rig.mechanics.model import predict
from rig.record.documents import ExperimentName
from rig.report.inputs import MODULUS, STIFFNESS_POWER, WALL, input_uncertainty, modulus_effect

KPA = np.array([0.0, 2.0, 5.0, 10.0])


def curve(kpa: np.ndarray) -> np.ndarray:
    return 11.0 * kpa - 0.09 * kpa**2


@pytest.mark.parametrize("experiment", ["deformation", "blocked_force"])
def test_a_stiffer_part_obeys_the_law_of_scaling(experiment: ExperimentName) -> None:
    power, step = STIFFNESS_POWER[experiment], 1e-5
    stiffer = (1 + step) ** power * curve(KPA / (1 + step))
    effect = modulus_effect(curve, experiment, KPA)
    assert effect == pytest.approx((stiffer - curve(KPA)) / step, rel=5e-3, abs=1e-9)


def test_a_force_in_proportion_to_pressure_does_not_know_the_modulus() -> None:
    assert modulus_effect(lambda p: 3.5 * p, "blocked_force", KPA) == pytest.approx(0.0, abs=1e-9)


def test_beam_theory_answers_for_itself() -> None:
    setup = library_setup()
    tolerances = setup.actuator.tolerances
    assert tolerances is not None
    response = predict(setup.actuator, setup.material, "beam", np.linspace(0, 10e3, 50))

    def angle(kpa: np.ndarray) -> np.ndarray:
        found = response.at(kpa * 1e3).angle
        assert found is not None
        return found

    effects = input_uncertainty(
        setup.actuator, setup.material, "beam", "deformation", angle, lambda r: r.angle, KPA
    )
    # rigidity E t^3 / 12, and a free parameter that was fitted with E^-0.6: angle ~ E^-0.4 t^-3.08
    assert effects[MODULUS][1:] == pytest.approx(
        -0.4 * tolerances.young_modulus * angle(KPA)[1:], rel=0.01
    )
    assert effects[WALL][1:] == pytest.approx(
        -3.08 * tolerances.wall_thickness * angle(KPA)[1:], rel=0.01
    )
    assert (effects[MODULUS][0], effects[WALL][0]) == (0.0, 0.0)


def test_a_part_without_tolerances_counts_as_drawn() -> None:
    setup = library_setup()
    drawn = setup.actuator.model_copy(update={"tolerances": None})
    arguments = (setup.material, "beam", "deformation", curve, lambda r: r.angle, KPA)
    assert input_uncertainty(drawn, *arguments) == {}  # type: ignore[arg-type]
