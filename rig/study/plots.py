"""Response surfaces as pictures: contours and surfaces of pairs of factors, and residuals."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from rig.study.errors import StudyError
from rig.study.factors import Array, actual, term_name
from rig.study.surface import Surface

_GRID = 41
_FACES = 20
"""Of a surface each way; each face is drawn on its own, so they are what pictures cost."""


def plot_surface(path: Path, surface: Surface, points: Array, units: Mapping[str, str]) -> None:
    """Each pair of factors as contours (with the runs) and as a surface, the others at centre.

    `points` are the runs in coded factors, (n, k); `units` those of factors and response by name.
    Raises StudyError where it cannot be written.
    """
    from matplotlib.figure import Figure

    pairs = list(combinations(range(len(surface.factors)), 2))
    if not pairs:
        raise StudyError("contours need at least two factors; there is one.")
    figure = Figure(figsize=(5 * len(pairs), 9), layout="constrained")
    response = _labelled(surface.response, units)
    for at, (i, j) in enumerate(pairs):
        across, up = (_labelled(surface.factors[k].name, units) for k in (i, j))
        x, y, z = _grid(surface, i, j)
        flat = figure.add_subplot(2, len(pairs), at + 1)
        flat.clabel(flat.contour(x, y, z, 12), fontsize=7)
        runs = actual(surface.factors, points)
        flat.plot(runs[:, i], runs[:, j], "k.", ms=4)
        flat.set(xlabel=across, ylabel=up)
        solid: Any = figure.add_subplot(2, len(pairs), len(pairs) + at + 1, projection="3d")
        solid.plot_surface(x, y, z, cmap="viridis", lw=0, rcount=_FACES, ccount=_FACES)
        solid.set(xlabel=across, ylabel=up, zlabel=response)
    figure.suptitle(response)
    save(figure, path)


def plot_residuals(path: Path, surface: Surface, units: Mapping[str, str]) -> None:
    """Normal probability, residuals against fitted values and run order, and sizes of effects.

    `units` are those of the responses by name. Raises StudyError as `plot_surface`.
    """
    from matplotlib.figure import Figure
    from scipy.stats import probplot

    d, unit = surface.diagnostics, units.get(surface.response, "")
    figure = Figure(figsize=(10, 8), layout="constrained")
    normal, fitted, order, effects = figure.subplots(2, 2).ravel()
    (quantiles, values), _ = probplot(d.residual)
    normal.plot(quantiles, values, "o", ms=4)
    residual, fit = (_labelled(what, {what: unit}) for what in ("residual", "fitted"))
    normal.set(xlabel="normal quantile", ylabel=residual, title="normal probability")
    fitted.plot(d.fitted, d.residual, "o", ms=4)
    fitted.set(xlabel=fit, ylabel=residual, title="against fitted values")
    order.plot(np.arange(1, d.residual.size + 1), d.studentised, "o-", ms=4, lw=0.7)
    order.set(xlabel="run", ylabel="studentised residual", title="in order of the runs")
    errors = np.sqrt(np.diag(surface.covariance))
    sizes = {
        term_name(term, surface.factors): abs(value) / error
        for term, value, error in zip(surface.terms, surface.coefficients, errors, strict=True)
        if term
    }
    names = sorted(sizes, key=lambda name: sizes[name])
    effects.barh(names, [sizes[name] for name in names])
    effects.set(xlabel="|coefficient| / standard error", title="effects (coded factors)")
    figure.suptitle(surface.response)
    save(figure, path)


def _labelled(name: str, units: Mapping[str, str]) -> str:
    """What stands at an axis; pure numbers have no unit."""
    unit = units.get(name, "")
    return f"{name} ({unit})" if unit else name


def _grid(surface: Surface, i: int, j: int) -> tuple[Array, Array, Array]:
    u, v = np.meshgrid(np.linspace(-1, 1, _GRID), np.linspace(-1, 1, _GRID))
    points = np.zeros((u.size, len(surface.factors)))
    points[:, i], points[:, j] = u.ravel(), v.ravel()
    values = surface.predict(points).reshape(u.shape)
    where = actual(surface.factors, points)
    return where[:, i].reshape(u.shape), where[:, j].reshape(u.shape), values


def save(figure: Any, path: Path) -> None:
    """Write a matplotlib figure; raises StudyError where that is impossible."""
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise StudyError(
            f"the plot cannot be written to {path}: {error}. Name a file in an existing folder "
            f"that ends in .svg, .png or .pdf."
        ) from None
