"""Pictures of a search: parallel coordinates, principal components, Pareto front."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig.study.errors import StudyError
from rig.study.plots import save
from rig.study.search import Evaluation, Found

FEWEST_DRAWN = 3
"""Feasible evaluations that make a picture: principal components of fewer are a line."""


def plot_search(path: Path, found: Found) -> None:
    """All feasible evaluations; the best ones are drawn on top. Raises StudyError."""
    from matplotlib.figure import Figure

    feasible = [one for one in found.memory.evaluations if one.feasible]
    if len(feasible) < FEWEST_DRAWN:
        raise StudyError(
            f"{len(feasible)} evaluations kept all limits; a picture of the search needs "
            f"{FEWEST_DRAWN}."
        )
    factors = found.memory.space.factors
    names = [f.name for f in factors] + [r.name for r in found.memory.responses]
    table = np.array([_row(one, found) for one in feasible])
    low, spread = table.min(axis=0), np.ptp(table, axis=0)
    unit = (table - low) / np.where(spread > 0, spread, 1.0)
    order = np.argsort([one.objectives[0] for one in feasible])[::-1]
    rank = np.linspace(0, 1, len(order))
    best = {id(one) for one in found.best}
    figure = Figure(figsize=(13, 4.6), layout="constrained")
    lines, components, last = figure.subplots(1, 3)
    for at, shade in zip(order, rank, strict=True):
        top = id(feasible[at]) in best
        lines.plot(unit[at], color="C3" if top else (0.2, 0.3, 0.6, 0.05 + 0.3 * shade), lw=1)
    lines.set_xticks(range(len(names)), names, rotation=45)
    lines.set(ylabel="share of the range", title="parallel coordinates (red: best)")
    centred = unit[:, : len(factors)] - unit[:, : len(factors)].mean(axis=0)
    _, singular, axes = np.linalg.svd(centred, full_matrices=False)
    place = centred @ axes[:2].T
    share = singular**2 / max(float(np.sum(singular**2)), 1e-300)
    values = np.array([one.objectives[0] for one in feasible])
    if place.shape[1] == 2:
        shown = components.scatter(*place.T, c=values, s=12, cmap="viridis_r")
        figure.colorbar(shown, ax=components, label="first objective (small is good)")
        components.set(
            xlabel=f"component 1 ({100 * share[0]:.0f} %)",
            ylabel=f"component 2 ({100 * share[1]:.0f} %)",
            title="principal components of the factors",
        )
    if values.size and len(feasible[0].objectives) > 1:
        other = np.array([one.objectives[1] for one in feasible])
        last.plot(values, other, ".", color="0.7")
        edge = np.array([one.objectives[:2] for one in found.best])
        last.plot(*edge.T, "o-", color="C3")
        last.set(xlabel="objective 1", ylabel="objective 2", title="Pareto front")
    else:
        last.plot(np.minimum.accumulate(values))
        last.set(xlabel="feasible evaluation", ylabel="best so far", title="progress")
    save(figure, path)


def _row(one: Evaluation, found: Found) -> list[float]:
    space, values = found.memory.space, one.answer.values or {}
    factors = [space.in_lab_units(f.name, one.point.values[f.name]) for f in space.factors]
    return factors + [values[r.name] for r in found.memory.responses]
