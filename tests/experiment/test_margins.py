"""Stated margins against the nonlinear plant: heat, hysteresis, noise and converter included."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from rig.board.virtual import VirtualBench, virtual_part
from rig.control.loop import Gains, Margins, margins
from rig.experiment.bench import Nobody
from rig.experiment.identification import (
    IdentificationPlan,
    analyse_identification,
    record_identification,
)
from rig.record.reader import RunReader
from rig.spec.workspace import Setup
from tests.experiment.plant_loop import PlantLoop
from tests.experiment.test_identification import SEED, loop_request

LEVEL_KPA = 8.0
GAINS = Gains(29.0, 150.0)
KICK_KPA = 0.5
NOISE_KPA = 0.006
TAIL = 200
"""Ticks that are judged, after a second."""


@dataclass
class Loop:
    plant: PlantLoop
    stated: Margins

    def oscillation_kpa(self, factor: float, delay_s: float) -> float:
        """Standard deviation long after a kick, with these gains and that much more delay."""
        self.plant.begin()
        gains = Gains(factor * GAINS.proportional, factor * GAINS.integral)
        pressures = self.plant.regulate(LEVEL_KPA + KICK_KPA, gains, 1.5, delay_s)
        return float(np.std(pressures[-TAIL:]))


def _with_a_drive_that_follows(setup: Setup) -> Setup:
    """Without backlash, stiction and stalls: their limit cycles would hide where the loop itself
    becomes unstable. Gas, heat, tube, elastomer, noise and converter stay as they are."""
    bench, virtual = setup.bench, virtual_part(setup.bench)
    drive = virtual.drive.model_copy(update={"friction": None, "torque": None})
    update = {
        "virtual": virtual.model_copy(update={"drive": drive}),
        "lead_screw": bench.lead_screw.model_copy(update={"backlash": 0.0}),
    }
    return replace(setup, bench=bench.model_copy(update=update))


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Loop:
    folder = tmp_path_factory.mktemp("margins") / "run"
    bench = VirtualBench(loop_request().setup, SEED)
    plan = IdentificationPlan((LEVEL_KPA,), bits=6, rest_s=5.0)
    record_identification(folder, bench, loop_request(), plan, Nobody().stage)
    bench.close()
    (level,) = analyse_identification(RunReader(folder)).family.levels
    plant = PlantLoop(_with_a_drive_that_follows(loop_request().setup), SEED)
    plant.regulate(LEVEL_KPA, Gains(10.0, 20.0), 4.0)
    plant.keep()
    return Loop(plant, margins(level.model, GAINS))


def test_the_loop_is_quiet_as_it_is(loop: Loop) -> None:
    assert loop.oscillation_kpa(1.0, 0.0) < NOISE_KPA


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_less_than_the_stated_gain_margin_leaves_it_stable(loop: Loop, share: float) -> None:
    assert loop.oscillation_kpa(share * loop.stated.gain, 0.0) < 2 * NOISE_KPA


def test_twice_the_stated_gain_margin_makes_it_oscillate(loop: Loop) -> None:
    # the margin is stated with a delay known to be no shorter: it errs on the safe side, by 4 dB
    assert loop.oscillation_kpa(2.0 * loop.stated.gain, 0.0) > 20 * NOISE_KPA


@pytest.mark.parametrize("share", [0.4, 0.7])
def test_less_than_the_stated_delay_margin_leaves_it_stable(loop: Loop, share: float) -> None:
    assert loop.oscillation_kpa(1.0, share * loop.stated.delay_s) < 2 * NOISE_KPA


def test_half_as_much_again_as_the_stated_delay_margin_makes_it_oscillate(loop: Loop) -> None:
    assert loop.oscillation_kpa(1.0, 1.5 * loop.stated.delay_s) > 20 * NOISE_KPA
