"""`rig study`: a designed experiment, from its file to its statistics."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from rig.study.analysis import Analysis
    from rig.study.executor import Executor
    from rig.study.optimum import Optimum
    from rig.study.plan import Plan
    from rig.study.run import Standing, Study
    from rig.study.surface import Surface


class ExecutorName(StrEnum):
    """Where points are computed."""

    HERE = "here"
    LOCAL = "local"
    DASK = "dask"
    SLURM = "slurm"


@app.command()
def study(
    file: Annotated[Path, typer.Argument(help="Study file (YAML), or a name in models/studies.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results. Default: studies/NAME.")
    ] = None,
    executor: Annotated[
        ExecutorName, typer.Option(help="Where points are computed.")
    ] = ExecutorName.LOCAL,
    workers: Annotated[int, typer.Option(min=1, help="Points at a time.")] = 2,
    threads: Annotated[int, typer.Option(min=1, help="Threads of each worker.")] = 1,
    queue: Annotated[str | None, typer.Option(help="Partition of SLURM.")] = None,
    memory: Annotated[str, typer.Option(help="Memory of a job of SLURM.")] = "2GB",
    plots: Annotated[bool, typer.Option(help="Draw surfaces and residuals.")] = True,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show the points only.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Compute all points of a designed experiment and analyse their responses.

    Points that are known are not computed again: a study that was stopped goes on. Writes
    `results.parquet`, `manifest.json`, and for each response with a surface `NAME-surface.png` and
    `NAME-residuals.png`. Exits with 1 if a point failed.

    Example: `rig study bellow-bending-beam --out studies/beam`
    """
    from rich.console import Console

    from rig.cli._interruption import catching_signals
    from rig.spec.workspace import Workspace
    from rig.study.analysis import analyse, units_of
    from rig.study.plan import make_plan
    from rig.study.results import Folder
    from rig.study.run import run_study

    workspace = Workspace.find()
    plan = make_plan(workspace.path("study", file), workspace)
    console = Console(stderr=as_json)
    if dry_run:
        console.print(_points(plan))
        return
    folder = Folder(out or Path("studies") / plan.spec.name)
    how: dict[str, Any] = {"executor": executor.value}
    if executor is not ExecutorName.HERE:  # this process has no workers and its own threads
        how |= {"workers": workers, "threads": threads}
    with catching_signals("stopping; the points that are done are kept") as interruption:
        watch = _Watch(console, lambda: interruption.requested)
        finished = run_study(
            plan, folder, _executor(executor, workers, threads, queue, memory), watch, how=how
        )
    if finished is None:
        raise KeyboardInterrupt
    analysis = analyse(finished)
    if plots:
        _draw(folder.path, analysis, units_of(finished.plan))
    if as_json:
        typer.echo(_as_json(finished, analysis))
    else:
        _show(console, finished, analysis)
        console.print(f"results: {folder.path}", soft_wrap=True, markup=False)
    if finished.failed:
        raise typer.Exit(1)


def _executor(
    name: ExecutorName, workers: int, threads: int, queue: str | None, memory: str
) -> Executor:
    from rig.study.executor import InProcess, LocalProcesses, local_dask, slurm

    match name:
        case ExecutorName.HERE:
            return InProcess()
        case ExecutorName.LOCAL:
            return LocalProcesses(workers, threads)
        case ExecutorName.DASK:
            return local_dask(workers, threads)
        case ExecutorName.SLURM:
            options = {"memory": memory} | ({"queue": queue} if queue else {})
            return slurm(workers, threads, **options)


class _Watch:
    """Prints how far it got, on a terminal in place, elsewhere every tenth of the way."""

    def __init__(self, console: Console, stop: Any) -> None:
        self._console, self._stop, self._said = console, stop, -1

    def __call__(self, standing: Standing) -> bool:
        tenth = 10 * standing.done // max(standing.total, 1)
        if standing.total and (self._console.is_terminal or tenth != self._said):
            self._said = tenth
            left = "" if standing.left_s is None else f", about {standing.left_s:.0f} s left"
            self._console.print(
                f"{standing.done} of {standing.total} points{left}",
                end="\r" if self._console.is_terminal else "\n",
            )
        return not self._stop()


def _points(plan: Plan) -> Table:
    from rich.table import Table

    units = {name: field.lab_unit for name, field in plan.fields.items()}
    table = Table("point", *(f"{name}\n{unit}" for name, unit in units.items()), "")
    for point in plan.points:
        values = (f"{plan.in_lab_units(name, point.values[name]):.6g}" for name in units)
        table.add_row(point.name, *values, point.error or "")
    return table


def _draw(folder: Path, analysis: Analysis, units: Mapping[str, str]) -> None:
    from rig.study.factors import coded
    from rig.study.plots import plot_residuals, plot_surface

    for name, surface in analysis.surfaces.items():
        plot_residuals(folder / f"{name}-residuals.png", surface, units)
        if len(surface.factors) > 1:
            points = coded(surface.factors, analysis.points)
            plot_surface(folder / f"{name}-surface.png", surface, points, units)


def _show(console: Console, finished: Study, analysis: Analysis) -> None:
    known = len({point.key for point in finished.plan.points if point.key}) - finished.computed
    console.print(
        f"{len(finished.answers)} points: {finished.computed} computed, {known} known before, "
        f"{len(finished.failed)} failed"
    )
    for surface in analysis.surfaces.values():
        console.print(_anova(surface))
        console.print(
            f"R2 {surface.r2:.4f}, adjusted {surface.r2_adjusted:.4f}, predicted "
            f"{surface.r2_predicted:.4f}; adequate precision {surface.adequate_precision:.4g}; "
            f"C.V. {100 * surface.coefficient_of_variation:.3g} %",
            soft_wrap=True,
        )
        equation = " + ".join(
            f"{value:.5g} {name}" if name != "constant" else f"{value:.5g}"
            for name, value in surface.actual_coefficients().items()
        )
        console.print(f"{surface.response} = {equation}".replace("+ -", "- "), soft_wrap=True)
        check = analysis.checks.get(surface.response)
        if check is not None:
            console.print(f"at {check.words}", soft_wrap=True)
        normality = surface.diagnostics.normality
        if normality is not None:
            console.print(
                f"residuals: p = {normality:.3g} (Shapiro-Wilk), small where they are not normal"
            )
        point = analysis.stationary.get(surface.response)
        if point is not None:
            place = _place(analysis, point.actual, point.spread)
            where = "inside" if point.inside else "outside of the levels"
            console.print(
                f"stationary point ({point.nature}, {where}): {place}; {surface.response} = "
                f"{point.value:.4g}; curvatures in coded factors "
                + ", ".join(f"{value:.4g}" for value in point.eigenvalues),
                soft_wrap=True,
            )
    if analysis.best is not None:
        best = analysis.best
        console.print(
            f"optimum: {_place(analysis, best.actual, best.spread)}; {best.value:.5g}, one more "
            f"run within {best.interval[0]:.5g} to {best.interval[1]:.5g} (95 %)"
            + "".join(f"; {name} = {value:.5g}" for name, value in _limited(analysis, best).items())
            + "".join(f"; {name} is at a level" for name in _on_bounds(analysis, best)),
            soft_wrap=True,
        )
    for remark in analysis.remarks:
        console.print(f"remark: {remark}", soft_wrap=True, markup=False)


def _limited(analysis: Analysis, best: Optimum) -> dict[str, float]:
    return dict(zip(analysis.limited, best.limited, strict=True))


def _on_bounds(analysis: Analysis, best: Optimum) -> list[str]:
    """Factors that the optimum has at one of their levels: beyond may be better."""
    return [f.name for f, at in zip(analysis.factors, best.on_bounds, strict=True) if at]


def _place(analysis: Analysis, values: Any, spread: Any) -> str:
    return ", ".join(
        f"{factor.name} = {value:.4g} ± {error:.2g}"
        for factor, value, error in zip(analysis.factors, values, spread, strict=True)
    )


def _anova(surface: Surface) -> Table:
    from rich.table import Table

    table = Table("source", "DF", "adj. SS", "adj. MS", "F", "p", title=surface.response)
    for row in surface.sources:
        table.add_row(
            row.name,
            str(row.dof),
            f"{row.sum_of_squares:.5g}",
            "" if row.mean_square is None or row.name == "Total" else f"{row.mean_square:.5g}",
            "" if row.f is None else f"{row.f:.2f}",
            "" if row.p is None else ("< 0.0001" if row.p < 1e-4 else f"{row.p:.4f}"),
        )
    return table


def _as_json(finished: Study, analysis: Analysis) -> str:
    import json

    content = {
        "points": len(finished.answers),
        "computed": finished.computed,
        "failed": {point.name: answer.error for point, answer in finished.failed},
        "responses": {name: _plain(s, analysis) for name, s in analysis.surfaces.items()},
        "optimum": None
        if analysis.best is None
        else {
            "factors": _by_factor(analysis, analysis.best.actual),
            "spread": _by_factor(analysis, analysis.best.spread),
            "value": analysis.best.value,
            "interval": analysis.best.interval,
            "limited": _limited(analysis, analysis.best),
            "on_bounds": _on_bounds(analysis, analysis.best),
        },
        "remarks": analysis.remarks,
    }
    return json.dumps(content, indent=2)


def _plain(surface: Surface, analysis: Analysis) -> dict[str, Any]:
    from dataclasses import asdict

    from rig.study.factors import term_name

    check = analysis.checks.get(surface.response)
    point = analysis.stationary.get(surface.response)
    names = [term_name(term, surface.factors) for term in surface.terms]
    return {
        "coded_coefficients": dict(zip(names, surface.coefficients.tolist(), strict=True)),
        "coefficients": surface.actual_coefficients(),
        "anova": [
            {"source": r.name, "df": r.dof, "adj_ss": r.sum_of_squares, "f": r.f, "p": r.p}
            for r in surface.sources
        ],
        "r2": surface.r2,
        "r2_adjusted": surface.r2_adjusted,
        "r2_predicted": surface.r2_predicted,
        "adequate_precision": surface.adequate_precision,
        "coefficient_of_variation": surface.coefficient_of_variation,
        "normality_p": surface.diagnostics.normality,
        "check": None if check is None else asdict(check),
        "stationary_point": None
        if point is None
        else {
            "factors": _by_factor(analysis, point.actual),
            "spread": _by_factor(analysis, point.spread),
            "value": point.value,
            "nature": point.nature,
            "curvatures": point.eigenvalues.tolist(),
            "inside": point.inside,
        },
    }


def _by_factor(analysis: Analysis, values: Any) -> dict[str, float]:
    return {f.name: float(v) for f, v in zip(analysis.factors, values, strict=True)}
