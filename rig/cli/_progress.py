"""What a person sees while a run is taken: a bar with remaining bench time, and each point."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from rig.experiment.plan import Plan
from rig.record.documents import PointDocument, PointKey

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

    def began(self, plan: Plan, done: int) -> None:
        """Set the bar's length."""
        self._plan = plan
        self._done = done
        self._bar.update(self._task, total=len(plan.keys), completed=done)

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
        self._done += 1
        keys = self._plan.keys
        left_s = self._plan.duration_s * (1 - self._done / len(keys))
        self._bar.update(
            self._task, completed=self._done, left=f"{left_s / 60:.0f} min of bench time left"
        )
        last_of_sweep = any(sweep.keys[-1] == point.key for sweep in self._plan.sweeps)
        if last_of_sweep and not self._console.is_terminal:
            self._console.print(
                f"{LABELS[point.key.experiment]}, repeat {point.key.repeat}: done, "
                f"{self._done} of {len(keys)} points, {left_s / 60:.0f} min of bench time left"
            )
