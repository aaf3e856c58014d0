"""What a person sees while a run is taken: a bar with remaining bench time, and each point."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from rig.experiment.plan import Plan
from rig.experiment.program import TrialPlan
from rig.experiment.trials import describe_part
from rig.record.documents import PartDocument, PointDocument, PointKey

LABELS = {"deformation": "deformation", "blocked_force": "blocked force"}


class ProgressObserver:
    """Shows a run on a terminal; on anything else prints one line a sweep."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[left]}"),
            TimeElapsedColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("starting", total=None, left="")
        self._plan: Plan | None = None
        self._done = 0
        self._total = 0
        self._duration_s = 0.0

    def __enter__(self) -> ProgressObserver:
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def began(self, plan: Plan, trials: Sequence[TrialPlan], done: int) -> None:
        """Set the bar's length."""
        self._plan = plan
        self._done = done
        self._total = len(plan.keys) + sum(len(trial.programs) for trial in trials)
        self._duration_s = plan.duration_s + sum(trial.duration_s for trial in trials)
        self._bar.update(self._task, total=self._total, completed=done)

    def stage(self, text: str) -> None:
        """Name a step outside the points."""
        self._bar.update(self._task, description=text)

    def warned(self, text: str) -> None:
        """Say so at once."""
        self._console.print(f"Warning: {text}", style="bold yellow", markup=False, soft_wrap=True)

    def point_began(self, key: PointKey) -> None:
        """Name the point."""
        self._bar.update(
            self._task,
            description=f"{LABELS[key.experiment]} {key.repeat}: {key.target_kpa:g} kPa",
        )

    def point_done(self, point: PointDocument) -> None:
        """Advance the bar; on no terminal, say when a sweep is complete."""
        assert self._plan is not None
        left = self._advance()
        if any(sweep.keys[-1] == point.key for sweep in self._plan.sweeps):
            self._say(f"{LABELS[point.key.experiment]}, repeat {point.key.repeat}: done, {left}")

    def part_done(self, part: PartDocument) -> None:
        """Advance the bar; on no terminal, say so."""
        self._say(f"{describe_part(part.key)}: done, {self._advance()}")

    def _advance(self) -> str:
        """One more is done; how much is left, in words."""
        self._done += 1
        left_min = self._duration_s * (1 - self._done / self._total) / 60
        left = f"{left_min:.0f} min of bench time left"
        self._bar.update(self._task, completed=self._done, left=left)
        return f"{self._done} of {self._total} points, {left}"

    def _say(self, text: str) -> None:
        if not self._console.is_terminal:
            self._console.print(text)
