"""A run on the emulated bench measures what the same run on the virtual bench measures.

Specimen, instruments and noise are the same; what differs is everything between them and the
serial line: converter, timers, pins, and the AVR's arithmetic.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from rig.board.emulator_build import missing_packages
from rig.board.virtual import VirtualBench
from rig.experiment.bench import Nobody
from rig.experiment.plan import make_plan
from rig.experiment.run import new_run
from rig.experiment.setup import RunRequest
from rig.mechanics.profile import cavity_volume
from rig.record.documents import PointDocument
from rig.record.reader import RunReader
from rig.spec.workspace import Workspace
from tests.benches import with_beam_specimen

ROOT = Path(__file__).resolve().parents[2]
MISSING = missing_packages()


def points(bench_name: str, folder: Path) -> list[PointDocument]:
    setup = with_beam_specimen(Workspace(ROOT).setup("bellow-bending", bench_name, "faults"))
    request = RunRequest(
        setup=setup,
        plan=make_plan(setup.protocol, setup.actuator, setup.bench),
        seed=1,
        cavity_volume=float(cavity_volume(setup.actuator.geometry, 0.0)),
    )
    bench = VirtualBench(setup, 1)
    outcome = new_run(folder, bench, request, Nobody(), lambda: None)
    bench.close()
    assert outcome.error is None
    return RunReader(folder).points()


@pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")
def test_every_point_agrees_with_the_virtual_bench_within_its_noise(tmp_path: Path) -> None:
    virtual = points("virtual", tmp_path / "virtual")
    emulated = points("emulated", tmp_path / "emulated")
    assert [p.key for p in emulated] == [p.key for p in virtual]
    assert {p.key.experiment for p in emulated} == {"deformation", "blocked_force"}
    for here, there in zip(virtual, emulated, strict=True):
        noise_kpa = math.hypot(here.pressure_sd_kpa, there.pressure_sd_kpa)
        assert abs(there.pressure_kpa - here.pressure_kpa) < 2 * noise_kpa, here.key
        assert abs(there.value - here.value) < 2 * math.hypot(here.value_u, there.value_u), here.key
