"""Runs on the virtual bench, short enough for tests; the slow default run is behind a marker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from rig.board.truth import TruthSample, read_truth
from rig.board.virtual import VirtualBench
from rig.experiment.bench import Nobody, Observer
from rig.experiment.errors import AbortedError
from rig.experiment.plan import make_plan
from rig.experiment.program import plan_trials
from rig.experiment.recorded import RunOutcome
from rig.experiment.run import new_run, resume_run
from rig.experiment.setup import RunRequest
from rig.mechanics.outline import body_of
from rig.plant.camera import CameraFault
from rig.record.documents import PointDocument
from rig.record.reader import RunReader
from rig.spec.protocol import ProtocolSpec
from rig.spec.workspace import Workspace
from tests.benches import BEAM_ACTUATOR

ROOT = Path(__file__).resolve().parents[2]
SHORT: dict[str, Any] = {
    "kind": "protocol",
    "name": "short",
    "deformation": {
        "pressures": {"start": 0, "stop": 10, "step": 5},
        "repeats": 1,
        "descending_repeats": 1,
        "hold": 2,
        "rest": 1,
        "frames": 2,
    },
    "blocked_force": {
        "pressures": {"start": 0, "stop": 10, "step": 5},
        "repeats": 1,
        "hold": 2,
        "rest": 1,
        "readings": 20,
    },
}


def make_request(
    protocol: dict[str, object] = SHORT,
    seed: int = 1,
    bench: str = "virtual-beam",
    actuator: str = BEAM_ACTUATOR,
) -> RunRequest:
    setup = Workspace(ROOT).setup(actuator, bench)
    # the files behind a run are its attachments: a replaced protocol must be there as well
    spec = ProtocolSpec.model_validate(protocol)
    source = replace(
        setup.sources["protocol"], spec=spec, text=spec.model_dump_json(exclude_none=True)
    )
    setup = replace(setup, protocol=spec, sources={**setup.sources, "protocol": source})
    cavity = body_of(setup.actuator.geometry).cavity_volume
    return RunRequest(
        setup=setup,
        plan=make_plan(spec, setup.actuator, setup.bench),
        seed=seed,
        cavity_volume=cavity,
        trials=plan_trials(setup, cavity),
    )


@dataclass(frozen=True)
class VirtualRun:
    folder: Path
    outcome: RunOutcome

    @property
    def reader(self) -> RunReader:
        return RunReader(self.folder)

    def truth(self, segment: int = 1) -> list[TruthSample]:
        name = "truth.mcap" if segment == 1 else f"truth-{segment}.mcap"
        return read_truth(self.folder / name)


class StopsAfter(Nobody):
    """Asks to stop when so many points are done, like a person who presses Ctrl-C."""

    def __init__(self, points: int) -> None:
        self._left = points

    def point_done(self, point: PointDocument) -> None:
        self._left -= 1

    def check(self) -> None:
        if self._left <= 0:
            raise AbortedError("stopped on request.")


class FailsAfter:
    """The bench's camera, with a fault from a number of frames on."""

    def __init__(self, bench: VirtualBench, frames: int, fault: CameraFault) -> None:
        self._camera, self._left, self._fault = bench.camera, frames, fault

    def grab(self) -> tuple[float, bytes]:
        self._camera.fault = CameraFault.NONE if self._left > 0 else self._fault
        self._left -= 1
        return self._camera.grab()


def take(
    folder: Path,
    request: RunRequest,
    *,
    observer: Observer | None = None,
    interrupted: Callable[[], None] | None = None,
    prepare: Callable[[VirtualBench], None] | None = None,
) -> VirtualRun:
    bench = VirtualBench(request.setup, request.seed, folder / "truth.mcap")
    if prepare is not None:
        prepare(bench)
    try:
        outcome = new_run(folder, bench, request, observer or Nobody(), interrupted)
    finally:
        bench.close()
    return VirtualRun(folder, outcome)


def take_rest(folder: Path, request: RunRequest) -> VirtualRun:
    points, parts = RunReader(folder).points(), RunReader(folder).parts()
    ends = [*(p.measured_to_s for p in points), *(p.to_s for p in parts)]
    bench = VirtualBench(
        request.setup,
        request.seed,
        folder / "truth-2.mcap",
        segment=1,
        start_s=max(ends, default=0.0),
    )
    try:
        done, done_parts = [p.key for p in points], [p.key for p in parts]
        rest = RunReader(folder).rest_image()
        outcome = resume_run(
            folder, bench, request, Nobody(), done, done_parts=done_parts, rest_jpeg=rest
        )
    finally:
        bench.close()
    return VirtualRun(folder, outcome)


@pytest.fixture(scope="session")
def short_run(tmp_path_factory: pytest.TempPathFactory) -> VirtualRun:
    return take(tmp_path_factory.mktemp("runs") / "short", make_request())
