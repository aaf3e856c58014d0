"""The virtual bench: a simulated board, plant and camera, behind real interfaces.

Experiments get a bus and a camera. The truth goes to a file of its own.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from rig.board.errors import BoardError
from rig.board.injection import FaultyLine
from rig.board.native import NativeBoard
from rig.board.revision import firmware_revision
from rig.board.simulated import SimulatedBoard
from rig.board.truth import TruthFile
from rig.link.bus import SlcanBus
from rig.mechanics.job import Job
from rig.mechanics.outline import side_profile
from rig.plant.camera import CameraFault, VirtualCamera
from rig.plant.instruments import Instruments
from rig.plant.plant import Fixture, Plant, plant_parameters
from rig.plant.specimen import Specimen, draw_specimen
from rig.spec.bench import BeamSpecimen, BenchSpec, EmulatedBoard
from rig.spec.bench import VirtualBench as VirtualBenchSpec
from rig.spec.faults import FaultScript
from rig.spec.workspace import Setup

_BEAM_OF_NO_CONCERN = {
    "gravity_offset": 0.07,
    "gravity_offset_spread": 0.0,
    "stiffening": 0.1,
    "stiffening_spread": 0.0,
}
"""Of a specimen that nobody looks at: it must only differ from the model; rad and shares."""


@dataclass(frozen=True)
class Seeds:
    """A stream for every part, so that a change in one leaves the others' draws alone."""

    specimen: np.random.SeedSequence
    instruments: np.random.SeedSequence
    camera: np.random.SeedSequence
    noise: np.random.SeedSequence
    references: np.random.SeedSequence

    @classmethod
    def of(cls, seed: int, segment: int) -> Seeds:
        """Streams of a bench; `segment` counts how often a run was resumed."""
        specimen, instruments, camera, noise, references = np.random.SeedSequence(seed).spawn(5)
        return cls(specimen, instruments, camera, noise.spawn(segment + 1)[-1], references)


def virtual_part(bench: BenchSpec) -> VirtualBenchSpec:
    """What a simulated bench hides; raises BoardError if its spec does not say."""
    if bench.virtual is None:
        raise BoardError(
            f"the bench '{bench.name}' has a simulated board but no section 'virtual', which holds "
            "the imperfections of the simulated bench; copy the one of "
            "models/benches/virtual.yaml."
        )
    return bench.virtual


def require_simulated(bench: BenchSpec) -> None:
    """Raise BoardError unless things may be broken on this bench."""
    if not bench.simulated:
        raise BoardError(
            f"the bench '{bench.name}' has a real board: faults are injected into simulated "
            "benches only. Nothing was moved. Choose the bench 'virtual' or 'emulated'."
        )


def _specimen(setup: Setup, seeds: Seeds, job: Job | None) -> Specimen:
    """The printed actuator that the seeds draw."""
    return draw_specimen(
        setup.actuator,
        setup.material,
        virtual_part(setup.bench).specimen,
        np.random.default_rng(seeds.specimen),
        job,
    )


def specimen_of(setup: Setup, seed: int, job: Job | None = None) -> Specimen:
    """The printed actuator of a simulated bench; `job` is how its response is computed."""
    return _specimen(setup, Seeds.of(seed, 0), job)


def _plant(setup: Setup, specimen: Specimen, seeds: Seeds) -> Plant:
    """The simulated bench around a specimen, with the instruments that the seeds draw."""
    instruments = Instruments.draw(
        setup.bench, virtual_part(setup.bench), np.random.default_rng(seeds.instruments)
    )
    parameters = plant_parameters(
        setup.bench, specimen, instruments, setup.actuator.limits.pressure
    )
    return Plant(parameters, specimen, int(seeds.noise.generate_state(1, np.uint64)[0]))


def virtual_board(setup: Setup, seed: int, job: Job | None = None) -> SimulatedBoard:
    """The board that the bench spec names on a simulated bench, without camera and truth file.

    `job` is how the specimen's response is computed.
    """
    seeds = Seeds.of(seed, 0)
    return board_on(setup.bench, _plant(setup, _specimen(setup, seeds, job), seeds))


def ready_at_once(setup: Setup) -> Setup:
    """The set-up for those whom only the board concerns: its specimen takes no finite elements."""
    virtual = virtual_part(setup.bench)
    quick = BeamSpecimen.model_construct(
        **dict(virtual.specimen) | {"response": "beam"} | _BEAM_OF_NO_CONCERN
    )
    bench = setup.bench.model_copy(
        update={"virtual": virtual.model_copy(update={"specimen": quick})}
    )
    return replace(setup, bench=bench)


def board_on(
    bench: BenchSpec,
    plant: Plant,
    start_s: float = 0.0,
    after_poll: Callable[[], None] | None = None,
) -> SimulatedBoard:
    """The board that the bench spec names, wired to `plant`."""
    if isinstance(bench.board, EmulatedBoard):
        from rig.board.emulated import EmulatedBoard as Mega  # built on first use

        return Mega(plant, start_s=start_s, after_poll=after_poll)
    return NativeBoard(
        plant, firmware_git=firmware_revision(), start_s=start_s, after_poll=after_poll
    )


class PlantCamera:
    """Looks at the plant's actuator: a frame that arrives shows it as it was a latency ago.

    `known_s` is the latency that frames are thought to have; their time is early by that.
    """

    def __init__(
        self, camera: VirtualCamera, plant: Plant, board: SimulatedBoard, known_s: float
    ) -> None:
        self._camera = camera
        self._plant = plant
        self._board = board
        self._known_s = known_s
        self._seen: deque[tuple[float, float]] = deque()
        board.witness = self._witness
        self._witness()

    @property
    def fault(self) -> CameraFault:
        """What is wrong with the camera; may be set at any time."""
        return self._camera.fault

    @fault.setter
    def fault(self, fault: CameraFault) -> None:
        self._camera.fault = fault

    @property
    def latency_s(self) -> float:
        """What is to be found: exposure to arrival."""
        return self._camera.latency_s

    def grab(self) -> tuple[float, bytes]:
        """Bench time in seconds, as far as it is known, and the JPEG of a frame arriving now."""
        now_s = self._board.now_s
        jpeg = self._camera.grab(self._deformation(now_s - self.latency_s), now_s)
        return now_s - self._known_s, jpeg

    def _witness(self) -> None:
        """Note the deformation now; forget what no frame can show any more."""
        now_s = self._board.now_s
        self._seen.append((now_s, self._plant.truth().deformation))
        while len(self._seen) > 1 and self._seen[1][0] <= now_s - self.latency_s:
            self._seen.popleft()

    def _deformation(self, time_s: float) -> float:
        """Between two looks on the straight line; before the first, as at the first."""
        times, seen = zip(*self._seen, strict=True)
        return float(np.interp(time_s, times, seen))


class VirtualBench:
    """A bench, open.

    `truth_path` is where the truth is written, if anywhere. `segment` is 0 for a new run; a
    resumed run starts at `start_s` with the same specimen and instruments but fresh noise.
    `faults` are injected while the bench is used; `line` then tells what came of them. `job` is how
    the specimen's response is computed.
    """

    def __init__(
        self,
        setup: Setup,
        seed: int,
        truth_path: Path | None = None,
        *,
        segment: int = 0,
        start_s: float = 0.0,
        faults: FaultScript | None = None,
        job: Job | None = None,
    ) -> None:
        seeds = Seeds.of(seed, segment)
        specimen = _specimen(setup, seeds, job)
        self.plant = _plant(setup, specimen, seeds)
        measurand = setup.actuator.measurand
        self._truth = None if truth_path is None else TruthFile(truth_path, measurand)
        self._board = board_on(setup.bench, self.plant, start_s, self._write_truth)
        self.line: FaultyLine | None = None
        if faults is not None:
            self.line = FaultyLine(self._board, self.plant, faults.faults, seed)
        self.bus = SlcanBus(self.line or self._board)
        camera = VirtualCamera(
            virtual_part(setup.bench).optics,
            setup.calibrations.ruler,
            specimen.geometry,
            setup.bench.camera.jpeg_quality,
            np.random.default_rng(seeds.camera),
            side_profile,
        )
        calibrated, assumed_s = setup.calibrations.camera, setup.bench.camera.latency
        known_s = calibrated.latency_s(assumed_s)
        self.camera = PlantCamera(camera, self.plant, self._board, known_s)

    @property
    def board(self) -> SimulatedBoard:
        """The board itself, for those who break or measure it."""
        return self._board

    def mount(self, fixture: Literal["free", "blocked", "plugged"]) -> None:
        """Free the tip, block it against the load cell, or plug the tube."""
        self.plant.set_fixture(Fixture[fixture.upper()])

    def _write_truth(self) -> None:
        if self._truth is not None:
            self._truth.write(self._board.now_s, self.plant.truth())

    def close(self) -> None:
        """Finish the truth file."""
        self.bus.close()
        if self._truth is not None:
            self._truth.close()
