"""A characterisation from the command line: open the bench, take the run, write the report."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from rig.board.errors import BoardError
from rig.board.real import RealBench
from rig.board.truth import truth_path
from rig.board.virtual import VirtualBench, require_simulated
from rig.cli._calculation import calculating
from rig.cli._interruption import catching_signals
from rig.cli._progress import LABELS, ProgressObserver
from rig.cli._summary import show_summary
from rig.experiment.bench import Bench, Observer
from rig.experiment.doctor import Finding, look_at_bench, look_at_machine
from rig.experiment.errors import ExperimentError
from rig.experiment.recorded import RunOutcome
from rig.experiment.request import make_request, require_measured_calibrations
from rig.experiment.run import new_run, resume_run
from rig.experiment.setup import (
    RunRequest,
)
from rig.link.errors import LinkError
from rig.record.reader import RunReader
from rig.record.writer import require_free_folder
from rig.spec.faults import FaultScript
from rig.spec.free_path import first_free
from rig.spec.loading import read
from rig.spec.workspace import Setup, Workspace


class _RunConsole(Console):
    """A console whose reader may go away (`| head`): a run is not stopped by that."""

    def on_broken_pipe(self) -> None:
        """Fall silent, where rich would end the process."""
        self.quiet = True
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())


@dataclass(frozen=True)
class Session:
    """One characterisation, ready to be shown or run."""

    request: RunRequest
    logs: Path
    console: Console
    faults: FaultScript | None = None
    """What breaks while the run is taken; a resumed run finds everything mended."""

    def show_plan(self) -> None:
        """Print what will be done, in which order, and how long it takes."""
        setup, plan = self.request.setup, self.request.plan
        names = (setup.actuator.name, setup.material.name, setup.bench.name, setup.protocol.name)
        actuator, material, bench, protocol = map(escape, names)
        self.console.print(
            f"[bold]{actuator}[/] ({material}) on the bench [bold]{bench}[/], "
            f"protocol [bold]{protocol}[/], seed {self.request.seed}"
        )
        table = Table("experiment", "sweeps", "points", "pressures (kPa)", "hold (s)")
        for name, label in LABELS.items():
            sweeps = [s for s in plan.sweeps if s.experiment == name]
            if not sweeps:
                continue
            targets = sorted({key.target_kpa for sweep in sweeps for key in sweep.keys})
            table.add_row(
                label,
                str(len(sweeps)),
                str(sum(len(s.keys) for s in sweeps)),
                ", ".join(f"{t:g}" for t in targets),
                f"{plan.settings(sweeps[0].experiment).hold:g}",
            )
        if plan.keys:
            self.console.print(table)
            self.console.print(
                f"{len(plan.keys)} points, about {plan.duration_s / 60:.0f} min of bench time; "
                f"highest pressure {max(k.target_kpa for k in plan.keys):g} kPa, limit of the "
                f"actuator {setup.actuator.limits.pressure / 1e3:g} kPa."
            )
        if self.request.trials:
            self._show_trials()

    def _show_trials(self) -> None:
        table = Table("trial", "kind", "parts", "drive", "highest", "about (min)", "note")
        for plan in self.request.trials:
            first = plan.programs[0]
            top = max(float(p.values.max()) for p in plan.programs)
            unit, scale = ("kPa", 1e-3) if first.drive == "pressure" else ("mL", 1e6)
            table.add_row(
                escape(plan.trial.name),
                plan.trial.kind,
                str(len(plan.programs)),
                first.drive,
                f"{top * scale:.4g} {unit}",
                f"{plan.duration_s / 60:.1f}",
                escape(" ".join(first.notes)),
            )
        self.console.print(table)

    def run(self, out: Path | None) -> int:
        """Take the whole run; returns the exit code of the command."""
        setup = self.request.setup
        stem = f"{setup.actuator.name}-{setup.bench.name}-seed{self.request.seed}"
        folder = out or first_free(self.logs / stem)
        require_free_folder(folder)
        bench = self._open(folder, segment=0, start_s=0.0, faults=self.faults)
        return self._take(
            folder,
            bench,
            lambda observer, check: new_run(folder, bench, self.request, observer, check),
        )

    def resume(self, folder: Path) -> int:
        """Take what is left of the run in `folder`; returns the exit code of the command."""
        reader = RunReader(folder)
        points = reader.points()
        parts = reader.parts()
        done = [point.key for point in points]
        done_parts = [part.key for part in parts]
        stop = reader.stop()
        if stop is not None and stop.exit_status == "success":
            raise ExperimentError(
                f"the run {folder} is complete: all that was planned was measured. "
                f"`rig report {folder}` writes its report again."
            )
        bench = self._open(
            folder,
            segment=len(reader.resumes()) + 1,
            start_s=max(
                (*(p.measured_to_s for p in points), *(p.to_s for p in parts)), default=0.0
            ),
        )
        return self._take(
            folder,
            bench,
            lambda observer, check: resume_run(
                folder,
                bench,
                self.request,
                observer,
                done,
                check,
                done_parts,
                reader.rest_image(),
            ),
        )

    def _open(
        self, folder: Path, *, segment: int, start_s: float, faults: FaultScript | None = None
    ) -> Bench:
        setup = self.request.setup
        if setup.bench.simulated:
            with calculating(self.console) as job:
                return VirtualBench(
                    setup,
                    self.request.seed,
                    truth_path(folder, segment),
                    segment=segment,
                    start_s=start_s,
                    faults=faults,
                    job=job,
                )
        require_measured_calibrations(setup)
        return RealBench(setup.bench, setup.calibrations.camera, self._ask, start_s=start_s)

    def open_without_log(self) -> Bench:
        """The bench, to look at it: nothing is recorded, and calibrations may be anybody's."""
        setup = self.request.setup
        if setup.bench.simulated:
            return VirtualBench(setup, self.request.seed)
        return RealBench(setup.bench, setup.calibrations.camera, self._ask)

    def _ask(self, instruction: str) -> None:
        self.console.input(f"{instruction}, then press Enter. ")

    def _take(
        self,
        folder: Path,
        bench: Bench,
        take: Callable[[Observer, Callable[[], None]], RunOutcome],
    ) -> int:
        from rig.report.build import build_report

        try:
            with catching_signals() as interruption, ProgressObserver(self.console) as observer:
                outcome = take(observer, interruption.check)
        finally:
            bench.close()
        with calculating(self.console) as job:
            summary = build_report(folder, job=job)
        show_summary(self.console, summary, folder)
        if outcome.error is None:
            return 0
        how_on = (
            f"`rig resume {folder}` continues after the last complete point."
            if RunReader(folder).points() or RunReader(folder).parts()
            else "No point was complete: mend the cause and start a new run."
        )
        self.console.print(
            f"The run was {outcome.stop.exit_status}: {outcome.stop.reason} The log is closed; "
            f"{how_on}",
            style="bold",
            soft_wrap=True,
            markup=False,
        )
        return outcome.error.exit_code


def new_session(
    actuator: Path,
    bench: str,
    protocol: str,
    seed: int,
    faults: str | None = None,
    *,
    expired: bool = False,
) -> Session:
    """A session from spec files or names; `expired` calibrations are used only if that is asked.

    Raises SpecError, LimitError, ExperimentError for calibrations that have run out and, for
    `faults` on a real bench, BoardError.
    """
    workspace = Workspace.find()
    session = _session(workspace.setup(actuator, bench, protocol), seed, workspace.logs, expired)
    if faults is None:
        return session
    require_simulated(session.request.setup.bench)
    script = read(workspace.path("faults", faults), FaultScript)
    request = replace(session.request, enclosures={"faults.yaml": script.text})
    return replace(session, request=request, faults=script.spec)


def examine(actuator: str, bench: str, seed: int) -> list[Finding]:
    """What `rig doctor` sees of a bench, by names or files; raises SpecError and LimitError.

    A bench that cannot be opened is a finding, too.
    """
    session = new_session(Path(actuator), bench, "default", seed, expired=True)
    findings = look_at_machine(session.logs)
    try:
        opened = session.open_without_log()
    except (LinkError, BoardError) as error:
        return [*findings, Finding("port or camera", "failed", advice=str(error))]
    try:
        return findings + look_at_bench(opened, session.request, date.today())
    finally:
        opened.close()


def resumed_session(run: Path, *, expired: bool = False) -> Session:
    """A session from the specs and seed that are recorded in a run.

    Raises ExperimentError for recorded calibrations that have run out meanwhile, unless `expired`.
    """
    reader = RunReader(run)
    return _session(reader.setup(), reader.start().seed, run.parent, expired)


def _session(setup: Setup, seed: int, logs: Path, expired: bool) -> Session:
    return Session(make_request(setup, seed, expired=expired), logs, _RunConsole())
