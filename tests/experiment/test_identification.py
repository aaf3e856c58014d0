"""Identification on the virtual bench, from the excitation to the models."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.board.virtual import Seeds, VirtualBench, virtual_part
from rig.experiment.bench import Nobody
from rig.experiment.errors import ExperimentError, LimitError
from rig.experiment.identification import (
    Analysis,
    IdentificationPlan,
    LoopRequest,
    analyse_identification,
    read_excitations,
    record_identification,
)
from rig.experiment.prepare import take_over
from rig.link.client import RigLink
from rig.link.errors import CommandRefusedError
from rig.mechanics.profile import cavity_volume
from rig.plant.instruments import Instruments
from rig.record.reader import RunReader
from rig.spec.workspace import Workspace
from tests.benches import BEAM_ACTUATOR, ROOT

PLAN = IdentificationPlan((2.0, 8.0), bits=5, rest_s=5.0)
SEED = 3


def loop_request() -> LoopRequest:
    setup = Workspace(ROOT).setup(BEAM_ACTUATOR, "virtual-beam")
    return LoopRequest(setup, SEED, float(cavity_volume(setup.actuator.geometry, 0.0)))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("loop") / "identification"
    bench = VirtualBench(loop_request().setup, SEED)
    try:
        outcome = record_identification(folder, bench, loop_request(), PLAN, Nobody().stage)
    finally:
        bench.close()
    assert outcome.error is None
    assert bench.plant.truth().valve_open
    return folder


@pytest.fixture(scope="module")
def analysis(run: Path) -> Analysis:
    return analyse_identification(RunReader(run))


def test_every_excitation_is_on_record_around_its_level(run: Path) -> None:
    excited = read_excitations(RunReader(run))
    kinds = ["step", "ramp", "pseudo-random", "relay"]
    assert [(e.level_kpa, e.kind) for e in excited] == [(p, k) for p in (2.0, 8.0) for k in kinds]
    for one in excited:
        pressure = one.recording.pressure_kpa
        assert 0.3 < np.ptp(pressure) < 2.0
        assert abs(pressure.mean() - one.level_kpa) < 0.8


def test_the_models_are_right_to_the_noise_and_foretell_the_relay(analysis: Analysis) -> None:
    for level in analysis.family.levels:
        assert level.fit_percent > 97
        assert level.noise_kpa < 0.006  # 0.8 LSB of a converter, averaged over 72 readings
        assert level.relay.fit_percent > 96
        assert level.relay.model_magnitude == pytest.approx(level.relay.magnitude, rel=0.02)
        assert level.relay.model_phase_deg == pytest.approx(level.relay.phase_deg, abs=1.0)


def test_the_models_agree_with_the_drive_and_the_gas_that_are_hidden(analysis: Analysis) -> None:
    bench = loop_request().setup.bench
    virtual = virtual_part(bench)
    drawn = Instruments.draw(bench, virtual, np.random.default_rng(Seeds.of(SEED, 0).instruments))
    low, high = analysis.family.levels
    for level in (low, high):
        # the elastomer's hysteresis looks like more of it
        assert 0.9 < level.backlash_ml * 1e-6 / drawn.backlash < 1.5
        # the shape answers the heat, too: not the gas's own time, but of its size
        heat_s = min(level.times_s, key=lambda t: abs(t - virtual.pneumatics.heat_exchange_time))
        assert heat_s == pytest.approx(virtual.pneumatics.heat_exchange_time, rel=0.3)
    # little has stiffened at 2 kPa: Boyle with the predicted growth of the cavity
    assert low.physics.identified_slow == pytest.approx(low.physics.isothermal, rel=0.06)
    assert high.physics.identified_slow > low.physics.identified_slow


@pytest.mark.parametrize("levels", [(), (0.2,), (5.0, 11.9)])
def test_levels_out_of_reach_are_refused_before_anything_moves(
    tmp_path: Path, levels: tuple[float, ...]
) -> None:
    bench = VirtualBench(loop_request().setup, SEED)
    with pytest.raises(LimitError, match="Nothing was moved"):
        record_identification(
            tmp_path / "run", bench, loop_request(), IdentificationPlan(levels), Nobody().stage
        )
    assert bench.bus.now_s == 0
    bench.close()


def test_a_stop_in_the_middle_leaves_a_vented_bench_and_a_closed_log(tmp_path: Path) -> None:
    bench = VirtualBench(loop_request().setup, SEED)

    def impatient() -> None:
        if bench.bus.now_s > 40:
            raise ExperimentError("enough")

    outcome = record_identification(
        tmp_path / "run", bench, loop_request(), PLAN, Nobody().stage, impatient
    )
    assert outcome.stop.exit_status == "failed"
    assert bench.plant.truth().valve_open
    assert abs(bench.plant.truth().gauge_pressure) < 50
    stop = RunReader(tmp_path / "run").stop()
    assert stop is not None
    assert stop.reason == "enough"
    bench.close()


def test_a_posted_command_is_carried_out_without_waiting_and_refused_later() -> None:
    bench = VirtualBench(loop_request().setup, SEED)
    link = RigLink(bench.bus)
    link.open()
    take_over(link)
    began_s = link.now_s
    link.post("jog", 2.0)
    assert link.now_s == began_s
    moved = [m.values["plunger_ml"] for m in link.wait(0.3) if m.name == "PRESSURE"]
    assert moved[-1] > moved[0] + 0.2
    link.post("jog", 1000.0)
    with pytest.raises(CommandRefusedError, match="out_of_range"):
        link.wait(0.1)
    bench.close()
