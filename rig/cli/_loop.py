"""Opens a bench for work on the pressure loop, and keeps people informed while it lasts."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from pathlib import Path

from rich.console import Console

from rig.board.real import RealBench
from rig.board.truth import truth_path
from rig.board.virtual import VirtualBench
from rig.cli._calculation import calculating
from rig.cli._interruption import catching_signals
from rig.experiment.bench import Bench
from rig.experiment.identification import LoopRequest
from rig.experiment.recorded import RunOutcome
from rig.experiment.request import created_now, require_measured_calibrations
from rig.experiment.setup import require_valid_calibrations
from rig.mechanics.outline import body_of
from rig.record.writer import require_free_folder
from rig.spec.faults import FaultScript
from rig.spec.workspace import Setup

Stage = Callable[[str], None]
Take = Callable[[Bench, Stage, Callable[[], None]], RunOutcome]


def loop_request(setup: Setup, seed: int) -> LoopRequest:
    """The request of an experiment on the loop; raises ExperimentError for old calibrations."""
    require_valid_calibrations(setup.calibrations, date.today())
    return LoopRequest(
        setup=setup,
        seed=seed,
        cavity_volume=body_of(setup.actuator.geometry).cavity_volume,
        created=created_now(setup),
    )


def open_bench(
    request: LoopRequest,
    truth: Path | None,
    console: Console,
    faults: FaultScript | None = None,
) -> Bench:
    """The bench of a request; the virtual one writes its truth beside the run, if anywhere."""
    setup = request.setup
    if setup.bench.simulated:
        with calculating(console) as job:
            return VirtualBench(setup, request.seed, truth, faults=faults, job=job)
    require_measured_calibrations(setup)

    def ask(instruction: str) -> None:
        console.input(f"{instruction}, then press Enter. ")

    return RealBench(setup.bench, setup.calibrations.camera, ask)


def take(folder: Path, request: LoopRequest, console: Console, work: Take) -> RunOutcome:
    """Do `work` on the bench of `request` with its log in `folder`; Ctrl-C vents the bench.

    Raises what stopped the work, once the bench is safe and the log closed.
    """
    require_free_folder(folder)
    bench = open_bench(request, truth_path(folder, 0), console)
    try:
        with catching_signals() as interruption, console.status("starting") as status:

            def stage(text: str) -> None:
                status.update(text)
                if not console.is_terminal:
                    console.print(text, soft_wrap=True, markup=False)

            outcome = work(bench, stage, interruption.check)
    finally:
        bench.close()
    if outcome.error is not None:
        raise outcome.error
    return outcome
